// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>

namespace isospline {

/// An output stream into a file beside `target`, which takes the target's place on commit() and goes away without it.
///
/// The file that is replaced leaves its permissions; where `target` is a symbolic link, it is what the link leads to.
///
/// Throws std::filesystem::filesystem_error, which names the target, where the file cannot be opened, written or
/// renamed, and std::invalid_argument where the target is a device, a pipe or a socket.
class AtomicFile {
public:
    explicit AtomicFile(const std::filesystem::path& target);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    std::ofstream& stream() { return stream_; }
    /// The file that becomes the target, for those who write to it by its name.
    const std::filesystem::path& temporary() const { return temporary_; }
    /// Closes the file and gives it the target's name.
    void commit();
    /// Closes and removes what was not committed.
    void discard() noexcept;

private:
    [[noreturn]] void throw_unwritable(int reason) const;
    std::filesystem::path followed() const;
    void look_at_replaced();

    std::filesystem::path target_;
    std::filesystem::path replaced_;
    std::filesystem::path temporary_;
    std::optional<std::filesystem::perms> permissions_;
    std::ofstream stream_;
};

} // namespace isospline
