// The origins of rays that leave a surface. They are off the surface by a bound on the rounding error of tests that
// would find it again. docs/method.md, "Rays that leave a surface", derives the bounds.
#include "isospline/cell/value-inl.h"
#include "isospline/cell/value_error.h"
#include "isospline/math/affine.h"
#include "isospline/scene/isosurface_object.h"
#include "isospline/scene/mesh_object.h"
#include "isospline/spline/degree.h"
#include "isospline/util/error.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace isospline {

namespace {

/// Evaluates one isosurface at points near its hits, in the scene's world space.
template <int Degree>
class Clearance {
public:
    Clearance(const IsosurfaceSnapshot& surface, const glm::dmat4& centred_to_local, const RayFrame& frame,
              const glm::dvec3& position)
        : surface_(surface), to_lattice_(centred_to_local), centre_(frame.centre)
    {
        // The line of a ray begins where it enters the scene's box; docs/method.md counts the roundings from there.
        for (int axis = 0; axis < 3; ++axis) {
            double size = 1.0 + std::abs(to_lattice_[3][axis]);
            for (int column = 0; column < 3; ++column)
                size += std::abs(to_lattice_[column][axis]) *
                        std::max(frame.box.upper[column], std::abs(position[column] - centre_[column]));
            coordinate_error_ = std::max(coordinate_error_, 32.0 * 0x1p-53 * size);
        }
    }

    /// A lower bound on side * (f - level) here, in every cell in which a ray from here may be solved.
    double operator()(const glm::dvec3& position, double side) const
    {
        const glm::dvec3 lattice = transform_point(to_lattice_, position - centre_);
        const glm::ivec3 first = cell_at(lattice - reach()), last = cell_at(lattice + reach());
        double least = std::numeric_limits<double>::infinity();
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x) {
                    const VolumeCell cell(surface_.volume(), surface_.threshold(), glm::ivec3(x, y, z));
                    const double value = scalar::value_in_cell<Degree>(cell, lattice - cell.lower);
                    least = std::min(least, side * value - value_error<Degree>(cell, coordinate_error_));
                }
        return least;
    }

    /// A lower bound on the distance of a point inside a half-space of lattice space from its plane.
    double operator()(const glm::dvec3& position, const HalfSpace& half_space) const
    {
        const glm::dvec3 lattice = transform_point(to_lattice_, position - centre_);
        return glm::dot(half_space.normal, lattice) - half_space.offset - 4.0 * coordinate_error_;
    }

    /// The gradient in the hit's own cell. At degree 1, a neighbour has another gradient at the same point.
    glm::dvec3 gradient_lattice(const glm::dvec3& position, const glm::ivec3& hit_cell) const
    {
        const VolumeCell cell(surface_.volume(), surface_.threshold(), hit_cell);
        return scalar::gradient_in_cell<Degree>(cell, transform_point(to_lattice_, position - centre_) - cell.lower);
    }

private:
    /// The largest distance by which rounding may move a point of the ray.
    double reach() const { return 2.0 * coordinate_error_; }

    glm::ivec3 cell_at(const glm::dvec3& lattice) const
    {
        return glm::clamp(glm::ivec3(glm::floor(lattice)), glm::ivec3(0), surface_.volume().cell_shape() - 1);
    }

    const IsosurfaceSnapshot& surface_;
    const glm::dmat4& to_lattice_;
    const glm::dvec3 centre_;
    double coordinate_error_ = 0.0;
};

