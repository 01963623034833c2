// The side of the level on which f is around each block, for walks along lines.
#pragma once

#include "isospline/brick/ranges.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// One number for each block, or for each brick if the ranges of blocks are not known. It is 0 if f may be the
/// threshold there. Otherwise it is the distance to the nearest such block: the largest of the distances along the
/// axes, in blocks, up to `farthest`; negative if f is below. f is on the same side in all blocks that are nearer.
class SideGrid {
public:
    static constexpr int farthest = 16;

    SideGrid(const BrickRanges& ranges, const glm::ivec3& cell_shape, double threshold, const Progress& progress = {});

    /// Its shape, which is known before.
    static glm::ivec3 shape_of(const BrickRanges& ranges, const glm::ivec3& cell_shape);
    /// The edge of a block or a brick, in cells.
    int edge() const { return edge_; }
    /// Blocks along x, y, z: number (x, y, z) is at index x + shape.x * (y + shape.y * z).
    const glm::ivec3& shape() const { return shape_; }
    const std::int8_t* numbers() const { return numbers_.data(); }
    /// f is farther from the threshold than this where it is on one side.
    double margin() const { return margin_; }
    std::size_t memory() const { return numbers_.capacity(); }

private:
    void find_sides(const BrickRanges& ranges, const glm::ivec3& cell_shape, double threshold,
                    const Progress& progress);
    void find_distances();

    int edge_;
    glm::ivec3 shape_;
    double margin_;
    std::vector<std::int8_t> numbers_;
};

} // namespace isospline
