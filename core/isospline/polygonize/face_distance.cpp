#include "isospline/polygonize/face_distance.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/clipped_triangle.h"
#include "isospline/query/surface_box.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace isospline {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
/// Points this far out of a half-space or of the domain count as inside, in lattice units.
constexpr double margin = 4.0 * plane_margin;
/// The largest extent of a piece for a proof by signs, in cells.
constexpr double largest_piece = 4.0;
/// How often what a cell has of a piece is halved in a proof by signs. Halving the piece is the alternative, and costs
/// more.
constexpr int most_halvings = ClippedTriangle::most_planes - 6;

Corners moved(const Corners& corners, const glm::dvec3& step)
{
    return {corners[0] + step, corners[1] + step, corners[2] + step};
}

glm::dvec3 center_of(const Corners& corners)
{
    return (corners[0] + corners[1] + corners[2]) / 3.0;
}

/// Whether sign * (f - level) is proven to be positive on a polygon in a cell, in its local coordinates. If the proof
/// fails, the polygon is halved up to `halvings` times.
template <int Degree>
bool has_sign_in_cell(const ClippedTriangle& polygon, const SurfaceBox<Degree>& cell, double sign, int halvings)
{
    constexpr double least_edge = 0x1p-40, rounding = 0x1p-38;
    if (polygon.has_too_many)
        return false;
    const Box box = polygon.box();
    const glm::dvec3 lower = glm::clamp(box.lower, glm::dvec3(0.0), glm::dvec3(1.0 - least_edge));
    const SurfaceBox<Degree> part =
        part_of_cell(cell, lower, glm::clamp(box.upper, lower + least_edge, glm::dvec3(1.0)));
    const UnitSlab slab = slab_of<Degree>(part);
    double largest = 0.0;
    for (const double b : part.b)
        largest = std::max(largest, std::abs(b));
    // f - level lies between <normal, t> - slab.upper and <normal, t> - slab.lower.
    double least = infinity;
    for (std::size_t i = 0; i < polygon.count; ++i) {
        const double at = glm::dot(slab.normal, (polygon.corners[i] - part.lower) / part.size);
        if ((sign > 0.0 ? at - slab.lower : slab.upper - at) < 0.0)
            return false;
        least = std::min(least, sign > 0.0 ? at - slab.upper : slab.lower - at);
    }
    if (least > rounding * largest)
        return true;
    if (halvings == 0)
        return false;
    int longest = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (part.size[axis] > part.size[longest])
            longest = axis;
    const double middle = part.lower[longest] + 0.5 * part.size[longest];
    return has_sign_in_cell(polygon.cut(longest, middle, false), cell, sign, halvings - 1) &&
           has_sign_in_cell(polygon.cut(longest, middle, true), cell, sign, halvings - 1);
}

} // namespace

template <int Degree>
const SurfaceBox<Degree>& FaceDistance<Degree>::cell_box(const glm::ivec3& cell)
{
    recent_.resize(recent_count);
    RecentCell& recent = recent_[static_cast<std::size_t>(cell.x + 5 * cell.y + 23 * cell.z) % recent_count];
    if (recent.index != cell) {
        recent.box = surface_box<Degree>(VolumeCell(field_.surface().volume(), field_.surface().threshold(), cell), 0);
        recent.index = cell;
    }
    return recent.box;
}

template <int Degree>
bool FaceDistance<Degree>::is_in_planes(const Corners& corners, FaceLabel except) const
{
    const std::vector<HalfSpace>& planes = field_.surface().planes().all();
    for (std::size_t i = 0; i < planes.size(); ++i)
        for (const glm::dvec3& corner : corners)
            if (i + 1 != except && glm::dot(planes[i].normal, corner) < planes[i].offset - margin)
                return false;
    return true;
}

template <int Degree>
std::optional<std::array<glm::ivec3, 2>> FaceDistance<Degree>::cells_of(const Box& box, const HalfSpace* plane) const
{
    const glm::ivec3 shape = field_.surface().volume().cell_shape();
    if (!Box{glm::dvec3(-margin), glm::dvec3(shape) + margin}.contains(box))
        return std::nullopt;
    const glm::dvec3 inward = plane != nullptr ? 2.0 * margin * plane->normal : glm::dvec3(0.0);
    const glm::ivec3 first = glm::clamp(glm::ivec3(glm::floor(box.lower + inward)), glm::ivec3(0), shape - 1);
    const glm::ivec3 last = glm::clamp(glm::ivec3(glm::ceil(box.upper + inward)) - 1, first, shape - 1);
    return std::array{first, last};
}

