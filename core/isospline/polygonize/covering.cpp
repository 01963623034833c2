#include "isospline/polygonize/covering.h"

#include "isospline/math/affine.h"
#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/face_octree.h"
#include "isospline/query/surface_box.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace isospline {

namespace {

/// Boxes in which f may have no sign change are halved further, until their edges are this part of the least edge.
constexpr double part_if_unsure = 0.25;
/// Points this close to a plane of the clip count as on it, in lattice units.
constexpr double margin = 1e-9;

/// A candidate for the face that covers a box, and its distance from the middle of a box above.
struct Candidate {
    std::uint32_t face;
    double distance;
};

/// Examines one cell after the other.
template <int Degree>
class CellCovering {
public:
    CellCovering(const LatticeField<Degree>& field, const LabeledMesh& mesh, const std::vector<glm::dvec3>& world,
                 const FaceOctree& octree, double tolerance, double least_edge)
        : field_(field), metric_(field.surface().volume().lattice_to_world()), mesh_(mesh), world_(world),
          octree_(octree), tolerance_(tolerance), least_edge_(least_edge), levels_(1)
    {
        reach_ = box_of_ball(metric_, tolerance);
    }

    /// Examines the surface in a cell, and the caps.
    void operator()(const glm::ivec3& cell, bool with_caps)
    {
        const VolumeCell coefficients(field_.surface().volume(), field_.surface().threshold(), cell);
        lower_ = coefficients.lower;
        const SurfaceBox<Degree> box = surface_box<Degree>(coefficients, 0);
        const Box reach{lower_ - reach_, lower_ + 1.0 + reach_};
        levels_[0].clear();
        octree_.visit(reach, [&](std::uint32_t face) {
            levels_[0].push_back({face, 0.0});
            return true;
        });
        cut_ = nullptr;
        if (box.has_surface())
            examine(box, 0);
        if (!with_caps)
            return;
        const SolidPlanes& planes = field_.surface().planes();
        for (std::size_t i = 0; i < planes.all().size(); ++i) {
            cut_ = &planes.all()[i];
            const DistanceRange range({lower_, lower_ + 1.0}, *cut_);
            // On a face between two cells, the cap is in the cell on the inner side.
            if (planes.has_caps(i) && range.least <= plane_margin && range.most > plane_margin)
                examine(box, 0);
        }
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
    void find_points(const SurfaceBox<Degree>& box)
    {
        const UnitSlab slab = slab_of<Degree>(box);
        if (cut_ == nullptr) {
            points_of_slab(slab, points_);
        } else {
            // The plane, widened by the margin, and the side of the slab on which the solid is.
            const double at_lower = glm::dot(cut_->normal, lower_ + box.lower) - cut_->offset;
            points_of_slab({cut_->normal * box.size, -at_lower - margin, -at_lower + margin}, points_);
            if (field_.surface().options().inside == Inside::above)
                clip_hull(points_, slab.normal, slab.lower);
            else
                clip_hull(points_, -slab.normal, -slab.upper);
        }
        for (glm::dvec3& point : points_)
            point = lower_ + box.lower + point * box.size;
        for (const HalfSpace& half_space : field_.surface().planes().all())
            if (&half_space != cut_)
                clip_hull(points_, half_space.normal, half_space.offset - margin);
        for (glm::dvec3& point : points_)
            point = metric_.to_world * point;
    }

    double distance(const glm::dvec3& point, std::uint32_t index) const
    {
        const glm::uvec3& face = mesh_.faces[index];
        return glm::distance(point, closest_point_of_triangle(point, world_[face.x], world_[face.y], world_[face.z]));
    }

    void examine(const SurfaceBox<Degree>& box, std::size_t level)
    {
        if (!may_contain(box))
            return;
        find_points(box);
        if (points_.empty())
            return;
        glm::dvec3 middle(0.0);
        for (const glm::dvec3& point : points_)
            middle += point / static_cast<double>(points_.size());
        double radius = 0.0;
        for (const glm::dvec3& point : points_)
            radius = std::max(radius, glm::distance(point, middle));

        // Faces that may cover a part of the box.
        if (levels_.size() == level + 1)
            levels_.emplace_back();
        levels_[level + 1].clear();
        for (const Candidate& candidate : levels_[level]) {
            const double d = distance(middle, candidate.face);
            if (d + radius <= tolerance_) {
                covering_.distance = std::max(covering_.distance, d + radius);
                return;
            }
            if (d <= tolerance_ + radius)
                levels_[level + 1].push_back({candidate.face, d});
        }
        std::vector<Candidate>& near = levels_[level + 1];
        // The nearest faces come first, also in smaller boxes.
        constexpr std::size_t most_tries = 4;
        const auto tries = near.begin() + static_cast<std::ptrdiff_t>(std::min(near.size(), most_tries));
        std::partial_sort(near.begin(), tries, near.end(), [](const Candidate& a, const Candidate& b) {
            return a.distance != b.distance ? a.distance < b.distance : a.face < b.face;
        });
        for (auto candidate = near.begin(); candidate != tries && candidate->distance <= tolerance_; ++candidate) {
            double farthest = 0.0;
            for (std::size_t i = 0; i < points_.size() && farthest <= tolerance_; ++i)
                farthest = std::max(farthest, distance(points_[i], candidate->face));
            if (farthest <= tolerance_) {
                covering_.distance = std::max(covering_.distance, farthest);
                return;
            }
        }
        const double edge = std::max({box.size.x, box.size.y, box.size.z});
        if ((is_crossed(box) && (near.empty() || edge <= least_edge_)) || edge <= part_if_unsure * least_edge_) {
            covering_.uncovered.push_back({lower_ + box.lower, lower_ + box.lower + box.size});
            return;
        }
        int longest = 0;
        for (int axis = 1; axis < 3; ++axis)
            if (box.size[axis] > box.size[longest])
                longest = axis;
        examine(half_of<Degree>(box, longest, false), level + 1);
        examine(half_of<Degree>(box, longest, true), level + 1);
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
        return range.least < -margin && range.most > margin &&
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

    const LatticeField<Degree>& field_;
    const LatticeMetric metric_;
    const LabeledMesh& mesh_;
    const std::vector<glm::dvec3>& world_;
    const FaceOctree& octree_;
    double tolerance_, least_edge_;
    glm::dvec3 reach_, lower_{0.0};
    const HalfSpace* cut_ = nullptr; ///< of the cap that is examined, or null for the surface
    std::vector<std::vector<Candidate>> levels_;
    std::vector<glm::dvec3> points_;
    Covering covering_;
};

Box box_of(const LabeledMesh& mesh, const glm::uvec3& face)
{
    Box box;
    for (int corner = 0; corner < 3; ++corner)
        box.extend(mesh.vertices[face[corner]]);
    return box;
}

FaceOctree octree_of(const LabeledMesh& mesh)
{
    Box bounds;
    for (const glm::dvec3& vertex : mesh.vertices)
        bounds.extend(vertex);
    FaceOctree octree(bounds, mesh.faces.size(), 0.125);
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        octree.insert(static_cast<std::uint32_t>(i), box_of(mesh, mesh.faces[i]));
    return octree;
}

} // namespace

template <int Degree>
Covering cover_surface(const LatticeField<Degree>& field, const LabeledMesh& mesh, double tolerance, double least_edge,
                       const CellFilter& filter, const Progress& progress)
{
    const IsosurfaceSnapshot& surface = field.surface();
    const LatticeMetric metric(surface.volume().lattice_to_world());
    const FaceOctree octree = octree_of(mesh);
    std::vector<glm::dvec3> world(mesh.vertices.size());
    std::transform(mesh.vertices.begin(), mesh.vertices.end(), world.begin(),
                   [&](const glm::dvec3& vertex) { return metric.to_world * vertex; });

    const std::vector<BrickInQuestion> bricks = bricks_in_question(surface);
    std::vector<Covering> found(bricks.size());
    parallel_for(
        bricks.size(), 4,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                CellCovering<Degree> covering(field, mesh, world, octree, tolerance, least_edge);
                for_each_cell_in_question(surface, bricks[i], [&](const glm::ivec3& cell, bool with_caps) {
                    if (!filter || filter(cell))
                        covering(cell, with_caps);
                });
                found[i] = covering.take();
            }
        },
        progress);
    Covering all;
    for (const Covering& part : found) {
        all.distance = std::max(all.distance, part.distance);
        all.uncovered.insert(all.uncovered.end(), part.uncovered.begin(), part.uncovered.end());
    }
    return all;
}

