// The faces of a mesh near the cells of a brick.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/math/box.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/polygonize/mesh_part.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// A face that may be near a part of a cell, and the box, in lattice space, of all that it is near to.
struct NearFace {
    Box reach;
    std::uint32_t face;
};

/// The faces near the rows of cells of one brick after the other.
class NearFaces {
public:
    /// Faces are near to what their boxes meet, grown by `reach` in lattice space. The mesh and the octree of its faces
    /// must outlive it.
    NearFaces(const LabeledMesh& mesh, const FaceOctree& octree, const glm::dvec3& reach)
        : mesh_(mesh), octree_(octree), reach_(reach)
    {
    }

    /// Cells of this brick come next.
    void enter(const Brick& brick)
    {
        first_ = brick.first;
        for (std::vector<NearFace>& row : rows_)
            row.clear();
        const Box box = box_of(brick);
        octree_.visit({box.lower - reach_, box.upper + reach_}, [&](std::uint32_t face) {
            Box of_face = box_of(mesh_.vertices, mesh_.faces[face]);
            of_face.lower -= reach_;
            of_face.upper += reach_;
            if (!of_face.meets(box))
                return true;
            const glm::ivec3 most = brick.size - 1;
            const glm::ivec3 from(glm::clamp(glm::ceil(of_face.lower - box.lower) - 1.0, 0.0, double{brick_size}));
            const glm::ivec3 to = glm::min(glm::ivec3(glm::max(of_face.upper - box.lower, 0.0)), most);
            for (int z = from.z; z <= to.z; ++z)
                for (int y = from.y; y <= to.y; ++y)
                    rows_[place(y, z)].push_back({of_face, face});
            return true;
        });
    }

    /// Those near the row of a cell.
    const std::vector<NearFace>& of_row(const glm::ivec3& cell) const
    {
        return rows_[place(cell.y - first_.y, cell.z - first_.z)];
    }

private:
    static std::size_t place(int y, int z) { return static_cast<std::size_t>(y + brick_size * z); }

    const LabeledMesh& mesh_;
    const FaceOctree& octree_;
    glm::dvec3 reach_;
    glm::ivec3 first_{0}; ///< of the brick
    std::array<std::vector<NearFace>, std::size_t{brick_size} * brick_size> rows_;
};

} // namespace isospline
