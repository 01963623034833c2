#include "isospline/measure/cell_quadrature.h"

#include "isospline/cell/jet.h"
#include "isospline/math/bernstein_box.h"
#include "isospline/measure/patch_quadrature.h"
#include "isospline/measure/plane_section.h"
#include "isospline/measure/polynomial.h"
#include "isospline/spline/curvature.h"
#include "isospline/spline/degree.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace isospline {

namespace {

/// The largest numbers of halvings and of parts of a cell; the rest counts as error.
constexpr int deepest_box = 21, most_boxes = 2048;
/// Up to this number of halvings, steep graphs are halved: near a place where the surface is parallel to the height, no
/// rule converges, nor do the differences of rules tell so.
constexpr int deepest_steep_box = 15;
constexpr double steep = 0.1;

/// By quantity.
using Sums = std::array<double, quantity_count>;
/// The integrals over a piece by three rules, the fine one first.
using Piece = std::array<Sums, 3>;

} // namespace

struct CellQuadrature::Method {
    virtual ~Method() = default;
    virtual Integrals integrate(const CellCoefficients& cell, double sign, std::span<const HalfSpace> half_spaces,
                                int cap, const NodeVisitor& visit) = 0;
};

template <int Degree>
struct CellQuadrature::MethodOfDegree final : Method {
    /// A part of the cell: lower + [0, 1]^3 * size.
    struct Part {
        BernsteinBox<Degree> b;        ///< sign * (f - level) on it
        bool has_surface;              ///< whether its coefficients have both signs
        glm::dvec3 lower, size;        ///< local coordinates of the cell
        std::vector<HalfSpace> planes; ///< the planes that cross it, in its own coordinates
        int depth;
        int cap; ///< of `planes`, or -1

        double volume() const { return size.x * size.y * size.z; }
    };

    explicit MethodOfDegree(const QuadratureOptions& given)
        : options(given), patches(given.order, given.error), to_lattice(glm::inverse(given.lattice_to_world)),
          determinant(std::abs(glm::determinant(given.lattice_to_world)))
    {
    }

