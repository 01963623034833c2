#include "isospline/store/sharded_array.h"

#include "catch.h"

#include "isospline/math/grid.h"
#include "isospline/util/crc32c.h"

#include <glm/common.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <unistd.h>

using namespace isospline;

namespace {

const std::filesystem::path temporary =
    std::filesystem::temp_directory_path() / ("isospline_store_" + std::to_string(getpid()));

void append(std::string& bytes, const void* data, std::size_t size)
{
    bytes.append(static_cast<const char*>(data), size);
}

void append_checksum(std::string& bytes, std::size_t begin)
{
    const std::uint32_t checksum = crc32c(bytes.data() + begin, bytes.size() - begin);
    append(bytes, &checksum, sizeof checksum);
}

/// An array on disk whose sample at (x, y, z) is its place in the array.
class ArrayOnDisk {
public:
    explicit ArrayOnDisk(const ShardedArrayLayout& of) : layout(of)
    {
        const glm::ivec3 shards = (layout.shape + layout.shard - 1) / layout.shard;
        for (std::uint64_t i = 0; i < place_count(shards); ++i)
            write_shard(at_place(shards, i));
    }
    ~ArrayOnDisk() { std::filesystem::remove_all(layout.folder); }
    ArrayOnDisk(const ArrayOnDisk&) = delete;
    ArrayOnDisk& operator=(const ArrayOnDisk&) = delete;

    std::filesystem::path path(const glm::ivec3& shard) const
    {
        return layout.folder / "c" / std::to_string(shard.z) / std::to_string(shard.y) / std::to_string(shard.x);
    }

    ShardedArrayLayout layout;

private:
    void write_shard(const glm::ivec3& shard)
    {
        const glm::ivec3 chunks = layout.shard / layout.chunk;
        std::string bytes, index;
        for (std::uint64_t i = 0; i < place_count(chunks); ++i) {
            const glm::ivec3 first = shard * layout.shard + at_place(chunks, i) * layout.chunk;
            std::uint64_t place[2] = {std::numeric_limits<std::uint64_t>::max(),
                                      std::numeric_limits<std::uint64_t>::max()};
            if (first.x < layout.shape.x && first.y < layout.shape.y && first.z < layout.shape.z) {
                place[0] = bytes.size();
                for (std::uint64_t j = 0; j < place_count(layout.chunk); ++j) {
                    const glm::ivec3 at = first + at_place(layout.chunk, j);
                    const bool is_inside = at.x < layout.shape.x && at.y < layout.shape.y && at.z < layout.shape.z;
                    const float sample = is_inside ? static_cast<float>(place_in(layout.shape, at)) : -1.0f;
                    append(bytes, &sample, sizeof sample);
                }
                append_checksum(bytes, place[0]);
                place[1] = bytes.size() - place[0];
            }
            append(index, place, sizeof place);
        }
        append_checksum(index, 0);
        std::filesystem::create_directories(path(shard).parent_path());
        std::ofstream(path(shard), std::ios::binary) << bytes << index;
    }
};

const ShardedArrayLayout small{temporary, {37, 20, 9}, {16, 16, 8}, {8, 4, 4}};
constexpr std::size_t memory_limit = 1 << 20;

/// The number of samples in a box that differ from the written ones.
std::size_t wrong_in_box(const ShardedArray& array, const glm::ivec3& first, const glm::ivec3& size)
{
    const std::ptrdiff_t row = size.x + 3, slice = row * size.y + 5;
    std::vector<float> box(static_cast<std::size_t>(slice * size.z), -7.0f);
    array.copy(first, size, box.data(), row, slice);
    std::size_t wrong = 0;
    for (std::uint64_t i = 0; i < place_count(size); ++i) {
        const glm::ivec3 at = at_place(size, i);
        const float sample = box[static_cast<std::size_t>(at.x + at.y * row + at.z * slice)];
        wrong += sample != static_cast<float>(place_in(array.layout().shape, first + at));
    }
    return wrong;
}

std::string error_of_box(const ShardedArray& array, const glm::ivec3& first, const glm::ivec3& size)
{
    try {
        wrong_in_box(array, first, size);
    } catch (const std::filesystem::filesystem_error& error) {
        return error.what();
    }
    return "";
}

/// Changes a byte of a file.
void flip(const std::filesystem::path& path, std::streamoff offset, std::ios::seekdir from)
{
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(offset, from);
    const char byte = static_cast<char>(file.peek() ^ 0x10);
    file.seekp(offset, from);
    file.put(byte);
}

} // namespace

TEST_CASE("boxes of a sharded array are as written", "[store]")
{
    const ArrayOnDisk disk(small);
    const ShardedArray array(small, {}, memory_limit);
    REQUIRE(wrong_in_box(array, {0, 0, 0}, small.shape) == 0);
    std::mt19937 random(1);
    for (int trial = 0; trial < 200; ++trial) {
        glm::ivec3 first, size;
        for (int axis = 0; axis < 3; ++axis) {
            first[axis] = static_cast<int>(random() % static_cast<unsigned>(small.shape[axis]));
            size[axis] = 1 + static_cast<int>(random() % static_cast<unsigned>(small.shape[axis] - first[axis]));
        }
        REQUIRE(wrong_in_box(array, first, size) == 0);
    }
}