/// A few values rule out most triangles that have the other sign.
template <int Degree>
bool FaceDistance<Degree>::corners_have_sign(const Corners& triangle, double sign) const
{
    return sign * field_.value(center_of(triangle)) > 0.0 &&
           std::all_of(triangle.begin(), triangle.end(),
                       [&](const glm::dvec3& corner) { return sign * field_.value(corner) > 0.0; });
}

template <int Degree>
bool FaceDistance<Degree>::has_sign(const Corners& triangle, double sign, const HalfSpace* plane, int halvings)
{
    const auto cells = cells_of(box_of(triangle), plane);
    if (!cells)
        return false;
    const auto [first, last] = *cells;
    Corners inside = triangle;
    for (glm::dvec3& corner : inside)
        corner = glm::clamp(corner, glm::dvec3(first), glm::dvec3(last + 1));
    const ClippedTriangle whole(inside);
    const auto slice = [](const ClippedTriangle& polygon, int axis, int at, const glm::ivec3& from,
                          const glm::ivec3& to) {
        const ClippedTriangle above = at > from[axis] ? polygon.cut(axis, at, true) : polygon;
        return at < to[axis] ? above.cut(axis, at + 1.0, false) : above;
    };
    glm::ivec3 cell;
    for (cell.z = first.z; cell.z <= last.z; ++cell.z) {
        const ClippedTriangle of_layer = slice(whole, 2, cell.z, first, last);
        for (cell.y = first.y; cell.y <= last.y; ++cell.y) {
            const ClippedTriangle of_row = slice(of_layer, 1, cell.y, first, last);
            for (cell.x = first.x; cell.x <= last.x; ++cell.x) {
                ClippedTriangle of_cell = slice(of_row, 0, cell.x, first, last);
                if (of_cell.count == 0)
                    continue;
                for (std::size_t i = 0; i < of_cell.count; ++i)
                    of_cell.corners[i] -= glm::dvec3(cell);
                if (!field_.surface().kept_cells().contains(cell) ||
                    !has_sign_in_cell(of_cell, cell_box(cell), sign, halvings))
                    return false;
            }
        }
    }
    return true;
}

template <int Degree>
bool FaceDistance<Degree>::is_kept_around(const Corners& piece, const Corners& above, const Corners& below) const
{
    Box box = box_of(piece);
    box.extend(box_of(above));
    box.extend(box_of(below));
    const auto cells = cells_of(box, nullptr);
    if (!cells)
        return false;
    glm::ivec3 cell;
    for (cell.z = (*cells)[0].z; cell.z <= (*cells)[1].z; ++cell.z)
        for (cell.y = (*cells)[0].y; cell.y <= (*cells)[1].y; ++cell.y)
            for (cell.x = (*cells)[0].x; cell.x <= (*cells)[1].x; ++cell.x)
                if (!field_.surface().kept_cells().contains(cell))
                    return false;
    return true;
}

/// A point of the domain after a step. At the border, the step goes along it, and is as long.
template <int Degree>
glm::dvec3 FaceDistance<Degree>::moved_in_domain(const glm::dvec3& from, glm::dvec3 step) const
{
    const glm::dvec3 shape(field_.surface().volume().cell_shape());
    const glm::dvec3 to = from + step, inside = glm::clamp(to, glm::dvec3(0.0), shape);
    if (to == inside)
        return to;
    const double length = metric_.length(step);
    for (int axis = 0; axis < 3; ++axis)
        if (to[axis] != inside[axis])
            step[axis] = 0.0;
    const double along = metric_.length(step);
    return along > 0.0 ? glm::clamp(from + length / along * step, glm::dvec3(0.0), shape) : from;
}

