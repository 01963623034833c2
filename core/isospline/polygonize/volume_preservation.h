// Vertices on both sides of the surface, so that a mesh encloses as much as the surface.
#pragma once

#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace isospline {

/// Moves the vertices of a simplified mesh off the surface, so that the volume that it encloses is kept (a goal of
/// P. Lindstrom, G. Turk, "Fast and memory efficient polygonal simplification", IEEE Visualization 1998).
///
/// With all vertices on the surface, the mesh of a convex solid is in it, and too small. The volume between a face and
/// the surface is measured. Each corner of the face then has to add a third of it, and is moved along the normal of the
/// faces around it. A second step does the same with the moved mesh. A vertex depends only on the faces near it.
template <int Degree>
class VolumePreservation {
public:
    /// Vertices do not move towards surface that is farther than `reach` from a face, in world units. The field must
    /// outlive it.
    VolumePreservation(const LatticeField<Degree>& field, double reach);

    /// Moves the vertices of a mesh. Those with a flag in `stays`, at borders and on caps do not move. It is faster if
    /// the mesh has many faces of the mesh before, with the same numbers of vertices.
    void move(LabeledMesh& mesh, const std::vector<std::uint8_t>& stays, const Progress& progress);
    /// The volume that the surface encloses and the mesh does not, less that which the mesh alone encloses, in world
    /// units cubed, as measured at points of the faces. At the border of the volume, of the mask and of the clip, open
    /// ends count as closed by flat lids.
    double missing_volume(const LabeledMesh& mesh, const Progress& progress) const;

private:
    /// The volume between a face and the surface, and the face's area as a vector to the outside.
    struct Between {
        double volume;
        glm::dvec3 area;
    };
    /// That of a face which was measured.
    struct Measured {
        glm::uvec3 face; ///< by the numbers of its corners
        Corners corners;
        Between between;
    };
    static constexpr int step_count = 2;

    std::vector<Between> measure(const LabeledMesh& mesh, const std::vector<std::uint32_t>& numbers,
                                 std::vector<Measured>& before, const Progress& progress) const;
    /// How closely the volume at a face is measured: at points in its parts. These are halved until the volume changes
    /// little.
    struct Care {
        double part_edge;    ///< of parts that are not halved, in cells
        double small_change; ///< of the mean height, after which parts are not halved; as a part of the reach
        double reach;        ///< the largest height, as a multiple of that of the object
    };
    static constexpr Care care_of_moves{2.0, 1e-3, 1.0};
    /// Surfaces of degree 1 have creases where cells meet.
    static constexpr Care care_of_report = Degree == 1 ? Care{0.25, 2.5e-4, 3.0} : Care{0.5, 4e-3, 3.0};

    double height(const glm::dvec3& at, const glm::dvec3& outward, double reach) const;
    glm::dvec3 area_of(const Corners& corners) const;
    double volume_along(const Corners& corners, const Corners& directions, const Care& care) const;
    Between between(const Corners& corners) const;
    std::vector<glm::dvec3> directions(const LabeledMesh& mesh) const;

    const LatticeField<Degree>& field_;
    LatticeMetric metric_;
    double reach_, orientation_; ///< -1 if the lattice is mirrored in the world, else 1
    glm::dvec3 shape_;
    std::array<std::vector<Measured>, step_count> before_; ///< the faces of the mesh before, sorted, at each step
};

} // namespace isospline