/// `gradient` is in world space. `side`, 1 or -1, is relative to the gradient if it does not vanish. `cell_size` is the
/// smallest length of a cell in world units, along any direction.
template <int Degree>
glm::dvec3 offset_from_isosurface(const Clearance<Degree>& clearance, const glm::dvec3& gradient, double side,
                                  const glm::dvec3& position, const glm::dvec3& towards, double cell_size)
{
    // Go along the gradient. If it vanishes, go along the ray and use the side on which the ray turns out to be.
    const double slope = glm::length(gradient);
    glm::dvec3 away = (side / slope) * gradient;
    if (!(slope > 0.0)) {
        away = glm::normalize(towards);
        const glm::dvec3 probe = position + 1e-3 * cell_size * away;
        side = clearance(probe, 1.0) >= clearance(probe, -1.0) ? 1.0 : -1.0;
    }

    const double lacking = -clearance(position, side);
    if (lacking < 0.0)
        return position;
    // If f were linear and positions were exact, half of the first step would be enough.
    const double position_rounding =
        8.0 * 0x1p-53 * std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z)});
    const double first_step =
        std::max(slope > 0.0 ? std::min(2.0 * lacking / slope, 1e-3 * cell_size) : 0.0, position_rounding);
    for (double step = first_step; step < 0.25 * cell_size; step *= 2.0) {
        const glm::dvec3 moved = position + step * away;
        if (clearance(moved, side) > 0.0)
            return moved;
    }
    // Within rounding, f equals the level over a quarter of a cell: there are no sides.
    return position + first_step * away;
}

/// A condition for the origin of a ray: a clearance must be above zero. It grows in a direction.
struct Condition {
    std::function<double(const glm::dvec3& position)> clearance;
    glm::dvec3 direction; ///< unit, or zero if it is not known
};

/// Moves a position until all conditions hold, along the mean direction of the conditions that do not.
glm::dvec3 offset_until_all_hold(const std::vector<Condition>& conditions, const glm::dvec3& position,
                                 const glm::dvec3& towards, double cell_size)
{
    std::vector<bool> has_failed(conditions.size());
    const auto all_hold = [&](const glm::dvec3& at) {
        bool all = true;
        for (std::size_t i = 0; i < conditions.size(); ++i)
            if (!(conditions[i].clearance(at) > 0.0)) {
                has_failed[i] = true;
                all = false;
            }
        return all;
    };
    if (all_hold(position))
        return position;
    const double first_step =
        std::max(8.0 * 0x1p-53 * std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z)}),
                 1e-15 * cell_size);
    glm::dvec3 away(0.0);
    for (double step = first_step; step < 0.25 * cell_size; step *= 2.0) {
        away = glm::dvec3(0.0);
        for (std::size_t i = 0; i < conditions.size(); ++i)
            if (has_failed[i])
                away += conditions[i].direction;
        away = glm::normalize(glm::length(away) > 1e-6 ? away : towards);
        const glm::dvec3 moved = position + step * away;
        if (all_hold(moved))
            return moved;
    }
    return position + first_step * away;
}

glm::dvec3 unit_or_zero(const glm::dvec3& vector)
{
    const double length = glm::length(vector);
    return length > 0.0 ? vector / length : glm::dvec3(0.0);
}

/// The largest length of a matrix's columns. The matrix stretches a vector by at most sqrt(3) times this length.
double norm_of(const glm::dmat3& matrix)
{
    double largest = 0.0;
    for (int column = 0; column < 3; ++column)
        largest = std::max(largest, glm::length(matrix[column]));
    return largest;
}

} // namespace