template <int Degree>
double FaceDistance<Degree>::bound_by_signs(const Corners& piece, double reach)
{
    // The directions of the gradients at the corners, in the world, and the slopes along them.
    Corners directions;
    double likely = 0.0; // distance
    for (std::size_t i = 0; i < 3; ++i) {
        const PointInCell point(field_.surface(), piece[i]);
        const auto [value, slopes] = scalar::value_and_gradient_in_cell<Degree>(point.cell, point.local);
        const glm::dvec3 gradient = glm::dvec3(slopes[0], slopes[1], slopes[2]) * metric_.to_lattice;
        const double slope = glm::length(gradient);
        if (!(slope > 0.0))
            return infinity;
        directions[i] = metric_.to_lattice * (gradient / slope);
        likely = std::max(likely, std::abs(value) / slope);
    }
    const glm::dvec3 center = center_of(piece);
    likely =
        std::max(likely, std::abs(field_.value(center)) / glm::length(field_.gradient(center) * metric_.to_lattice));
    // At last, almost the reach: rounding must not exceed it.
    for (const bool is_last : {false, true}) {
        const double distance = is_last ? (1.0 - 0x1p-30) * reach : 2.0 * likely + 0.125 * reach;
        if (!(distance < reach))
            continue;
        const int halvings = is_last ? most_halvings : 0;
        Corners above, below;
        double farthest = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            above[i] = moved_in_domain(piece[i], distance * directions[i]);
            below[i] = moved_in_domain(piece[i], -distance * directions[i]);
            farthest = std::max({farthest, metric_.length(above[i] - piece[i]), metric_.length(below[i] - piece[i])});
        }
        if (farthest <= reach && corners_have_sign(above, 1.0) && corners_have_sign(below, -1.0) &&
            is_in_planes(above, 0) && is_in_planes(below, 0) && is_kept_around(piece, above, below) &&
            has_sign(above, 1.0, nullptr, halvings) && has_sign(below, -1.0, nullptr, halvings))
            return farthest;
    }
    return infinity;
}

template <int Degree>
double FaceDistance<Degree>::bound_by_solid(const Corners& piece, FaceLabel label, double reach)
{
    const double sign = field_.surface().inward_sign();
    const HalfSpace* const plane = plane_of(label);
    if (corners_have_sign(piece, sign) && is_in_planes(piece, label) && has_sign(piece, sign, plane, 0))
        return 0.0;
    const glm::dvec3 center = center_of(piece);
    const glm::dvec3 normal = glm::normalize(plane->normal * metric_.to_lattice);
    glm::dvec3 along = field_.gradient(center) * metric_.to_lattice;
    along -= glm::dot(along, normal) * normal;
    const double slope = glm::length(along);
    if (!(slope > 0.0))
        return infinity;
    double missing = 0.0;
    for (const glm::dvec3& corner : piece)
        missing = std::max(missing, -sign * field_.value(corner));
    const double first = 2.0 * missing / slope + 0.125 * reach;
    for (const double distance : {first, reach}) {
        if (distance > reach)
            continue;
        const Corners inner = moved(piece, metric_.to_lattice * ((sign * distance / slope) * along));
        if (corners_have_sign(inner, sign) && is_in_planes(inner, label) &&
            has_sign(inner, sign, plane, distance == reach ? most_halvings : 0))
            return distance;
    }
    return infinity;
}

template <int Degree>
std::optional<glm::dvec3> FaceDistance<Degree>::foot(const glm::dvec3& at, FaceLabel label) const
{
    const auto is_kept = [&](const glm::dvec3& point) {
        return is_in_planes({point, point, point}, label) &&
               field_.surface().kept_cells().contains(PointInCell(field_.surface(), point).index);
    };
    if (label != on_isosurface)
        return std::nullopt;
    const auto found = field_.project(at, search_reach, metric_);
    if (!found || !is_kept(*found))
        return std::nullopt;
    // There is a root nearby if f changes its sign.
    constexpr double nearby = 1e-7;
    const glm::dvec3 gradient = field_.gradient(*found), shape(field_.surface().volume().cell_shape());
    const glm::dvec3 step = nearby * gradient / glm::length(gradient);
    const bool changes = field_.value(glm::clamp(*found + step, glm::dvec3(0.0), shape)) > 0.0 &&
                         field_.value(glm::clamp(*found - step, glm::dvec3(0.0), shape)) < 0.0;
    return changes ? found : std::nullopt;
}

