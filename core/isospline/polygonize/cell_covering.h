// Proof that faces are near to the surface and the caps in a cell.
#pragma once

#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/near_faces.h"
#include "isospline/polygonize/parity_proof.h"
#include "isospline/query/surface_box.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace isospline {

/// Points this close to a plane of the clip count as on it, in lattice units.
inline constexpr double on_plane_margin = 1e-9;

/// A cell, and what of it is to be covered.
struct CellToCover {
    glm::ivec3 index;
    bool with_surface, with_caps;
};

/// Covers one cell after the other, with faces.
template <int Degree>
class CellCovering {
public:
    CellCovering(const LatticeField<Degree>& field, const LabeledMesh& mesh, const std::vector<glm::dvec3>& world,
                 const FaceOctree& octree, const ParityProof& parity, double tolerance, const CoveringEdges& edges)
        : field_(field), metric_(field.surface().volume().lattice_to_world()), mesh_(mesh), world_(world),
          parity_(parity), tolerance_(tolerance), edges_(edges),
          reach_(box_of_ball(metric_, tolerance) + on_plane_margin), faces_near_(mesh, octree, reach_), levels_(1)
    {
    }

    /// Cells of this brick come next.
    void enter(const Brick& brick)
    {
        faces_near_.enter(brick);
        recent_.clear();
    }

    /// Examines the surface in a cell, and the caps. Returns whether they are covered.
    bool operator()(const CellToCover& cell)
    {
        const VolumeCell coefficients(field_.surface().volume(), field_.surface().threshold(), cell.index);
        lower_ = coefficients.lower;
        const SurfaceBox<Degree> box = surface_box<Degree>(coefficients, 0);
        const bool with_surface = cell.with_surface && box.has_surface();
        if (!cell.with_caps && !with_surface)
            return true;
        const Box inner{lower_, lower_ + 1.0};
        std::vector<NearFace>& near = levels_[0];
        near.clear();
        for (const NearFace& face : faces_near_.of_row(cell.index))
            if (face.reach.meets(inner))
                near.push_back(face);
        cut_ = nullptr;
        bool is_covered = !with_surface || examine(box, 0, false);
        if (!cell.with_caps)
            return is_covered;
        const SolidPlanes& planes = field_.surface().planes();
        for (std::size_t i = 0; i < planes.all().size(); ++i) {
            cut_ = &planes.all()[i];
            const DistanceRange range({lower_, lower_ + 1.0}, *cut_);
            // On a face between two cells, the cap is in the cell on the inner side.
            if (planes.has_caps(i) && range.least <= plane_margin && range.most > plane_margin)
                is_covered &= examine(box, 0, false);
        }
        return is_covered;
    }

    Covering take() { return std::move(covering_); }

private:
    bool may_contain(const SurfaceBox<Degree>& box) const
    {
        if (cut_ == nullptr)
            return box.has_surface();
        const bool above = field_.surface().options().inside == Inside::above;
        return std::any_of(box.b.begin(), box.b.end(), [&](double b) { return (b >= 0.0) == above; });
    }

    /// Points, in world space, around all of the surface or the cap in a box.
    void find_points(const SurfaceBox<Degree>& box, const UnitSlab& slab)
    {
        normal_ = (cut_ == nullptr ? slab.normal / box.size : cut_->normal) * metric_.to_lattice;
        if (cut_ == nullptr) {
            points_of_slab(slab, points_);
        } else {
            // The plane, widened by the margin, and the side of the slab on which the solid is.
            const double at_lower = glm::dot(cut_->normal, lower_ + box.lower) - cut_->offset;
            points_of_slab({cut_->normal * box.size, -at_lower - on_plane_margin, -at_lower + on_plane_margin},
                           points_);
            if (field_.surface().options().inside == Inside::above)
                clip_hull(points_, slab.normal, slab.lower);
            else
                clip_hull(points_, -slab.normal, -slab.upper);
        }
        for (glm::dvec3& point : points_)
            point = lower_ + box.lower + point * box.size;
        for (const HalfSpace& half_space : field_.surface().planes().all())
            if (&half_space != cut_)
                clip_hull(points_, half_space.normal, half_space.offset - on_plane_margin);
        around_ = {};
        for (glm::dvec3& point : points_) {
            around_.extend(point);
            point = metric_.to_world * point;
        }
    }

    double distance(const glm::dvec3& point, std::uint32_t index) const
    {
        const glm::uvec3& face = mesh_.faces[index];
        return glm::distance(point, closest_point_of_triangle(point, world_[face.x], world_[face.y], world_[face.z]));
    }

