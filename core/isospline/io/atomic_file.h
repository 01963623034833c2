// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <fstream>

namespace isospline {

/// An output stream into a file beside `target`, which takes the target's place on commit() and goes away without it.
///
/// Throws std::filesystem::filesystem_error, which names the target, where the file cannot be opened, written or
/// renamed.
class AtomicFile {
public:
    explicit AtomicFile(const std::filesystem::path& target);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    std::ofstream& stream() { return stream_; }
    /// Closes the file and gives it the target's name.
    void commit();

private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::ofstream stream_;
};

} // namespace isospline
