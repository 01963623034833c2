#include "isospline/polygonize/face_distance.h"

#include "isospline/math/affine.h"
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
/// How often a part of a cell is halved in a proof by signs. Halving the piece is the alternative, and costs more.
constexpr int most_halvings = 3;

Corners moved(const Corners& corners, const glm::dvec3& step)
{
    return {corners[0] + step, corners[1] + step, corners[2] + step};
}

glm::dvec3 center_of(const Corners& corners)
{
    return (corners[0] + corners[1] + corners[2]) / 3.0;
}

/// A triangle on which sign * (f - level) may be positive, and the function's tangent plane at its center.
template <int Degree>
struct SignProof {
    const Corners& triangle;
    double sign;
    glm::dvec3 center, gradient; ///< of f at the center
    double value;                ///< of f - level there
    glm::dvec3 normal;           ///< of the triangle
    double allowed;              ///< the least value of sign * tangent on the triangle

    double tangent(const glm::dvec3& x) const { return value + glm::dot(gradient, x - center); }

    /// Whether a box is beside the triangle's plane.
    bool is_beside(const Box& box) const
    {
        const double height = glm::dot(normal, box.center() - triangle[0]);
        return std::abs(height) > 0.5 * glm::dot(glm::abs(normal), box.size()) + margin * glm::length(normal);
    }

    /// Whether it is positive on what a part of a cell at `cell` has of the triangle.
    bool holds(const SurfaceBox<Degree>& part, const glm::dvec3& cell, int halvings) const
    {
        const Box box{cell + part.lower, cell + part.lower + part.size};
        if (is_beside(box))
            return true;
        // sign * (f - level) is at least its least coefficient, and at least the tangent plus the least difference.
        const double base = tangent(box.lower);
        const glm::dvec3 slope = gradient * part.size / static_cast<double>(Degree);
        double least = infinity, least_difference = infinity, largest = 0.0;
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int i = 0; i <= Degree; ++i) {
                    const double b = part.b[bernstein_item<Degree>(i, j, k)];
                    least = std::min(least, sign * b);
                    least_difference =
                        std::min(least_difference, sign * (b - base - glm::dot(slope, glm::dvec3(i, j, k))));
                    largest = std::max(largest, std::abs(b));
                }
        const double rounding = 0x1p-44 * (largest + std::abs(base));
        if (least > rounding || allowed + least_difference > rounding)
            return true;
        if (halvings == 0)
            return false;
        int longest = 0;
        for (int axis = 1; axis < 3; ++axis)
            if (part.size[axis] > part.size[longest])
                longest = axis;
        return holds(half_of<Degree>(part, longest, false), cell, halvings - 1) &&
               holds(half_of<Degree>(part, longest, true), cell, halvings - 1);
    }
};

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
    return std::all_of(triangle.begin(), triangle.end(),
                       [&](const glm::dvec3& corner) { return sign * field_.value(corner) > 0.0; });
}

template <int Degree>
bool FaceDistance<Degree>::has_sign(const Corners& triangle, double sign, const HalfSpace* plane, int halvings)
{
    const Box box = box_of(triangle);
    const auto cells = cells_of(box, plane);
    if (!cells)
        return false;
    const glm::dvec3 center = center_of(triangle);
    const PointInCell point(field_.surface(), center);
    const auto [value, slopes] = scalar::value_and_gradient_in_cell<Degree>(point.cell, point.local);
    SignProof<Degree> proof{triangle,        sign,    center, {slopes[0], slopes[1], slopes[2]}, value,
                            glm::dvec3(0.0), infinity};
    proof.normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    for (const glm::dvec3& corner : triangle)
        proof.allowed = std::min(proof.allowed, sign * proof.tangent(corner));
    glm::ivec3 cell;
    for (cell.z = (*cells)[0].z; cell.z <= (*cells)[1].z; ++cell.z)
        for (cell.y = (*cells)[0].y; cell.y <= (*cells)[1].y; ++cell.y)
            for (cell.x = (*cells)[0].x; cell.x <= (*cells)[1].x; ++cell.x) {
                const glm::dvec3 at(cell);
                const glm::dvec3 from = glm::clamp(box.lower - at, glm::dvec3(0.0), glm::dvec3(1.0 - 0x1p-40));
                const glm::dvec3 to = glm::clamp(box.upper - at, from + 0x1p-40, glm::dvec3(1.0));
                if (proof.is_beside({at + from, at + to}))
                    continue;
                if (!field_.surface().kept_cells().contains(cell) ||
                    !proof.holds(part_of_cell(cell_box(cell), from, to), at, halvings))
                    return false;
            }
    return true;
}

