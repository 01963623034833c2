// Files that are written completely or not at all.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>

namespace isospline {

/// An output stream into a temporary file next to `target`. commit() renames it to the target; otherwise it is removed.
///
/// The new file keeps the permissions of the one that it replaces. If `target` is a symbolic link, the file that the
/// link points to is replaced.
///
/// Throws std::filesystem::filesystem_error, which names the target, if the file cannot be opened, written or
/// renamed, and std::invalid_argument if the target is a device, a pipe or a socket.
class AtomicFile {
public:
    explicit AtomicFile(const std::filesystem::path& target);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    std::ofstream& stream() { return stream_; }
    /// The temporary file, for code that writes to it by name.
    const std::filesystem::path& temporary() const { return temporary_; }
    /// Closes the file and gives it the target's name.
    void commit();
    /// Closes and removes a file that was not committed.
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
