#include "isospline/io/atomic_file.h"

#include <cerrno>
#include <random>
#include <sstream>
#include <system_error>

namespace isospline {

namespace {

/// A hidden name in the target's folder that nobody else uses.
std::filesystem::path temporary_beside(const std::filesystem::path& target)
{
    std::random_device random;
    std::ostringstream name;
    name << '.' << target.filename().string() << '.' << std::hex << random() << random() << ".part";
    return target.parent_path() / name.str();
}

[[noreturn]] void throw_unwritable(const std::filesystem::path& target, std::error_code reason)
{
    throw std::filesystem::filesystem_error("cannot write the file", target, reason);
}

std::error_code last_error()
{
    return errno != 0 ? std::error_code(errno, std::generic_category()) : std::make_error_code(std::errc::io_error);
}

} // namespace

AtomicFile::AtomicFile(const std::filesystem::path& target) : target_(target), temporary_(temporary_beside(target))
{
    // A folder would only refuse at the end, when all the work is done.
    std::error_code ignored;
    if (std::filesystem::is_directory(target_, ignored))
        throw_unwritable(target_, std::make_error_code(std::errc::is_a_directory));
    errno = 0;
    stream_.open(temporary_, std::ios::binary | std::ios::trunc);
    if (!stream_)
        throw_unwritable(target_, last_error());
}

AtomicFile::~AtomicFile()
{
    stream_.close();
    std::error_code ignored;
    if (!temporary_.empty())
        std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::commit()
{
    errno = 0;
    stream_.close();
    if (!stream_)
        throw_unwritable(target_, last_error());
    std::error_code reason;
    std::filesystem::rename(temporary_, target_, reason);
    if (reason)
        throw_unwritable(target_, reason);
    temporary_.clear();
}

} // namespace isospline