glm::dvec3 IsosurfaceObject::offset_position(const Hit& hit, const glm::dvec3& towards, const RayFrame& frame,
                                             const Placement& placement) const
{
    if (hit.primitive_id >= surface_->primitive_count())
        throw_invalid("hit", "a primitive id below " + std::to_string(surface_->primitive_count()), hit.primitive_id);
    const double cell_size = 1.0 / (std::sqrt(3.0) * norm_of(glm::dmat3(placement.centred_to_local)));
    return dispatch_degree(surface_->volume().degree(), [&](auto degree) {
        const glm::dmat4& to_lattice = placement.centred_to_local;
        const Clearance<degree> clearance(*surface_, to_lattice, frame, hit.position);
        // The normal that the user sees decides; the gradient here has different rounding.
        const bool outward = glm::dot(hit.normal, towards) >= 0.0;
        const double side = outward == (surface_->options().inside == Inside::below) ? 1.0 : -1.0;
        const auto in_half_space = [&](const HalfSpace& half_space) {
            return Condition{[&clearance, half_space](const glm::dvec3& at) { return clearance(at, half_space); },
                             unit_or_zero(transform_gradient(to_lattice, half_space.normal))};
        };
        if (outward && surface_->is_cap(hit.primitive_id)) {
            const auto& [normal, offset] = surface_->cut_of(hit.primitive_id);
            return offset_until_all_hold({in_half_space({-normal, -offset})}, hit.position, towards, cell_size);
        }
        if (!outward && surface_->planes().have_caps()) {
            const glm::dvec3 lattice = transform_point(to_lattice, hit.position - frame.centre);
            const glm::dvec3 inwards = side * transform_gradient(to_lattice, gradient_lattice(*surface_, lattice));
            std::vector<Condition> in_solid{
                {[&](const glm::dvec3& at) { return clearance(at, side); }, unit_or_zero(inwards)}};
            for (const HalfSpace& half_space : surface_->planes().all())
                in_solid.push_back(in_half_space(half_space));
            return offset_until_all_hold(in_solid, hit.position, towards, cell_size);
        }
        const glm::dvec3 gradient = transform_gradient(
            to_lattice, clearance.gradient_lattice(hit.position, surface_->volume().cell_at(hit.primitive_id)));
        return offset_from_isosurface(clearance, gradient, side, hit.position, towards, cell_size);
    });
}

glm::dvec3 MeshObject::offset_position(const Hit& hit, const glm::dvec3& towards, const RayFrame& frame,
                                       const Placement& placement) const
{
    const glm::dvec3& centre = frame.centre;
    if (hit.primitive_id >= mesh_->faces().size())
        throw_invalid("hit", "a primitive id below " + std::to_string(mesh_->faces().size()), hit.primitive_id);
    const glm::uvec3& face = mesh_->faces()[hit.primitive_id];
    const auto corner = [&](unsigned int vertex) {
        return transform_point(placement.transform, mesh_->vertices()[vertex]) - centre;
    };
    const glm::dvec3 a = corner(face.x), b = corner(face.y), c = corner(face.z);
    const glm::dvec3 cross = glm::cross(b - a, c - a);
    const double doubled_area = glm::length(cross);
    if (!(doubled_area > 0.0))
        return hit.position;
    const glm::dvec3 normal = (glm::dot(cross, hit.normal) < 0.0 ? -1.0 : 1.0) / doubled_area * cross;

    // A bound on how far rounding in the map to the mesh's own space may move a ray, in world units.
    constexpr double unit_roundoff = 0x1p-53;
    const double a_b = glm::length(b - a), b_c = glm::length(c - b), c_a = glm::length(a - c);
    const double condition = 3.0 * norm_of(glm::dmat3(placement.transform)) * norm_of(placement.linear_inverse);
    const double places = glm::length(hit.position) + glm::length(centre) +
                          glm::length(glm::dvec3(placement.transform[3])) + std::max({a_b, b_c, c_a});
    const double distance = 128.0 * unit_roundoff * condition * condition * places;

    // Keep the same distance from edges, so that the point is also inside of the triangles behind them.
    glm::dvec3 position = hit.position - centre;
    position -= glm::dot(position - a, normal) * normal;
    const double perimeter = a_b + b_c + c_a;
    const glm::dvec3 incentre = (b_c * a + c_a * b + a_b * c) / perimeter;
    const double inradius = doubled_area / perimeter;
    double share = 0.0;
    const auto keep_from_edge = [&](const glm::dvec3& from, const glm::dvec3& to, double length) {
        const double to_edge = glm::dot(glm::cross(to - from, position - from), cross) / (doubled_area * length);
        if (to_edge < distance)
            share = std::max(share, distance < inradius ? (distance - to_edge) / (inradius - to_edge) : 1.0);
    };
    keep_from_edge(a, b, a_b);
    keep_from_edge(b, c, b_c);
    keep_from_edge(c, a, c_a);
    position += share * (incentre - position);

    const double side = glm::dot(hit.normal, towards) < 0.0 ? -1.0 : 1.0;
    return centre + (position + side * distance * normal);
}

} // namespace isospline
