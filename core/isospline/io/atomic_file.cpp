#include "isospline/io/atomic_file.h"

#include "isospline/util/error.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <random>
#include <sstream>
#include <system_error>
#include <utility>

namespace isospline {

namespace {

/// A unique hidden name. It is short, independent of the target's name: names have at most 255 bytes.
std::string temporary_name()
{
    std::random_device random;
    std::ostringstream name;
    name << '.' << std::hex << random() << random() << ".part";
    return name.str();
}

} // namespace

AtomicFile::AtomicFile(const std::filesystem::path& target) : target_(target), replaced_(followed())
{
    look_at_replaced();
    std::filesystem::path temporary = replaced_.parent_path() / temporary_name();
    // A file that only its owner can read must not be readable by others meanwhile.
    const mode_t mode = permissions_ ? static_cast<mode_t>(*permissions_) & 0666 : 0666;
    const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode | S_IWUSR);
    if (descriptor < 0)
        throw_unwritable(errno);
    temporary_ = std::move(temporary);
    ::close(descriptor);
    errno = 0;
    try {
        stream_.open(temporary_, std::ios::binary | std::ios::trunc);
    } catch (...) { // allocating its buffer can fail
        discard();
        throw;
    }
    if (!stream_) {
        const int reason = errno;
        discard();
        throw_unwritable(reason);
    }
}

AtomicFile::~AtomicFile()
{
    discard();
}

void AtomicFile::commit()
{
    // If the stream failed before, errno still has the reason.
    if (stream_)
        errno = 0;
    stream_.close();
    if (!stream_)
        throw_unwritable(errno);
    std::error_code reason;
    if (permissions_)
        std::filesystem::permissions(temporary_, *permissions_, reason);
    if (!reason)
        std::filesystem::rename(temporary_, replaced_, reason);
    if (reason)
        throw_unwritable(reason.value());
    temporary_.clear();
}

void AtomicFile::discard() noexcept
{
    stream_.close();
    if (!temporary_.empty())
        ::unlink(temporary_.c_str());
    temporary_.clear();
}

void AtomicFile::throw_unwritable(int reason) const
{
    const std::error_code code(reason != 0 ? reason : EIO, std::generic_category());
    throw std::filesystem::filesystem_error("cannot write the file", target_, code);
}

/// The file that the target points to, through symbolic links; it need not exist.
std::filesystem::path AtomicFile::followed() const
{
    constexpr int most_links = 40; // the limit of Linux
    std::filesystem::path path = target_;
    for (int link = 0; link < most_links; ++link) {
        std::error_code reason;
        const auto status = std::filesystem::symlink_status(path, reason);
        if (status.type() == std::filesystem::file_type::not_found)
            return path;
        if (reason)
            throw_unwritable(reason.value());
        if (status.type() != std::filesystem::file_type::symlink)
            return path;
        const auto next = std::filesystem::read_symlink(path, reason);
        if (reason)
            throw_unwritable(reason.value());
        path = path.parent_path() / next;
    }
    throw_unwritable(ELOOP);
}

/// Throws now for targets that could not be replaced at the end, after all the work, or that must not be replaced.
void AtomicFile::look_at_replaced()
{
    struct stat status = {};
    if (::stat(replaced_.c_str(), &status) != 0) {
        if (errno != ENOENT)
            throw_unwritable(errno);
        return;
    }
    if (S_ISDIR(status.st_mode))
        throw_unwritable(EISDIR);
    if (!S_ISREG(status.st_mode))
        throw_invalid("path", "the name of a file, or a new one", "that of a device, a pipe or a socket");
    if (::access(replaced_.c_str(), W_OK) != 0)
        throw_unwritable(errno);
    permissions_ = static_cast<std::filesystem::perms>(status.st_mode & 0777);
}

} // namespace isospline
