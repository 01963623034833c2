// Proof, by the parity of crossings, that a mesh is near to all points of a convex set.
#pragma once

#include "isospline/polygonize/mesh_part.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

/// Proves that a mesh is within a distance t of all points of a convex set, however many of its faces that takes.
///
/// With a unit vector n, look at the segments from p - t n to p + t n for the points p of the set. If one of them
/// crosses the mesh an odd number of times, and no face meets the set moved by t n or by -t n, nor a border of the mesh
/// what is between, all of them cross it: the number of crossings modulo 2 does not change while p moves (V. Guillemin,
/// A. Pollack, "Differential topology", 1974, section 2.4).
class ParityProof {
public:
    /// `world` has the vertices of the mesh in the world. Both must outlive it.
    ParityProof(const LabeledMesh& mesh, const std::vector<glm::dvec3>& world);

    /// What a thread uses again and again.
    struct Workspace {
        struct Crossed {
            Corners corners; ///< in the frame of the segments
            glm::uvec3 face;
        };
        std::vector<glm::dvec3> points;
        std::vector<Crossed> crossed;
    };

    /// A distance of at most `most` from the mesh within which all points of the convex hull of `points` are proven to
    /// be, with segments along `normal`. Faces of the mesh that are not given have to be farther than `most` from it.
    std::optional<double> distance(const std::vector<glm::dvec3>& points, const glm::dvec3& normal,
                                   const std::vector<std::uint32_t>& faces, double most, Workspace& workspace) const;

private:
    const LabeledMesh& mesh_;
    const std::vector<glm::dvec3>& world_;
    std::vector<std::uint8_t> is_at_border_; ///< for each vertex
};

} // namespace isospline
