// Proven bounds on the distance of faces from a surface and its caps.
#pragma once

#include "isospline/polygonize/lattice_field.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/polygonize/nearness.h"
#include "isospline/polygonize/surface_parts.h"
#include "isospline/query/closest_point.h"
#include "isospline/query/surface_box.h"

#include <glm/vec3.hpp>

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace isospline {

/// Bounds on the distance of each point of a face from the surface or a cap. The face is cut into pieces until one of
/// these proofs succeeds for each.
///
/// 0. All parts of cells that the piece meets are near to the surface (SurfaceParts).
/// 1. The corners of the piece are moved by a distance s along their gradients, and by s in the opposite direction. If
///    Bernstein coefficients prove that f - level is positive on all of the one copy and negative on the other, there
///    is a root within s of each point of the piece. On a cap, the piece itself, or its copy at a distance s along the
///    plane, has to be in the solid.
/// 2. A point of the surface is within s of the corners of the piece; then it is within s of all of it.
template <int Degree>
class FaceDistance {
public:
    /// `with_excess`: bounds larger than what is enough are found as well, and are closer; without, they are infinite,
    /// and cost less.
    FaceDistance(const LatticeField<Degree>& field, const SurfaceParts& parts, const LatticeMetric& metric,
                 bool with_excess)
        : field_(field), parts_(parts), metric_(metric), with_excess_(with_excess), rows_(parts.near().shape())
    {
    }

    /// A bound for a face with corners in lattice space, in world units. Pieces are not cut further if theirs is at
    /// most `enough`.
    double bound(const Corners& corners, FaceLabel label, double enough);

private:
    /// The Bernstein coefficients of a cell that was looked at lately.
    struct RecentCell {
        glm::ivec3 index{-1};
        SurfaceBox<Degree> box;
    };
    static constexpr std::size_t recent_count = 128;

    const SurfaceBox<Degree>& cell_box(const glm::ivec3& cell);
    /// The half-space of a cap, or null for a face on the isosurface.
    const HalfSpace* plane_of(FaceLabel label) const
    {
        return label == on_isosurface ? nullptr : &field_.surface().planes().all()[label - 1];
    }
    bool is_in_planes(const Corners& corners, FaceLabel except) const;
    /// The cells that a box meets, those on the inner side of a plane if one is given: the first and the last. Nothing
    /// if the box reaches out of the domain.
    std::optional<std::array<glm::ivec3, 2>> cells_of(const Box& box, const HalfSpace* plane) const;
    bool corners_have_sign(const Corners& triangle, double sign) const;
    /// Whether sign * (f - level) is proven to be positive on all of a triangle, which is in kept cells. Parts of the
    /// triangle for which the proof fails are halved up to `halvings` times.
    bool has_sign(const Corners& triangle, double sign, const HalfSpace* plane, int halvings);
    /// Whether all cells around a triangle and its two copies are kept.
    bool is_kept_around(const Corners& piece, const Corners& above, const Corners& below) const;
    glm::dvec3 moved_in_domain(const glm::dvec3& from, glm::dvec3 step) const;
    double bound_by_signs(const Corners& piece, double reach);
    double bound_by_solid(const Corners& piece, FaceLabel label, double reach);
    /// A point of the surface or of a cap near a point, if one is found easily.
    std::optional<glm::dvec3> foot(const glm::dvec3& at, FaceLabel label) const;
    bool is_in_near_parts(const Corners& piece);
    double piece_bound(const Corners& piece, FaceLabel label, double reach);

    const LatticeField<Degree>& field_;
    const SurfaceParts& parts_;
    const LatticeMetric& metric_;
    bool with_excess_;
    RowsOfTriangle rows_;
    std::unique_ptr<ClosestPointFinder> finder_;
    std::vector<RecentCell> recent_;
};

/// Bounds for the distances of the faces of a mesh from the surface and its caps, in world units.
template <int Degree>
std::vector<double> distances_from_surface(const LatticeField<Degree>& field, const SurfaceParts& parts,
                                           const LabeledMesh& mesh, double enough, bool with_excess,
                                           const Progress& progress);

} // namespace isospline