template <int Degree>
bool FaceDistance<Degree>::is_kept_between(const Corners& first, const Corners& second) const
{
    Box box = box_of(first);
    box.extend(box_of(second));
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

template <int Degree>
double FaceDistance<Degree>::bound_by_signs(const Corners& piece, double reach)
{
    const glm::dvec3 center = center_of(piece);
    const glm::dvec3 gradient = field_.gradient(center) * metric_.to_lattice;
    const double slope = glm::length(gradient);
    if (!(slope > 0.0))
        return infinity;
    // First, twice the distance that is likely.
    double likely = std::abs(field_.value(center));
    for (const glm::dvec3& corner : piece)
        likely = std::max(likely, std::abs(field_.value(corner)));
    const double first = 2.0 * likely / slope + 0.125 * reach;
    for (const double distance : {first, reach}) {
        if (distance > reach)
            continue;
        const int halvings = distance == reach ? most_halvings : 0;
        const glm::dvec3 step = metric_.to_lattice * ((distance / slope) * gradient);
        const Corners above = moved(piece, step), below = moved(piece, -step);
        if (corners_have_sign(above, 1.0) && corners_have_sign(below, -1.0) && is_in_planes(above, 0) &&
            is_in_planes(below, 0) && is_kept_between(above, below) && has_sign(above, 1.0, nullptr, halvings) &&
            has_sign(below, -1.0, nullptr, halvings))
            return distance;
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
double FaceDistance<Degree>::piece_bound(const Corners& piece, FaceLabel label, double reach)
{
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
    if (length < reach) {
        if (const auto near = foot(center, label))
            best = std::min(best, farthest_from(*near));
        if (best <= reach)
            return best;
        // The search for the nearest point is slower, and never fails.
        const bool is_small = length < 0.125 * reach;
        if (is_small || length < 0.5 * reach) {
            if (!finder_)
                finder_ = std::make_unique<ClosestPointFinder>(field_.surface(),
                                                               ClosestPointOptions{.tolerance = reach / 64.0});
            const glm::dmat4& to_world = field_.surface().volume().lattice_to_world();
            const glm::dvec3 center_world = transform_point(to_world, center);
            double distance = finder_->within(center_world, reach).distance;
            if (!(distance <= reach))
                distance = (*finder_)(center_world).distance;
            best = std::min(best, distance + farthest_from(center));
            if (best <= reach || is_small || distance > reach)
                return best;
        }
    }
    const glm::dvec3 &a = piece[longest], &b = piece[(longest + 1) % 3], &c = piece[(longest + 2) % 3];
    const glm::dvec3 middle = 0.5 * (a + b);
    const double first = piece_bound({a, middle, c}, label, reach);
    return std::max(first, piece_bound({middle, b, c}, label, reach));
}

template <int Degree>
double FaceDistance<Degree>::bound(const Corners& corners, FaceLabel label, double enough)
{
    return piece_bound(corners, label, enough);
}

template <int Degree>
std::vector<double> distances_from_surface(const LatticeField<Degree>& field, const LabeledMesh& mesh, double enough,
                                           const Progress& progress)
{
    const LatticeMetric metric(field.surface().volume().lattice_to_world());
    std::vector<double> bounds(mesh.faces.size());
    parallel_for(
        mesh.faces.size(), 256,
        [&](std::size_t begin, std::size_t end) {
            FaceDistance<Degree> distance(field, metric);
            for (std::size_t i = begin; i < end; ++i)
                bounds[i] = distance.bound(corners_of(mesh, i), mesh.labels[i], enough);
        },
        progress);
    return bounds;
}

template class FaceDistance<1>;
template class FaceDistance<2>;
template class FaceDistance<3>;
template std::vector<double> distances_from_surface(const LatticeField<1>&, const LabeledMesh&, double,
                                                    const Progress&);
template std::vector<double> distances_from_surface(const LatticeField<2>&, const LabeledMesh&, double,
                                                    const Progress&);
template std::vector<double> distances_from_surface(const LatticeField<3>&, const LabeledMesh&, double,
                                                    const Progress&);

} // namespace isospline