glm::dvec3 box_of_ball(const LatticeMetric& metric, double radius)
{
    const glm::dmat3 rows = glm::transpose(metric.to_lattice);
    return radius * glm::dvec3(glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2]));
}

double least_edge_of(const LatticeMetric& metric, double tolerance)
{
    const glm::dvec3 reach = box_of_ball(metric, tolerance);
    return std::min(1.0 / 64.0, 0.125 * std::min({reach.x, reach.y, reach.z}));
}

std::vector<LeftOut> join_boxes(const std::vector<Box>& boxes, const LabeledMesh& mesh,
                                const glm::dmat4& lattice_to_world)
{
    if (boxes.empty())
        return {};
    // Number connected boxes alike.
    Box bounds;
    for (const Box& box : boxes)
        bounds.extend(box);
    FaceOctree of_boxes(bounds, boxes.size(), 1.0 / 256.0);
    for (std::size_t i = 0; i < boxes.size(); ++i)
        of_boxes.insert(static_cast<std::uint32_t>(i), boxes[i]);
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> part_of_box(boxes.size(), none), queue;
    std::vector<Box> parts;
    for (std::uint32_t first = 0; first < boxes.size(); ++first) {
        if (part_of_box[first] != none)
            continue;
        const auto part = static_cast<std::uint32_t>(parts.size());
        parts.emplace_back();
        part_of_box[first] = part;
        queue.assign(1, first);
        while (!queue.empty()) {
            const Box box = boxes[queue.back()];
            queue.pop_back();
            parts[part].extend(box);
            const Box around{box.lower - margin, box.upper + margin};
            of_boxes.visit(around, [&](std::uint32_t other) {
                const bool touches = glm::all(glm::lessThanEqual(boxes[other].lower, around.upper)) &&
                                     glm::all(glm::lessThanEqual(around.lower, boxes[other].upper));
                if (touches && part_of_box[other] == none) {
                    part_of_box[other] = part;
                    queue.push_back(other);
                }
                return true;
            });
        }
    }

    // The distance of a box from the mesh is at most that of its middle, and half of its diagonal.
    const LatticeMetric metric(lattice_to_world);
    const FaceOctree of_faces = octree_of(mesh);
    std::vector<double> distances(parts.size(), 0.0);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const glm::dvec3 middle = boxes[i].center(), middle_world = metric.to_world * middle;
        double least = std::numeric_limits<double>::infinity();
        for (double reach = metric.shortest_edge; !mesh.faces.empty() && least > reach; reach *= 2.0) {
            const glm::dvec3 around = box_of_ball(metric, reach);
            of_faces.visit({middle - around, middle + around}, [&](std::uint32_t index) {
                const glm::uvec3& face = mesh.faces[index];
                least = std::min(least,
                                 glm::distance(middle_world, closest_point_of_triangle(
                                                                 middle_world, metric.to_world * mesh.vertices[face.x],
                                                                 metric.to_world * mesh.vertices[face.y],
                                                                 metric.to_world * mesh.vertices[face.z])));
                return true;
            });
        }
        double half_diagonal = 0.0;
        for (int corner = 0; corner < 4; ++corner)
            half_diagonal = std::max(
                half_diagonal, 0.5 * metric.length(boxes[i].size() * glm::dvec3(1.0, (corner & 1) != 0 ? 1.0 : -1.0,
                                                                                (corner >> 1) != 0 ? 1.0 : -1.0)));
        double& distance = distances[part_of_box[i]];
        distance = std::max(distance, least + half_diagonal);
    }

    std::vector<LeftOut> left_out;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const glm::dvec3 size = parts[i].size();
        left_out.push_back({transform_point(lattice_to_world, parts[i].center()),
                            {size.x * glm::length(metric.to_world[0]), size.y * glm::length(metric.to_world[1]),
                             size.z * glm::length(metric.to_world[2])},
                            distances[i]});
    }
    return left_out;
}

template Covering cover_surface(const LatticeField<1>&, const LabeledMesh&, double, double, const CellFilter&,
                                const Progress&);
template Covering cover_surface(const LatticeField<2>&, const LabeledMesh&, double, double, const CellFilter&,
                                const Progress&);
template Covering cover_surface(const LatticeField<3>&, const LabeledMesh&, double, double, const CellFilter&,
                                const Progress&);

} // namespace isospline
