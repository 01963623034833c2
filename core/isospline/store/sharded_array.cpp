#include "isospline/store/sharded_array.h"

#include "isospline/math/grid.h"
#include "isospline/util/check.h"
#include "isospline/util/crc32c.h"
#include "isospline/util/error.h"
#include "isospline/util/fork.h"

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <limits>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace isospline {

namespace {

constexpr std::size_t checksum_size = sizeof(std::uint32_t);

/// The memory is divided into parts. Some are for the indices of shards; the rest is for bricks, up to their limit, and
/// for chunks.
constexpr std::size_t parts = 32, parts_of_indices = 1, parts_of_bricks = 23;

constexpr std::size_t most_stripes = 16;

/// The number of stripes for pages of a size. Each has room for many pages. With few, a page would soon be dropped
/// where others of its stripe are in use, while other stripes have older ones.
std::size_t stripe_count(std::size_t limit, std::size_t page_size)
{
    constexpr std::size_t least_pages = 32;
    return std::clamp<std::size_t>(limit / (least_pages * page_size), 1, most_stripes);
}

/// Where a chunk is in its shard.
struct Place {
    std::uint64_t offset, size;
    /// Whether the shard does not have the chunk.
    bool is_missing() const { return offset == std::numeric_limits<std::uint64_t>::max() && size == offset; }
};

bool has_right_checksum(const PageCache::Page& page)
{
    std::uint32_t expected;
    std::memcpy(&expected, page.data() + page.size() - checksum_size, checksum_size);
    return crc32c(page.data(), page.size() - checksum_size) == expected;
}

/// An open file or folder.
class Descriptor {
public:
    explicit Descriptor(int number) : number_(number) {}
    ~Descriptor()
    {
        if (number_ >= 0)
            close(number_);
    }
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept
    {
        std::swap(number_, other.number_);
        return *this;
    }
    int get() const { return number_; }

private:
    int number_;
};

/// A file in an array's folder. Each folder of its path is opened separately, so that no link is followed.
class ArrayFile {
public:
    ArrayFile(int array_folder, const std::filesystem::path& array, const std::filesystem::path& name)
        : path_(array / name), file_(dup(array_folder))
    {
        std::size_t left = static_cast<std::size_t>(std::distance(name.begin(), name.end()));
        for (const std::filesystem::path& part : name) {
            const int kind = --left > 0 ? O_DIRECTORY : O_NONBLOCK; // opening a pipe would block
            file_ = Descriptor(openat(file_.get(), part.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | kind));
            if (file_.get() < 0)
                fail("cannot open a shard", errno);
        }
        struct stat status {};
        if (fstat(file_.get(), &status) != 0)
            fail("cannot open a shard", errno);
        if (!S_ISREG(status.st_mode))
            fail("a shard is not a file", EINVAL);
        size_ = static_cast<std::uint64_t>(status.st_size);
        posix_fadvise(file_.get(), 0, 0, POSIX_FADV_RANDOM); // do not read ahead: neighbours may not be needed
    }

    std::uint64_t size() const { return size_; }

    PageCache::Page read(std::uint64_t offset, std::size_t size, const std::string& what) const
    {
        if (offset > size_ || size > size_ - offset)
            fail("the file ends before " + what + " does", EIO);
        PageCache::Page page(size);
        for (std::size_t done = 0; done < size;) {
            const ssize_t count =
                pread(file_.get(), page.data() + done, size - done, static_cast<off_t>(offset + done));
            if (count < 0 && errno == EINTR)
                continue;
            if (count <= 0)
                fail(count < 0 ? "cannot read " + what : what + " is cut short", count < 0 ? errno : EIO);
            done += static_cast<std::size_t>(count);
        }
        return page;
    }

    [[noreturn]] void fail(const std::string& what, int reason) const { throw StoreError(what, path_, reason); }

private:
    std::filesystem::path path_;
    Descriptor file_;
    std::uint64_t size_ = 0;
};

std::filesystem::path name_of_shard(const glm::ivec3& shard)
{
    return std::filesystem::path("c") / std::to_string(shard.z) / std::to_string(shard.y) / std::to_string(shard.x);
}

std::string name_of_chunk(const glm::ivec3& chunk)
{
    return "chunk (" + std::to_string(chunk.z) + ", " + std::to_string(chunk.y) + ", " + std::to_string(chunk.x) + ")";
}

const ShardedArrayLayout& checked(const ShardedArrayLayout& layout)
{
    const auto text = [](const glm::ivec3& shape) { return to_text(glm::dvec3(shape)); };
    if (glm::any(glm::lessThan(layout.shape, glm::ivec3(1))))
        throw_invalid("shape", "at least one sample along each axis", text(layout.shape));
    if (glm::any(glm::lessThan(layout.chunk, glm::ivec3(1))) || place_count(layout.chunk) > (1 << 24))
        throw_invalid("chunk", "1 to 2^24 samples", text(layout.chunk));
    if (glm::any(glm::lessThan(layout.shard, glm::ivec3(1))) || layout.shard % layout.chunk != glm::ivec3(0))
        throw_invalid("shard", "a multiple of the chunk, " + text(layout.chunk), text(layout.shard));
    return layout;
}

/// The bytes that are left for chunks and bricks.
std::size_t left_of(std::size_t limit, std::size_t ranges, const glm::ivec3& chunk)
{
    constexpr std::size_t least_chunks = 256;
    const std::size_t least = ranges + least_chunks * static_cast<std::size_t>(place_count(chunk)) * sizeof(float);
    if (limit < least)
        throw_invalid("memory_limit", "at least " + std::to_string(least) + " bytes for this store", limit);
    return limit - ranges;
}

} // namespace

std::shared_ptr<const PageCache::Page> PageCache::get(std::uint64_t key, std::size_t limit,
                                                      const std::function<Page()>& load)
{
    // The multiplication puts neighbours into different stripes.
    Stripe& stripe = stripes_[(key * 0x9e3779b97f4a7c15u >> 32) % stripes_.size()];
    {
        const std::lock_guard lock(fork_safe_mutex(&stripe));
        if (const auto found = stripe.places.find(key); found != stripe.places.end()) {
            stripe.entries.splice(stripe.entries.begin(), stripe.entries, found->second);
            return found->second->page;
        }
    }
    auto page = std::make_shared<const Page>(load());
    const std::lock_guard lock(fork_safe_mutex(&stripe));
    if (const auto found = stripe.places.find(key); found != stripe.places.end())
        return found->second->page;
    stripe.entries.push_front({key, page});
    stripe.places[key] = stripe.entries.begin();
    stripe.bytes += page->size();
    while (stripe.bytes > limit / stripes_.size() && stripe.entries.size() > 1) {
        stripe.bytes -= stripe.entries.back().page->size();
        stripe.places.erase(stripe.entries.back().key);
        stripe.entries.pop_back();
    }
    return page;
}

std::size_t PageCache::memory() const
{
    std::size_t bytes = 0;
    for (const Stripe& stripe : stripes_) {
        const std::lock_guard lock(fork_safe_mutex(&stripe));
        bytes += stripe.bytes;
    }
    return bytes;
}

StoreError::StoreError(const std::string& what, const std::filesystem::path& file, int reason)
    : filesystem_error("store: " + what, file, std::error_code(reason, std::generic_category())),
      // A wrong checksum is not an error of the operating system.
      text_(reason == EIO ? what : what + ": " + code().message())
{
}

ShardedArray::ShardedArray(const ShardedArrayLayout& layout, std::vector<float> ranges, std::size_t memory_limit)
    : layout_(checked(layout)), chunks_per_shard_(layout_.shard / layout_.chunk), ranges_(std::move(ranges)),
      memory_limit_(memory_limit), part_(left_of(memory_limit, ranges_.size() * sizeof(float), layout_.chunk) / parts),
      budget_(parts_of_bricks * part_), indices_(most_stripes),
      chunks_(stripe_count((parts - parts_of_indices - parts_of_bricks) * part_,
                           static_cast<std::size_t>(place_count(layout_.chunk)) * sizeof(float))),
      folder_(open(layout_.folder.c_str(), O_RDONLY | O_CLOEXEC | O_DIRECTORY))
{
    if (folder_ < 0)
        throw StoreError("cannot open an array", layout_.folder, errno);
}

ShardedArray::~ShardedArray()
{
    close(folder_);
}

std::size_t ShardedArray::memory() const
{
    return ranges_.size() * sizeof(float) + indices_.memory() + chunks_.memory();
}

std::size_t ShardedArray::limit_of_chunks() const
{
    return (parts - parts_of_indices) * part_ - std::min(budget_.held(), budget_.limit());
}

PageCache::Page ShardedArray::read_index(const glm::ivec3& shard) const
{
    const ArrayFile file(folder_, layout_.folder, name_of_shard(shard));
    const std::size_t size = static_cast<std::size_t>(place_count(chunks_per_shard_)) * sizeof(Place) + checksum_size;
    PageCache::Page index = file.read(file.size() - std::min<std::uint64_t>(size, file.size()), size, "its index");
    if (!has_right_checksum(index))
        file.fail("the checksum of its index is wrong", EIO);
    bytes_read_ += size;
    return index;
}

PageCache::Page ShardedArray::read_chunk(const glm::ivec3& chunk) const
{
    const glm::ivec3 shard = chunk / chunks_per_shard_;
    const glm::ivec3 shards = (layout_.shape + layout_.shard - 1) / layout_.shard;
    const auto index =
        indices_.get(place_in(shards, shard), parts_of_indices * part_, [&] { return read_index(shard); });
    Place place;
    std::memcpy(&place, index->data() + place_in(chunks_per_shard_, chunk % chunks_per_shard_) * sizeof place,
                sizeof place);
    const ArrayFile file(folder_, layout_.folder, name_of_shard(shard));
    const std::string name = name_of_chunk(chunk);
    if (place.is_missing())
        file.fail(name + " is missing", ENOENT);
    const std::size_t size = static_cast<std::size_t>(place_count(layout_.chunk)) * sizeof(float) + checksum_size;
    if (place.size != size)
        file.fail(name + " has " + std::to_string(place.size) + " bytes, expected " + std::to_string(size), EIO);
    PageCache::Page page = file.read(place.offset, size, name);
    if (!has_right_checksum(page))
        file.fail("the checksum of " + name + " is wrong", EIO);
    bytes_read_ += size;
    ++chunks_read_;
    return page;
}

void ShardedArray::copy(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
                        std::ptrdiff_t slice_stride) const
{
    const glm::ivec3 chunks = (layout_.shape + layout_.chunk - 1) / layout_.chunk;
    const glm::ivec3 first_chunk = first / layout_.chunk, last_chunk = (first + size - 1) / layout_.chunk;
    const std::size_t limit = limit_of_chunks();
    glm::ivec3 chunk;
    for (chunk.z = first_chunk.z; chunk.z <= last_chunk.z; ++chunk.z)
        for (chunk.y = first_chunk.y; chunk.y <= last_chunk.y; ++chunk.y)
            for (chunk.x = first_chunk.x; chunk.x <= last_chunk.x; ++chunk.x) {
                const auto page = chunks_.get(place_in(chunks, chunk), limit, [&] { return read_chunk(chunk); });
                const glm::ivec3 corner = chunk * layout_.chunk;
                const glm::ivec3 begin = glm::max(first, corner);
                const glm::ivec3 end = glm::min(first + size, corner + layout_.chunk);
                const auto row_size = static_cast<std::size_t>(end.x - begin.x) * sizeof(float);
                for (int z = begin.z; z < end.z; ++z)
                    for (int y = begin.y; y < end.y; ++y)
                        std::memcpy(
                            to + (begin.x - first.x) + (y - first.y) * row_stride + (z - first.z) * slice_stride,
                            page->data() + place_in(layout_.chunk, {begin.x - corner.x, y - corner.y, z - corner.z}) *
                                               sizeof(float),
                            row_size);
            }
}

} // namespace isospline
