// The parts of cells that are near to a mesh.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/cell_parts.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/util/progress.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// The blocks of 2 x 2 x 2 cells of a grid that some boxes meet.
class MetBlocks {
public:
    explicit MetBlocks(const glm::ivec3& cell_shape)
        : shape_(brick_shape(cell_shape)), blocks_(place(shape_ - 1) + 1, 0)
    {
    }

    void add(const Box& box)
    {
        visit(box, [this](std::size_t brick, std::uint64_t blocks) {
            blocks_[brick] |= blocks;
            return true;
        });
    }
    /// Whether another box meets one of them, too.
    bool are_met_by(const Box& box) const
    {
        return !visit(box, [this](std::size_t brick, std::uint64_t blocks) { return (blocks_[brick] & blocks) == 0; });
    }

private:
    static constexpr int along_brick = brick_size / 2;

    std::size_t place(const glm::ivec3& brick) const
    {
        const glm::vec<3, std::size_t> at(brick), shape(shape_);
        return at.x + shape.x * (at.y + shape.y * at.z);
    }
    /// Calls `visit(brick, blocks)` for the bricks that a box meets, until it returns false. Returns whether it never
    /// did.
    template <typename Visit>
    bool visit(const Box& box, const Visit& visit) const
    {
        const auto block_with = [this](const glm::dvec3& at) {
            return glm::clamp(glm::ivec3(glm::floor(0.5 * at)), glm::ivec3(0), along_brick * shape_ - 1);
        };
        const glm::ivec3 first = block_with(box.lower), last = block_with(box.upper);
        const glm::ivec3 first_brick = first / along_brick, last_brick = last / along_brick;
        glm::ivec3 brick;
        for (brick.z = first_brick.z; brick.z <= last_brick.z; ++brick.z)
            for (brick.y = first_brick.y; brick.y <= last_brick.y; ++brick.y)
                for (brick.x = first_brick.x; brick.x <= last_brick.x; ++brick.x) {
                    const glm::ivec3 from = glm::max(first - along_brick * brick, 0),
                                     to = glm::min(last - along_brick * brick, along_brick - 1);
                    std::uint64_t blocks = 0;
                    const std::uint64_t row = (std::uint64_t{2} << to.x) - (std::uint64_t{1} << from.x);
                    for (int z = from.z; z <= to.z; ++z)
                        for (int y = from.y; y <= to.y; ++y)
                            blocks |= row << along_brick * (y + along_brick * z);
                    if (!visit(place(brick), blocks))
                        return false;
                }
        return true;
    }

    glm::ivec3 shape_;                  ///< bricks along x, y, z
    std::vector<std::uint64_t> blocks_; ///< of each brick
};

/// The parts that are near to those with a point of a mesh, of the faces that meet some blocks.
CellParts parts_near_mesh(const LabeledMesh& mesh, const MetBlocks& blocks, const PartReach& reach,
                          const glm::ivec3& cell_shape, const Progress& progress);

} // namespace isospline
