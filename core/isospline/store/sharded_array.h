// The coefficients of a volume in a sharded Zarr 3 array, read chunk by chunk from disk.
#pragma once

#include "isospline/spline/coefficient_source.h"
#include "isospline/util/memory_budget.h"

#include <glm/vec3.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace isospline {

/// Pages of files; the least recently used ones are dropped when room is needed.
///
/// Any number of threads may ask at the same time. Nobody waits: two threads that need the same missing page both load
/// it.
class PageCache {
public:
    using Page = std::vector<std::byte>;

    /// Pages are divided among stripes, each with a part of the limit, so that threads seldom ask for the same one.
    explicit PageCache(std::size_t stripe_count) : stripes_(stripe_count) {}

    /// The page of a key; it is loaded if it is missing. Then the least recently used pages are dropped until about
    /// `limit` bytes are left, but at least one page a stripe.
    std::shared_ptr<const Page> get(std::uint64_t key, std::size_t limit, const std::function<Page()>& load);
    std::size_t memory() const;

private:
    struct Entry {
        std::uint64_t key;
        std::shared_ptr<const Page> page;
    };

    /// Under the fork-safe mutex of its address.
    struct Stripe {
        std::list<Entry> entries; ///< the most recently used first
        std::unordered_map<std::uint64_t, std::list<Entry>::iterator> places;
        std::size_t bytes = 0;
    };

    std::vector<Stripe> stripes_;
};

/// The layout of an array, from Zarr's metadata (zarr.json). Shapes are in the order x, y, z; the array's axes are z,
/// y, x.
struct ShardedArrayLayout {
    std::filesystem::path folder; ///< of the array
    glm::ivec3 shape{0};
    glm::ivec3 shard{0}; ///< samples of a shard, a file; a multiple of `chunk`
    glm::ivec3 chunk{0}; ///< samples of a chunk, which is read and checked as a whole
};

/// A shard cannot be read, or differs from what was written.
class StoreError : public std::filesystem::filesystem_error {
public:
    StoreError(const std::string& what, const std::filesystem::path& file, int reason);
    /// What went wrong, without the file's name.
    const std::string& text() const { return text_; }

private:
    std::string text_;
};

/// A Zarr 3 array of little-endian float32 with the codec sharding_indexed. Its chunks and its index have the codecs
/// bytes and crc32c, and the index is at the end: see the Zarr specification, version 3, "Sharding codec". A chunk is
/// read and checked when its coefficients are first needed. The most recently used chunks are kept.
///
/// A chunk that cannot be read, or fails its check, raises a StoreError that names the chunk and the file.
/// Symbolic links inside the array's folder are not followed.
class ShardedArray final : public CoefficientSource {
public:
    /// `ranges` are those of the volume's bricks, in the layout of BrickRanges::Octet. Chunks, and the bricks that
    /// `budget()` counts, take about `memory_limit` bytes in all: chunks have what bricks do not use. Throws
    /// std::invalid_argument for shapes that do not fit together, and StoreError if the folder does not exist.
    ShardedArray(const ShardedArrayLayout& layout, std::vector<float> ranges, std::size_t memory_limit);
    ~ShardedArray() override;
    ShardedArray(const ShardedArray&) = delete;
    ShardedArray& operator=(const ShardedArray&) = delete;

    void copy(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
              std::ptrdiff_t slice_stride) const override;
    std::span<const float> brick_ranges() const override { return ranges_; }
    MemoryBudget* budget() const override { return &budget_; }
    std::size_t memory() const override;

    const ShardedArrayLayout& layout() const { return layout_; }
    std::size_t memory_limit() const { return memory_limit_; }
    /// Since the array was opened.
    std::uint64_t bytes_read() const { return bytes_read_; }
    std::uint64_t chunks_read() const { return chunks_read_; }

private:
    /// The bytes that bricks leave for chunks.
    std::size_t limit_of_chunks() const;
    PageCache::Page read_index(const glm::ivec3& shard) const;
    PageCache::Page read_chunk(const glm::ivec3& chunk) const;

    const ShardedArrayLayout layout_;
    const glm::ivec3 chunks_per_shard_;
    const std::vector<float> ranges_;
    const std::size_t memory_limit_;
    const std::size_t part_; ///< of the memory, in bytes
    mutable MemoryBudget budget_;
    mutable PageCache indices_, chunks_;
    const int folder_; ///< open
    mutable std::atomic<std::uint64_t> bytes_read_ = 0, chunks_read_ = 0;
};

} // namespace isospline
