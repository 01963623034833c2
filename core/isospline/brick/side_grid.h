// The side of the level on which f is in cubes of cells, for walks along lines.
#pragma once

#include "isospline/brick/ranges.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// One number for each block, or for each brick if the ranges of blocks are not known. It is 0 if f may be the
/// threshold there; otherwise the edge, in cells, of the largest aligned cube around it that is proven to be on one
/// side: a power of two up to `largest_edge`, negative if f is below.
class SideGrid {
public:
    static constexpr int largest_edge = 64;

    SideGrid(const BrickRanges& ranges, const glm::ivec3& cell_shape, double threshold);

    /// The edge of a block or a brick.
    int edge() const { return edge_; }
    /// Numbers along x, y, z: number (x, y, z) is at index x + shape.x * (y + shape.y * z).
    const glm::ivec3& shape() const { return shape_; }
    const std::int8_t* numbers() const { return numbers_.data(); }
    /// f is farther from the threshold than this where it is on one side.
    double margin() const { return margin_; }
    std::size_t memory() const { return numbers_.capacity(); }

private:
    void set_blocks(const BrickRanges& ranges, const glm::ivec3& brick, double least, double most);

    int edge_;
    glm::ivec3 shape_;
    double margin_;
    std::vector<std::int8_t> numbers_;
};

} // namespace isospline