    Integrals integrate(const CellCoefficients& of_cell, double of_sign, std::span<const HalfSpace> half_spaces,
                        int cap, const NodeVisitor& visit) override
    {
        cell = &of_cell;
        visitor = visit ? &visit : nullptr;
        sign = of_sign;
        result = {};
        box_count = 0;
        patches.begin();
        Part part{{}, true, glm::dvec3(0.0), glm::dvec3(1.0), {}, 0, cap};
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int i = 0; i <= Degree; ++i)
                    part.b[bernstein_item<Degree>(i, j, k)] = sign * of_cell(i, j, k);
        for (int axis = 0; axis < 3; ++axis)
            map_rows<Degree>(part.b, axis, [](Bernstein<Degree>& c) { c = scalar::bernstein_of_bspline<Degree>(c); });
        for (const HalfSpace& half_space : half_spaces)
            part.planes.push_back({half_space.normal, half_space.offset - glm::dot(half_space.normal, of_cell.lower)});
        add_part(std::move(part));
        return result;
    }

    /// Adds the integrals over a part.
    void add_part(Part part)
    {
        const auto [least, most] = extremes_of(part.b);
        if (!is_inside(most))
            return;
        part.has_surface = least < 0.0 && most > 0.0;
        // The planes that cross it.
        int kept = 0;
        for (int i = 0; i < static_cast<int>(part.planes.size()); ++i) {
            const HalfSpace& plane = part.planes[static_cast<std::size_t>(i)];
            // Without a margin: if the plane is on a face between two parts, only the inner one has its cap.
            const DistanceRange distance({glm::dvec3(0.0), glm::dvec3(1.0)}, plane);
            if (distance.most <= 0.0)
                return;
            const bool is_cap = i == part.cap;
            if (is_cap && distance.least > 0.0)
                return;
            if (!is_cap && distance.least >= 0.0)
                continue;
            if (is_cap)
                part.cap = kept;
            part.planes[static_cast<std::size_t>(kept++)] = HalfSpace(plane);
        }
        part.planes.resize(static_cast<std::size_t>(kept));
        if (!part.has_surface && part.cap < 0) {
            // Where f <= level, faces with f = level are in the surface.
            if (options.surface && (sign > 0.0 ? least < 0.0 : least == 0.0))
                add_zero_faces(part);
            if (least < 0.0)
                return; // no more than points where f = level is in the solid
            if (part.planes.empty())
                return static_cast<void>(result.value[index_of(Quantity::volume)] += determinant * part.volume());
        }

        // Either integrate a graph over a face, or halve the part.
        if (const int axis = height_axis(part); axis >= 0)
            return add_graph(part, axis);
        if (part.depth == deepest_box || ++box_count > most_boxes)
            return add_unresolved(part);
        const int axis = part.depth % 3;
        for (const bool upper : {false, true}) {
            Part half = part;
            half.b = half_of<Degree>(part.b, axis, upper);
            ++half.depth;
            half.size[axis] *= 0.5;
            half.lower[axis] += upper ? half.size[axis] : 0.0;
            for (HalfSpace& plane : half.planes) {
                plane.normal[axis] *= 0.5;
                plane.offset -= upper ? plane.normal[axis] : 0.0;
            }
            add_part(std::move(half));
        }
    }

    /// Whether a point with this value of sign * (f - level) is in the solid; see Solid.
    bool is_inside(double value) const { return sign > 0.0 ? value >= 0.0 : value > 0.0; }

    /// Adds the areas of all faces of a part on which f = level. They have no curvature.
    void add_zero_faces(const Part& part)
    {
        for (int axis = 0; axis < 3; ++axis)
            for (const bool upper : {false, true}) {
                const PatchPolynomial face = face_of<Degree>(part.b, axis, upper);
                if (!face.is_zero())
                    continue;
                std::vector<PatchPolynomial> edges;
                for (const HalfSpace& plane : part.planes)
                    edges.push_back(plane_on_face(plane, axis, upper));
                glm::dvec3 normal(0.0);
                normal[axis] = 1.0;
                const auto add = [&](const PatchNode& node, Sums& to) {
                    const glm::dvec3 point = point_of_face(axis, node.position, upper);
                    if (is_within(part.planes, -1, point))
                        add_area(part.lower + part.size * point, plane_area(part, normal, axis, node.weight),
                                 node.rule == 0, to);
                };
                integrate_pieces(
                    std::move(edges), !part.planes.empty(), [](int, double) {}, add);
            }
    }

    /// The axis along which the surface, or the cap, is proven to be a graph; -1 if none.
    int height_axis(const Part& part) const
    {
        if (part.cap >= 0 || !part.has_surface)
            return steepest_axis(part.planes[static_cast<std::size_t>(std::max(part.cap, 0))]);
        const GraphAxis found = graph_axis<Degree>(part.b);
        return found.slope < steep && part.depth < deepest_steep_box && box_count < most_boxes ? -1 : found.axis;
    }

    /// Adds a part so small that it hardly matters: its content is between nothing and the whole part.
    void add_unresolved(const Part& part)
    {
        const double half = 0.5 * determinant * part.volume();
        result.value[index_of(Quantity::volume)] += half;
        add_unresolved(Quantity::volume, half);
        // Lines along an axis meet the surface at most n times each (Crofton).
        double area = 0.0;
        for (int axis = 0; axis < 3; ++axis)
            area += Degree * determinant * glm::length(glm::dvec3(axis == 0, axis == 1, axis == 2) * to_lattice) *
                    part.volume() / part.size[axis];
        add_unresolved(Quantity::area, area);
        add_unresolved(Quantity::mean_curvature, std::sqrt(4.0 * std::numbers::pi * area));
        add_unresolved(Quantity::gaussian_curvature, 4.0 * std::numbers::pi);
    }

    void add_unresolved(Quantity quantity, double error)
    {
        result.error[index_of(quantity)] += error;
        result.unresolved[index_of(quantity)] += error;
    }

    /// Adds the integrals over a part in which the surface, or the cap, and the planes are graphs along an axis.
    void add_graph(const Part& part, int axis)
    {
        std::vector<PatchPolynomial> edges;
        const bool is_cap = part.cap >= 0, follows_curve = is_cap && visitor != nullptr;
        if (part.has_surface && !is_cap) {
            edges.push_back(face_of<Degree>(part.b, axis, false));
            edges.push_back(face_of<Degree>(part.b, axis, true));
        }
        for (std::size_t i = 0; i < part.planes.size(); ++i) {
            const HalfSpace& plane = part.planes[i];
            const auto is_met = [&](std::size_t plane_index) {
                return !is_cap || plane_index == static_cast<std::size_t>(part.cap);
            };
            if (is_met(i)) {
                edges.push_back(plane_on_face(plane, axis, 0.0));
                edges.push_back(plane_on_face(plane, axis, 1.0));
                // A plane nearly parallel to the height counts as error. The curve to follow is first; it may be in a
                // face.
                if ((part.has_surface || follows_curve) && is_section_sound(plane, axis))
                    edges.insert(follows_curve ? edges.begin() : edges.end(), section<Degree>(part.b, plane, axis));
            }
            for (std::size_t j = 0; j < i; ++j)
                if (is_met(i) || is_met(j))
                    edges.push_back(plane_on_plane(plane, part.planes[j], axis));
        }
        const bool cross = !part.planes.empty();
        if (follows_curve)
            return patches.integrate_zeros(std::move(edges), cross,
                                           [&](const ZeroNode& node) { visit_edge(part, axis, node); });
        FaceRow<Degree> row;
        integrate_pieces(
            std::move(edges), cross,
            [&](int coordinate, double position) { row = FaceRow<Degree>(part.b, axis, coordinate, position); },
            [&](const PatchNode& node, Sums& to) { add_height(part, axis, row, node, to); });
    }

    /// Visits a point of the curve where the surface meets the cap's plane.
    void visit_edge(const Part& part, int axis, const ZeroNode& node)
    {
        const HalfSpace& cap = part.planes[static_cast<std::size_t>(part.cap)];
        const glm::dvec3 point = point_on_plane(cap, axis, node.position);
        if (!is_in_cube(point) || !is_within(part.planes, part.cap, point))
            return;
        if (const double weight = plane_area(part, cap.normal, axis, node.weight); std::isfinite(weight))
            (*visitor)(part.lower + part.size * point, weight);
    }

    /// Integrates over the unit square, between the zeros of the edges; `add(node, integrals)` adds one node of the row
    /// that has begun.
    template <typename BeginRow, typename Add>
    void integrate_pieces(std::vector<PatchPolynomial> edges, bool cross, const BeginRow& begin_row, const Add& add)
    {
        Piece piece{};
        const auto visit = [&](const PatchNode& node) {
            if (node.is_resolved || node.rule != 0)
                return add(node, piece[node.rule]);
            Sums found{};
            add(node, found);
            for (std::size_t i = 0; i < quantity_count; ++i) {
                piece[0][i] += found[i];
                add_unresolved(static_cast<Quantity>(i), std::abs(found[i]));
            }
        };
        // The errors of pieces may have different signs, so their magnitudes are added.
        const auto end_piece = [&] {
            for (std::size_t i = 0; i < quantity_count; ++i) {
                const double fine = piece[0][i];
                result.value[i] += fine;
                result.error[i] += std::max(std::abs(fine - piece[1][i]), std::abs(fine - piece[2][i]));
            }
            piece = {};
        };
        patches.integrate(std::move(edges), cross, begin_row, visit, end_piece);
    }

    /// Integrates over one point of the face, in this row.
    void add_height(const Part& part, int axis, const FaceRow<Degree>& row, const PatchNode& node, Sums& to)
    {
        const glm::dvec2& x = node.position;
        glm::dvec3 point = point_of_face(axis, x, 0.0);

        // The heights within the half-spaces.
        double lower = 0.0, upper = 1.0, cap_height = -1.0;
        for (std::size_t i = 0; i < part.planes.size(); ++i) {
            const HalfSpace& plane = part.planes[i];
            const double below = glm::dot(plane.normal, point) - plane.offset, slope = plane.normal[axis];
            if (static_cast<int>(i) == part.cap) {
                if ((below > 0.0) == (below + slope > 0.0))
                    return;
                cap_height = -below / slope;
            } else if (slope > 0.0) {
                lower = std::max(lower, -below / slope);
            } else if (slope < 0.0) {
                upper = std::min(upper, -below / slope);
            } else if (below < 0.0) {
                return;
            }
        }
        if (!(lower < upper))
            return;

        const LinePolynomial line = row.line(x);
        if (part.cap >= 0) {
            const HalfSpace& cap = part.planes[static_cast<std::size_t>(part.cap)];
            if (cap_height >= lower && cap_height <= upper && is_inside(line.value(cap_height)))
                to[index_of(Quantity::area)] += plane_area(part, cap.normal, axis, node.weight);
            return;
        }
        double height = 0.5;
        bool is_met = false;
        if (part.has_surface) {
            // A surface on the face between two cells counts in the one where f < level.
            const bool starts = is_inside(line.b[0]), ends = is_inside(line.b[Degree]);
            is_met = starts != ends;
            if (!starts && !ends)
                return;
            if (is_met) {
                height = bracketed_root(line);
                is_met = height >= lower && height <= upper;
                if (starts)
                    upper = std::min(upper, height);
                else
                    lower = std::max(lower, height);
            }
        }
        to[index_of(Quantity::volume)] += determinant * part.volume() * node.weight * std::max(upper - lower, 0.0);
        if (is_met && options.surface) {
            point[axis] = height;
            const glm::dvec3 on_face = row.gradient(x, height);
            const glm::dvec3 gradient = point_of_face(axis, glm::dvec2(on_face), on_face.z) / part.size;
            add_surface(part.lower + part.size * point, axis, gradient, node.weight * part.volume() / part.size[axis],
                        node.rule == 0, to);
        }
    }

    /// Adds a point of the surface in the cell, with a gradient there, for an area of a face.
    void add_surface(const glm::dvec3& local, int axis, const glm::dvec3& gradient, double face_area, bool is_fine,
                     Sums& to)
    {
        const double area = determinant * face_area * glm::length(gradient * to_lattice) / std::abs(gradient[axis]);
        if (!std::isfinite(area))
            return;
        add_area(local, area, is_fine, to);
        if (!options.curvature)
            return;
        const Jet jet = jet_in_cell<Degree>(*cell, local);
        const Curvature curvature = curvature_of_level_surface(jet.gradient * to_lattice,
                                                               glm::transpose(to_lattice) * jet.hessian * to_lattice);
        to[index_of(Quantity::mean_curvature)] -= sign * area * curvature.mean;
        to[index_of(Quantity::gaussian_curvature)] += area * curvature.gaussian;
    }

    void add_area(const glm::dvec3& local, double area, bool is_fine, Sums& to) const
    {
        to[index_of(Quantity::area)] += area;
        if (visitor != nullptr && is_fine)
            (*visitor)(local, area);
    }

    /// The area of a plane, given its normal in the part's own coordinates, for an area of a face.
    double plane_area(const Part& part, const glm::dvec3& part_normal, int axis, double weight) const
    {
        const glm::dvec3 normal = part_normal / part.size;
        const double stretch = glm::length(normal * to_lattice) / std::abs(normal[axis]);
        return determinant * weight * (part.volume() / part.size[axis]) * stretch;
    }

    QuadratureOptions options;
    PatchQuadrature patches;
    glm::dmat3 to_lattice;
    double determinant;
    const CellCoefficients* cell = nullptr;
    const NodeVisitor* visitor = nullptr; ///< of nodes on the surface, or on the edge of a cap
    Integrals result;                     ///< of the cell so far
    double sign = 1.0;
    int box_count = 0;
};

CellQuadrature::CellQuadrature(int degree, const QuadratureOptions& options)
    : method_(dispatch_degree(degree, [&](auto of_degree) -> std::unique_ptr<Method> {
          return std::make_unique<MethodOfDegree<of_degree>>(options);
      }))
{
}

CellQuadrature::~CellQuadrature() = default;
CellQuadrature::CellQuadrature(CellQuadrature&&) noexcept = default;

Integrals CellQuadrature::integrate(const CellCoefficients& cell, double sign, std::span<const HalfSpace> half_spaces,
                                    const NodeVisitor& visit_surface)
{
    return method_->integrate(cell, sign, half_spaces, -1, visit_surface);
}

Integrals CellQuadrature::integrate_cap(const CellCoefficients& cell, double sign,
                                        std::span<const HalfSpace> half_spaces, std::size_t cap,
                                        const NodeVisitor& visit_edge)
{
    return method_->integrate(cell, sign, half_spaces, static_cast<int>(cap), visit_edge);
}

} // namespace isospline
