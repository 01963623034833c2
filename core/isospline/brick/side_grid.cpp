#include "isospline/brick/side_grid.h"

#include "isospline/brick/brick.h"
#include "isospline/math/grid.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace isospline {

namespace {

int edge_of(const BrickRanges& ranges)
{
    constexpr int block_edge = 2;
    return ranges.has_blocks() ? block_edge : brick_size;
}

/// Distances in a row of blocks, with room for blocks beyond its ends, which do not count.
class Row {
public:
    explicit Row(int size)
        : size_(size), numbers_(static_cast<std::size_t>(size + 2 * SideGrid::farthest), cap), next_(numbers_)
    {
    }

    /// Takes the smallest of each number and the three around it in a neighbouring row, plus 1.
    void meet(const Row& neighbour)
    {
        // Local copies, as bytes that are written may be anything to the compiler.
        const std::uint8_t* const other = neighbour.numbers_.data() + first;
        std::uint8_t* const own = numbers_.data() + first;
        const int size = size_;
        for (int x = 0; x < size; ++x) {
            const std::uint8_t nearest = std::min(std::min(other[x - 1], other[x]), other[x + 1]);
            own[x] = std::min(own[x], static_cast<std::uint8_t>(nearest + 1));
        }
    }

    /// Takes the smallest of each number and those before it, or behind it, plus their distances.
    void spread(bool forward)
    {
        const int size = size_;
        for (int step = 1; step < SideGrid::farthest; step *= 2) {
            const std::uint8_t* const own = numbers_.data() + first;
            const std::uint8_t* const other = forward ? own - step : own + step;
            std::uint8_t* const to = next_.data() + first;
            for (int x = 0; x < size; ++x)
                to[x] = std::min(own[x], static_cast<std::uint8_t>(other[x] + step));
            std::swap(numbers_, next_);
        }
    }

    void load(const std::int8_t* from)
    {
        std::uint8_t* const own = numbers_.data() + first;
        for (int x = 0, size = size_; x < size; ++x)
            own[x] = static_cast<std::uint8_t>(std::abs(from[x]));
    }
    void store(std::int8_t* to) const
    {
        const std::uint8_t* const own = numbers_.data() + first;
        for (int x = 0, size = size_; x < size; ++x) {
            const auto distance = static_cast<std::int8_t>(own[x]);
            to[x] = static_cast<std::int8_t>(to[x] < 0 ? -distance : distance);
        }
    }

private:
    static constexpr std::uint8_t cap = SideGrid::farthest;
    static constexpr int first = SideGrid::farthest;

    int size_;
    std::vector<std::uint8_t> numbers_, next_; ///< the room of both is never changed
};

} // namespace

glm::ivec3 SideGrid::shape_of(const BrickRanges& ranges, const glm::ivec3& cell_shape)
{
    const int edge = edge_of(ranges);
    return (cell_shape + edge - 1) / edge;
}

SideGrid::SideGrid(const BrickRanges& ranges, const glm::ivec3& cell_shape, double threshold, const Progress& progress)
    : edge_(edge_of(ranges)), shape_(shape_of(ranges, cell_shape)), numbers_(place_count(shape_))
{
    // Larger than the errors of points of rays, and than the rounding of the two bounds.
    margin_ = 0x1p-24 * (static_cast<double>(ranges.whole().upper) - static_cast<double>(ranges.whole().lower)) +
              0x1p-40 * std::abs(threshold);
    find_sides(ranges, cell_shape, threshold, progress);
    find_distances();
}

/// Sets `farthest`, negative where f is below, or 0.
void SideGrid::find_sides(const BrickRanges& ranges, const glm::ivec3& cell_shape, double threshold,
                          const Progress& progress)
{
    const double least = threshold - margin_, most = threshold + margin_;
    const glm::ivec3 bricks = brick_shape(cell_shape);
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const glm::ivec3 brick = at_place(bricks, i);
            const BrickRanges::Range range = ranges.brick(brick);
            const int side = static_cast<int>(static_cast<double>(range.lower) > most) -
                             static_cast<int>(static_cast<double>(range.upper) < least);
            const int in_brick = brick_size / edge_;
            const glm::ivec3 first = in_brick * brick, last = glm::min(first + in_brick, shape_);
            if (side != 0 || !ranges.has_blocks()) {
                for (int z = first.z; z < last.z; ++z)
                    for (int y = first.y; y < last.y; ++y)
                        std::fill_n(&numbers_[place_in(shape_, {first.x, y, z})], last.x - first.x,
                                    static_cast<std::int8_t>(farthest * side));
                continue;
            }
            const BrickRanges::BlockSides sides = ranges.block_sides(brick, least, most);
            for (int z = first.z; z < last.z; ++z)
                for (int y = first.y; y < last.y; ++y)
                    for (int x = first.x; x < last.x; ++x) {
                        const int block = (x & 3) + 4 * ((y & 3) + 4 * (z & 3));
                        numbers_[place_in(shape_, {x, y, z})] =
                            static_cast<std::int8_t>(farthest * sides[static_cast<std::size_t>(block)]);
                    }
        }
    };
    parallel_for(place_count(bricks), 64, find, progress);
}

/// Two passes over all rows, forward and backward (A. Rosenfeld and J. Pfaltz, 1968). Blocks on different sides are
/// never next to each other, because f is continuous.
void SideGrid::find_distances()
{
    // The rows of the slice that was passed, and of this one.
    std::vector<Row> passed(static_cast<std::size_t>(shape_.y), Row(shape_.x)), rows = passed;
    for (const bool forward : {true, false}) {
        for (int i = 0; i < shape_.z; ++i) {
            const int z = forward ? i : shape_.z - 1 - i;
            for (int j = 0; j < shape_.y; ++j) {
                const int y = forward ? j : shape_.y - 1 - j, before = forward ? y - 1 : y + 1;
                Row& row = rows[static_cast<std::size_t>(y)];
                std::int8_t* const numbers = &numbers_[place_in(shape_, {0, y, z})];
                row.load(numbers);
                if (j > 0)
                    row.meet(rows[static_cast<std::size_t>(before)]);
                for (int beside = std::max(y - 1, 0); i > 0 && beside <= std::min(y + 1, shape_.y - 1); ++beside)
                    row.meet(passed[static_cast<std::size_t>(beside)]);
                row.spread(forward);
                row.store(numbers);
            }
            std::swap(passed, rows);
        }
    }
}

} // namespace isospline