TEST_CASE("a chunk is read once, and again after it was dropped", "[store]")
{
    const ArrayOnDisk disk(small);
    const ShardedArray array(small, {}, memory_limit);
    for (int repetition = 0; repetition < 3; ++repetition) {
        wrong_in_box(array, {7, 3, 3}, {2, 2, 2});
        REQUIRE(array.chunks_read() == 8);
    }
    const std::size_t chunk = place_count(small.chunk) * sizeof(float) + 4;
    REQUIRE(array.bytes_read() == 8 * chunk + 2 * 4 * 2 * 16 + 4); // and the index of a shard
    REQUIRE(array.memory() > 8 * chunk);
}

TEST_CASE("chunks that fit into the memory are kept", "[store]")
{
    const ShardedArrayLayout layout{temporary, {64, 64, 32}, {32, 32, 32}, {4, 4, 4}};
    const ArrayOnDisk disk(layout);
    const ShardedArray array(layout, {}, 256 * 4 * 4 * 4 * sizeof(float)); // the smallest limit
    constexpr int count = 235;                                             // of 244 that fit beside the indices
    for (int time = 0; time < 3; ++time)
        for (int i = 0; i < count; ++i) {
            const glm::ivec3 chunk(i % 16, i / 16 % 16, 0);
            REQUIRE(wrong_in_box(array, 4 * chunk, glm::ivec3(4)) == 0);
        }
    REQUIRE(array.chunks_read() == count);
}

TEST_CASE("many threads read a sharded array", "[store][threads]")
{
    const ArrayOnDisk disk(small);
    const ShardedArray array(small, {}, memory_limit);
    std::vector<std::size_t> wrong(8);
    std::vector<std::thread> threads;
    for (std::size_t thread = 0; thread < wrong.size(); ++thread)
        threads.emplace_back([&, thread] {
            std::mt19937 random(static_cast<unsigned>(thread));
            for (int trial = 0; trial < 300; ++trial) {
                const glm::ivec3 first(random() % 30, random() % 14, random() % 4);
                wrong[thread] += wrong_in_box(array, first, {7, 6, 5});
            }
        });
    for (std::thread& thread : threads)
        thread.join();
    REQUIRE(wrong == std::vector<std::size_t>(8, 0));
}

TEST_CASE("errors name the broken part of a shard", "[store]")
{
    const ArrayOnDisk disk(small);
    const std::filesystem::path shard = disk.path({1, 0, 0});
    const auto error = [&] {
        const ShardedArray array(small, {}, memory_limit);
        REQUIRE(wrong_in_box(array, {0, 0, 0}, {16, 16, 8}) == 0); // another shard
        return error_of_box(array, {16, 0, 0}, {8, 4, 4});
    };
    const auto contains = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    };
    REQUIRE(error().empty());
    flip(shard, 100, std::ios::beg);
    REQUIRE(contains(error(), "the checksum of chunk (0, 0, 2) is wrong"));
    REQUIRE(contains(error(), shard.string()));
    flip(shard, 100, std::ios::beg);
    REQUIRE(error().empty());
    flip(shard, -20, std::ios::end);
    REQUIRE(contains(error(), "the checksum of its index is wrong"));
    flip(shard, -20, std::ios::end);
    const auto size = std::filesystem::file_size(shard);
    std::filesystem::resize_file(shard, size - 1);
    REQUIRE(contains(error(), "index is wrong"));
    std::filesystem::resize_file(shard, 10);
    REQUIRE(contains(error(), "the file ends before its index"));
    std::filesystem::remove(shard);
    REQUIRE(contains(error(), "No such file"));
    std::filesystem::create_symlink(disk.path({0, 0, 0}), shard);
    REQUIRE(contains(error(), "cannot open a shard"));
    std::filesystem::remove(shard);
    std::filesystem::create_directory(shard);
    REQUIRE(contains(error(), "not a file"));
}

TEST_CASE("layouts that do not fit together are refused", "[store]")
{
    const ArrayOnDisk disk(small);
    const auto open = [](const ShardedArrayLayout& layout, std::size_t limit = memory_limit) {
        ShardedArray array(layout, {}, limit);
    };
    ShardedArrayLayout layout = small;
    layout.shard.y = 15;
    REQUIRE_THROWS_AS(open(layout), std::invalid_argument);
    layout = small;
    layout.shape.z = 0;
    REQUIRE_THROWS_AS(open(layout), std::invalid_argument);
    layout = small;
    layout.chunk.x = 0;
    REQUIRE_THROWS_AS(open(layout), std::invalid_argument);
    layout = small;
    layout.folder /= "missing";
    REQUIRE_THROWS_AS(open(layout), std::filesystem::filesystem_error);
    REQUIRE_THROWS_AS(open(small, 1000), std::invalid_argument);
    REQUIRE_NOTHROW(open(small));
}