    /// The largest distance of the points from a face, or of those before one that is beyond the tolerance.
    double farthest_point(std::uint32_t face) const
    {
        double farthest = 0.0;
        for (std::size_t i = 0; i < points_.size() && farthest <= tolerance_; ++i)
            farthest = std::max(farthest, distance(points_[i], face));
        return farthest;
    }

    /// Drops faces farther than the tolerance from all points, if there are only a few faces.
    void drop_far_faces(std::vector<NearFace>& near) const
    {
        constexpr std::size_t few = 16;
        if (near.size() > few)
            return;
        const glm::dvec3 middle = points_.front();
        double radius = 0.0;
        for (const glm::dvec3& point : points_)
            radius = std::max(radius, glm::distance(point, middle));
        std::erase_if(near, [&](const NearFace& face) { return distance(middle, face.face) > tolerance_ + radius; });
    }

    /// Whether all points may be within the tolerance of a face.
    bool may_cover(const NearFace& face) const { return face.reach.contains(around_); }

    /// Whether a face that covered a box lately covers all points.
    bool is_covered_by_recent()
    {
        for (std::size_t i = recent_.size(); i-- > 0;)
            if (may_cover(recent_[i]))
                if (const double farthest = farthest_point(recent_[i].face); farthest <= tolerance_) {
                    covered_by(NearFace(recent_[i]), farthest);
                    return true;
                }
        return false;
    }

    void covered_by(const NearFace& face, double farthest)
    {
        covering_.distance = std::max(covering_.distance, farthest);
        constexpr std::size_t most_recent = 4;
        const auto known = std::find_if(recent_.begin(), recent_.end(),
                                        [&](const NearFace& recent) { return recent.face == face.face; });
        if (known != recent_.end())
            recent_.erase(known);
        else if (recent_.size() == most_recent)
            recent_.erase(recent_.begin());
        recent_.push_back(face);
    }

    /// Whether these faces together are near to all points.
    bool is_covered_by(const std::vector<NearFace>& near)
    {
        const glm::dvec3 along = glm::abs(metric_.to_lattice * normal_) * (tolerance_ / glm::length(normal_)) - reach_;
        const Box window{around_.lower - along, around_.upper + along};
        faces_.clear();
        for (const NearFace& face : near)
            if (face.reach.meets(window))
                faces_.push_back(face.face);
        const auto distance = parity_.distance(points_, normal_, faces_, tolerance_, workspace_);
        covering_.distance = std::max(covering_.distance, distance.value_or(0.0));
        return distance.has_value();
    }

    /// Whether one of these faces covers all points.
    bool is_covered_by_one_of(const std::vector<NearFace>& near)
    {
        candidates_.clear();
        for (const NearFace& face : near)
            if (may_cover(face))
                candidates_.push_back({&face, 0.0});
        if (candidates_.empty())
            return false;
        glm::dvec3 middle(0.0);
        for (const glm::dvec3& point : points_)
            middle += point / static_cast<double>(points_.size());
        double radius = 0.0;
        for (const glm::dvec3& point : points_)
            radius = std::max(radius, glm::distance(point, middle));
        for (Candidate& candidate : candidates_) {
            candidate.distance = distance(middle, candidate.face->face);
            if (candidate.distance + radius <= tolerance_) {
                covered_by(*candidate.face, candidate.distance + radius);
                return true;
            }
        }
        constexpr std::size_t most_tries = 4;
        const auto tries = candidates_.begin() + static_cast<std::ptrdiff_t>(std::min(candidates_.size(), most_tries));
        std::partial_sort(candidates_.begin(), tries, candidates_.end(), [](const Candidate& a, const Candidate& b) {
            return a.distance != b.distance ? a.distance < b.distance : a.face->face < b.face->face;
        });
        for (auto candidate = candidates_.begin(); candidate != tries && candidate->distance <= tolerance_; ++candidate)
            if (const double farthest = farthest_point(candidate->face->face); farthest <= tolerance_) {
                covered_by(*candidate->face, farthest);
                return true;
            }
        return false;
    }

