#include "isospline/brick/side_grid.h"

#include "isospline/brick/brick.h"
#include "isospline/math/grid.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace isospline {

namespace {

constexpr int block_edge = 2;

/// The sides of cubes of one size: 1 or -1, 0 where f is on neither.
struct Level {
    glm::ivec3 shape;
    std::vector<std::int8_t> sides;
};

/// The common side of the eight cubes in each cube of twice the size. Those beyond the grid do not count.
Level coarser(const Level& fine)
{
    Level level{(fine.shape + 1) / 2, {}};
    level.sides.resize(place_count(level.shape));
    for (std::size_t i = 0; i < level.sides.size(); ++i) {
        const glm::ivec3 first = 2 * at_place(level.shape, i), last = glm::min(first + 1, fine.shape - 1);
        int least = 1, most = -1;
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x) {
                    const int side = fine.sides[place_in(fine.shape, {x, y, z})];
                    least = std::min(least, side);
                    most = std::max(most, side);
                }
        level.sides[i] = static_cast<std::int8_t>(least == most ? least : 0);
    }
    return level;
}

} // namespace

SideGrid::SideGrid(const BrickRanges& ranges, const glm::ivec3& cell_shape, double threshold)
    : edge_(ranges.has_blocks() ? block_edge : brick_size), shape_((cell_shape + edge_ - 1) / edge_)
{
    // Larger than the errors of points of rays, and than the rounding of the two bounds.
    margin_ = 0x1p-24 * (static_cast<double>(ranges.whole().upper) - static_cast<double>(ranges.whole().lower)) +
              0x1p-40 * std::abs(threshold);
    const double least = threshold - margin_, most = threshold + margin_;
    std::array<Level, 4> levels; // of 8, 16, 32 and 64 cells
    levels[0].shape = brick_shape(cell_shape);
    levels[0].sides.resize(place_count(levels[0].shape));
    for (std::size_t i = 0; i < levels[0].sides.size(); ++i) {
        const BrickRanges::Range range = ranges.brick(at_place(levels[0].shape, i));
        levels[0].sides[i] = static_cast<std::int8_t>(static_cast<int>(static_cast<double>(range.lower) > most) -
                                                      static_cast<int>(static_cast<double>(range.upper) < least));
    }
    for (std::size_t i = 1; i < levels.size(); ++i)
        levels[i] = coarser(levels[i - 1]);

    numbers_.resize(place_count(shape_));
    const auto fill = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const glm::ivec3 brick = at_place(levels[0].shape, i);
            int number = 0;
            for (std::size_t k = 0; k < levels.size(); ++k)
                if (const int side = levels[k].sides[place_in(levels[k].shape, brick >> static_cast<int>(k))];
                    side != 0)
                    number = side * (brick_size << k);
            if (number == 0 && ranges.has_blocks()) {
                set_blocks(ranges, brick, least, most);
                continue;
            }
            const int in_brick = brick_size / edge_;
            const glm::ivec3 first = in_brick * brick, last = glm::min(first + in_brick, shape_);
            for (int z = first.z; z < last.z; ++z)
                for (int y = first.y; y < last.y; ++y)
                    std::fill_n(&numbers_[place_in(shape_, {first.x, y, z})], last.x - first.x,
                                static_cast<std::int8_t>(number));
        }
    };
    parallel_for(levels[0].sides.size(), 64, fill);
}

void SideGrid::set_blocks(const BrickRanges& ranges, const glm::ivec3& brick, double least, double most)
{
    constexpr int in_brick = brick_size / block_edge;
    const glm::ivec3 octet = brick >> 1, child = brick & 1;
    const BrickRanges::BlockSides sides =
        ranges.block_sides(place_in(ranges.shape(), octet), child.x + 2 * child.y + 4 * child.z, least, most);
    const auto side_at = [&](const glm::ivec3& block) {
        return sides[static_cast<std::size_t>(block.x + in_brick * (block.y + in_brick * block.z))];
    };
    const glm::ivec3 first = in_brick * brick, last = glm::min(glm::ivec3(in_brick), shape_ - first) - 1;
    for (int i = 0; i < 8; ++i) { // cubes of 2 x 2 x 2 blocks
        const glm::ivec3 begin = 2 * child_position(i), end = glm::min(begin + 1, last);
        if (end.x < begin.x || end.y < begin.y || end.z < begin.z)
            continue;
        int sum = 0, count = 0;
        for (int z = begin.z; z <= end.z; ++z)
            for (int y = begin.y; y <= end.y; ++y)
                for (int x = begin.x; x <= end.x; ++x, ++count)
                    sum += side_at({x, y, z});
        const int edge = std::abs(sum) == count ? 2 * block_edge : block_edge;
        for (int z = begin.z; z <= end.z; ++z)
            for (int y = begin.y; y <= end.y; ++y)
                for (int x = begin.x; x <= end.x; ++x)
                    numbers_[place_in(shape_, first + glm::ivec3(x, y, z))] =
                        static_cast<std::int8_t>(edge * side_at({x, y, z}));
    }
}

} // namespace isospline