template <int Degree>
bool FaceDistance<Degree>::is_in_near_parts(const Corners& piece)
{
    return rows_(piece,
                 [this](const glm::ivec3& first, int last_x) { return parts_.near().contains_row(first, last_x); });
}

template <int Degree>
double FaceDistance<Degree>::piece_bound(const Corners& piece, FaceLabel label, double reach)
{
    if (label == on_isosurface && parts_.distance() > 0.0 && parts_.distance() <= reach && is_in_near_parts(piece))
        return parts_.distance();
    std::size_t longest = 0;
    double length = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
        if (const double edge = metric_.length(piece[(i + 1) % 3] - piece[i]); edge > length) {
            length = edge;
            longest = i;
        }
    double best = infinity;
    const glm::dvec3 size = box_of(piece).size(), center = center_of(piece);
    if (std::max({size.x, size.y, size.z}) <= largest_piece) {
        best = label == on_isosurface ? bound_by_signs(piece, reach) : bound_by_solid(piece, label, reach);
        if (best <= reach)
            return best;
    }
    const auto farthest_from = [&](const glm::dvec3& point) {
        double most = 0.0;
        for (const glm::dvec3& corner : piece)
            most = std::max(most, metric_.length(corner - point));
        return most;
    };
    // The length of pieces that are not cut, as a part of the reach. For a distance just below the reach, they must be
    // small, which costs more.
    const double small = with_excess_ ? 0x1p-8 : 0.125;
    if (length < reach) {
        if (const auto near = foot(center, label))
            best = std::min(best, farthest_from(*near));
        if (best <= reach)
            return best;
        // The search for the nearest point is slower, and never fails.
        const bool is_small = length < small * reach;
        if (is_small || length < 0.5 * reach) {
            if (!finder_)
                finder_ = std::make_unique<ClosestPointFinder>(field_.surface(),
                                                               ClosestPointOptions{.tolerance = 0.125 * small * reach});
            const glm::dmat4& to_world = field_.surface().volume().lattice_to_world();
            const glm::dvec3 center_world = transform_point(to_world, center);
            double distance = finder_->within(center_world, reach).distance;
            if (!(distance <= reach))
                distance = with_excess_ ? (*finder_)(center_world).distance : infinity;
            best = std::min(best, distance + farthest_from(center));
            if (best <= reach || is_small || distance > reach)
                return best;
        }
    }
    const glm::dvec3 &a = piece[longest], &b = piece[(longest + 1) % 3], &c = piece[(longest + 2) % 3];
    const glm::dvec3 middle = 0.5 * (a + b);
    const double first = piece_bound({a, middle, c}, label, reach);
    if (first > reach && !with_excess_)
        return infinity;
    return std::max(first, piece_bound({middle, b, c}, label, reach));
}

template <int Degree>
double FaceDistance<Degree>::bound(const Corners& corners, FaceLabel label, double enough)
{
    return piece_bound(corners, label, enough);
}

template <int Degree>
std::vector<double> distances_from_surface(const LatticeField<Degree>& field, const SurfaceParts& parts,
                                           const LabeledMesh& mesh, double enough, bool with_excess,
                                           const Progress& progress)
{
    const LatticeMetric metric(field.surface().volume().lattice_to_world());
    std::vector<double> bounds(mesh.faces.size());
    parallel_for(
        mesh.faces.size(), 256,
        [&](std::size_t begin, std::size_t end) {
            FaceDistance<Degree> distance(field, parts, metric, with_excess);
            for (std::size_t i = begin; i < end; ++i)
                bounds[i] = distance.bound(corners_of(mesh, i), mesh.labels[i], enough);
        },
        progress);
    return bounds;
}

template class FaceDistance<1>;
template class FaceDistance<2>;
template class FaceDistance<3>;
template std::vector<double> distances_from_surface(const LatticeField<1>&, const SurfaceParts&, const LabeledMesh&,
                                                    double, bool, const Progress&);
template std::vector<double> distances_from_surface(const LatticeField<2>&, const SurfaceParts&, const LabeledMesh&,
                                                    double, bool, const Progress&);
template std::vector<double> distances_from_surface(const LatticeField<3>&, const SurfaceParts&, const LabeledMesh&,
                                                    double, bool, const Progress&);

} // namespace isospline