    /// Returns whether a box is covered. `is_part` tells that a box around it stands for it.
    bool examine(const SurfaceBox<Degree>& box, std::size_t level, bool is_part)
    {
        if (!may_contain(box))
            return true;
        const double edge = std::max({box.size.x, box.size.y, box.size.z});
        const bool is_whole = edge <= edges_.reported;
        const UnitSlab slab = slab_of<Degree>(box);
        if (!is_whole && edge > edges_.least && is_too_thick(box, slab)) {
            const bool is_lower_covered = examine_half(box, false, level, is_part);
            return examine_half(box, true, level, is_part) && is_lower_covered;
        }
        find_points(box, slab);
        if (points_.empty() || is_covered_by_recent())
            return true;
        // Faces that may cover a part of the box.
        levels_.resize(std::max(levels_.size(), level + 2));
        std::vector<NearFace>& near = levels_[level + 1];
        near.clear();
        for (const NearFace& face : levels_[level])
            if (face.reach.meets(around_))
                near.push_back(face);
        if (is_covered_by(near) || is_covered_by_one_of(near))
            return true;
        drop_far_faces(near);
        const auto leave = [&] {
            if (!is_part)
                covering_.uncovered.push_back({lower_ + box.lower, lower_ + box.lower + box.size});
            return false;
        };
        if ((is_crossed(box) && (near.empty() || edge <= edges_.least)) || edge <= part_if_unsure * edges_.least)
            return leave();
        bool is_covered = true;
        for (const bool upper : {false, true}) {
            is_covered &= examine_half(box, upper, level + 1, is_part || is_whole);
            if (!is_covered && is_whole)
                return leave();
        }
        return is_covered;
    }

    bool examine_half(const SurfaceBox<Degree>& box, bool upper, std::size_t level, bool is_part)
    {
        int longest = 0;
        for (int axis = 1; axis < 3; ++axis)
            if (box.size[axis] > box.size[longest])
                longest = axis;
        return examine(half_of<Degree>(box, longest, upper), level, is_part);
    }

    /// Whether the slab around the surface in a box, and the box across the slab, are so thick that a proof is
    /// hopeless.
    bool is_too_thick(const SurfaceBox<Degree>& box, const UnitSlab& slab) const
    {
        if (cut_ != nullptr)
            return false;
        const double of_box = glm::abs(slab.normal.x) + glm::abs(slab.normal.y) + glm::abs(slab.normal.z);
        const double slope = glm::length((slab.normal / box.size) * metric_.to_lattice);
        return std::min(slab.upper - slab.lower, of_box) > 2.0 * tolerance_ * slope;
    }

    /// Whether a box certainly has a part of the surface or the cap.
    bool is_crossed(const SurfaceBox<Degree>& part) const
    {
        const Box box{lower_ + part.lower, lower_ + part.lower + part.size};
        for (const HalfSpace& half_space : field_.surface().planes().all())
            if (&half_space != cut_ && !is_inside(box, half_space))
                return false;
        if (cut_ == nullptr)
            return changes_sign(part);
        const DistanceRange range(box, *cut_);
        const bool above = field_.surface().options().inside == Inside::above;
        return range.least < -on_plane_margin && range.most > on_plane_margin &&
               std::all_of(part.b.begin(), part.b.end(), [&](double b) { return (b >= 0.0) == above; });
    }

    /// Whether f - level has both signs at the corners of a box.
    static bool changes_sign(const SurfaceBox<Degree>& box)
    {
        int below = 0;
        for (int corner = 0; corner < 8; ++corner)
            below += box.b[bernstein_item<Degree>(Degree * (corner & 1), Degree * (corner >> 1 & 1),
                                                  Degree * (corner >> 2))] < 0.0;
        return below != 0 && below != 8;
    }

    /// A face that may cover a box, and its distance from the box's middle.
    struct Candidate {
        const NearFace* face;
        double distance;
    };
    /// Boxes in which f may have no sign change are halved further, until their edges are this part of the least edge.
    static constexpr double part_if_unsure = 0.25;

    const LatticeField<Degree>& field_;
    const LatticeMetric metric_;
    const LabeledMesh& mesh_;
    const std::vector<glm::dvec3>& world_;
    const ParityProof& parity_;
    double tolerance_;
    CoveringEdges edges_;
    glm::dvec3 reach_; ///< half of the size of the box of a ball with the tolerance as radius, in lattice space
    NearFaces faces_near_;
    glm::dvec3 lower_{0.0};          ///< of the cell
    std::vector<NearFace> recent_;   ///< faces that covered boxes lately, the last one at the end
    const HalfSpace* cut_ = nullptr; ///< of the cap that is examined, or null for the surface
    std::vector<std::vector<NearFace>> levels_;
    std::vector<Candidate> candidates_;
    std::vector<glm::dvec3> points_; ///< in world space
    glm::dvec3 normal_{0.0};         ///< of the surface or the cap there
    std::vector<std::uint32_t> faces_;
    ParityProof::Workspace workspace_;
    Box around_; ///< the box around them in lattice space
    Covering covering_;
};

} // namespace isospline
