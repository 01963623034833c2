#include "isospline/scene/thickness.h"

#include "isospline/math/box.h"
#include "isospline/math/half_space.h"
#include "isospline/math/linear_program.h"
#include "isospline/query/closest_point.h"
#include "isospline/query/lattice_metric.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace isospline {

namespace {

struct Ball {
    glm::dvec3 center;
    double radius;
};

/// The radius of the largest ball whose centre is on the inward normal, whose sphere contains the point, and in which
/// no point of the surface is deeper than the gap. Infinite if the normal leaves the solid where it is open, and the
/// ball ends at the outer side of another part: then the solid does not bound it.
double shrunk_radius(ClosestPointFinder& find, const ClosestPoint& at, double radius, double gap, double precision,
                     bool is_open)
{
    constexpr int most_balls = 64;
    ClosestPoint other;
    for (int ball = 0; ball < most_balls && radius > gap; ++ball) {
        const ClosestPoint found = find.within(at.position - radius * at.normal, radius - gap);
        if (!(found.distance < radius - gap - precision))
            break;
        other = found;
        // The other point becomes as deep as the gap.
        const glm::dvec3 between = at.position - other.position;
        const double along = glm::dot(between, at.normal) - gap;
        const double next = 0.5 * (glm::dot(between, between) - gap * gap) / along;
        if (!(along > 0.0 && next < radius))
            break;
        radius = std::max(next, gap);
    }
    const glm::dvec3 to_center = at.position - radius * at.normal - other.position;
    const bool is_before_other = std::isfinite(other.distance) && glm::dot(to_center, other.normal) > precision;
    return is_open && is_before_other ? std::numeric_limits<double>::infinity() : radius;
}

/// A point of the surface that was nearest to the centre of a ball.
struct Touched {
    ClosestPoint point;
    bool was_met; ///< the centre was on the surface there, or beyond it
};

/// Whether a place is in the solid, given the nearest point of the surface.
bool is_behind(const glm::dvec3& place, const ClosestPoint& nearest)
{
    return glm::dot(place - nearest.position, nearest.normal) < 0.0;
}

/// The half-spaces where centres may be, with unit normals: the domain of the volume and the clip. Beyond them, an open
/// solid has no surface that bounds a ball.
std::vector<HalfSpace> half_spaces_of(const IsosurfaceSnapshot& surface)
{
    const Volume& volume = surface.volume();
    const glm::dmat4& map = volume.world_to_lattice();
    const Box domain = domain_lattice(volume);
    std::vector<HalfSpace> found = surface.options().clip;
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 row(map[0][axis], map[1][axis], map[2][axis]);
        found.push_back({row, domain.lower[axis] - map[3][axis]});
        found.push_back({-row, map[3][axis] - domain.upper[axis]});
    }
    for (HalfSpace& each : found) {
        const double length = glm::length(each.normal);
        each = {each.normal / length, each.offset / length};
    }
    return found;
}

/// The centre of a larger ball, and its radius if no points of the surface are nearer than `touched`. `step` bounds the
/// change of each coordinate.
Ball grown(const Ball& ball, const glm::dvec3& point, const std::vector<Touched>& touched, double gap, double step,
           double precision, const Box& bounds, const std::vector<HalfSpace>& half_spaces)
{
    // The variables are the change of the centre and the new radius, in this unit.
    const double unit = std::max(ball.radius, step);
    std::vector<LinearConstraint<4>> constraints;
    const glm::dvec3 from_point = ball.center - point;
    const double away = glm::length(from_point);
    const glm::dvec3 direction = away > 0.0 ? from_point / away : glm::dvec3(0.0);
    constraints.push_back({{direction.x, direction.y, direction.z, -1.0}, (gap - away) / unit});
    for (const auto& [other, was_met] : touched) {
        // |center - other| is convex, so its tangent plane is below it.
        const glm::dvec3 from_other = ball.center - other.position;
        double distance = glm::length(from_other);
        glm::dvec3 slope = from_other / distance;
        // A centre on the surface moves inwards, from all parts that meet there. Within the precision of nearest
        // points, their directions are unknown.
        if (distance <= 2.0 * precision) {
            slope = -other.normal;
        } else if (was_met && ball.radius <= 2.0 * precision) {
            slope = -other.normal;
            distance = glm::dot(from_other, slope);
        }
        constraints.push_back({{-slope.x, -slope.y, -slope.z, 1.0}, distance / unit});
    }
    for (const HalfSpace& each : half_spaces) {
        const double inside = glm::dot(each.normal, ball.center) - each.offset;
        constraints.push_back({{-each.normal.x, -each.normal.y, -each.normal.z, 0.0}, std::max(0.0, inside) / unit});
    }
    std::array<double, 4> lower{}, upper{}, change{};
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = std::max(-step, std::min(0.0, bounds.lower[axis] - ball.center[axis])) / unit;
        upper[axis] = std::min(step, std::max(0.0, bounds.upper[axis] - ball.center[axis])) / unit;
    }
    upper[3] = 2.0;
    if (!maximize<4>({0.0, 0.0, 0.0, 1.0}, constraints, lower, upper, change))
        return ball;
    return {ball.center + unit * glm::dvec3(change[0], change[1], change[2]), unit * change[3]};
}

/// A large ball in the solid whose distance from a point of the surface is at most `gap`: the local thickness of
/// T. Hildebrand and P. Ruegsegger, "A new method for the model-independent assessment of thickness in
/// three-dimensional images", Journal of Microscopy 185, 1997, which is insensitive to ripples lower than the gap. If
/// the gap is zero, the ball is the largest one that touches the surface at the point.
///
/// The first ball is centred on the inward normal. It shrinks until no point of the surface is deeper in it than the
/// gap: J. Ma, S. W. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
/// The Visual Computer 28, 2012. Then its centre moves to where a larger ball is, by linear programs with the points of
/// the surface that were nearest so far, until the radius grows by less than `precision`. This finds a local maximum,
/// which may be within a ripple. The ball is at least as large, up to `precision`, as the one that touches
/// the surface at the point.
///
/// @param find Finds nearest points within `precision`.
/// @param at A point of the surface.
/// @param radius Of the first ball, whose centre and the way to it are in the solid, or beyond where it is open.
/// @param is_open Whether the inward normal leaves the solid where it is open.
/// @return The radius is infinite if the ball would end at the outer side of another part.
/// @param bounds, half_spaces Where centres may be.
Ball inscribed_ball(ClosestPointFinder& find, const ClosestPoint& at, double radius, bool is_open, double gap,
                    double precision, const Box& bounds, const std::vector<HalfSpace>& half_spaces)
{
    const auto touching_ball = [&](double most, double depth) {
        const double least = shrunk_radius(find, at, most, depth, precision, is_open);
        return Ball{at.position - least * at.normal, least};
    };
    const Ball touching = touching_ball(radius, 0.0);
    if (gap == 0.0 || !std::isfinite(touching.radius))
        return touching;
    Ball ball = touching_ball(radius, gap);
    if (!std::isfinite(ball.radius))
        return ball;
    ClosestPoint first = find(ball.center);
    if (!is_behind(ball.center, first)) {
        ball = touching;
        first = find(ball.center);
    }
    if (!std::isfinite(first.distance))
        return ball;
    ball.radius = first.distance;
    std::vector<Touched> touched{{first, false}};
    constexpr int most_balls = 64;
    // A centre that stays in the ball is in the solid. Beside an edge, the first ball may be as small as one likes.
    const auto longest_step = [&] { return 0.5 * std::max(ball.radius, gap); };
    double step = longest_step();
    for (int i = 0; i < most_balls; ++i) {
        const Ball next = grown(ball, at.position, touched, gap, step, precision, bounds, half_spaces);
        if (!(next.radius > ball.radius + precision))
            break;
        const ClosestPoint other = find(next.center);
        const bool is_inside = glm::length(next.center - ball.center) < ball.radius || is_behind(next.center, other);
        touched.push_back({other, !is_inside || other.distance <= 2.0 * precision});
        if (is_inside && other.distance > ball.radius &&
            glm::length(next.center - at.position) <= other.distance + gap + 0.1 * precision) {
            ball = {next.center, other.distance};
            step = std::min(2.0 * step, longest_step());
        } else {
            step *= 0.5;
        }
    }
    return touching.radius > ball.radius + precision ? touching : ball;
}

} // namespace

void find_thickness(const SceneSnapshot& scene, const IsosurfaceSnapshot& surface, ThicknessMethod method,
                    double ripple, std::span<const glm::dvec3> points_world, std::span<double> thickness)
{
    // Rays from the surface inwards.
    ClosestPointFinder find(surface);
    std::vector<ClosestPoint> starts(points_world.size());
    std::vector<Ray> rays(points_world.size());
    std::vector<Hit> hits(points_world.size());
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        starts[i] = find(points_world[i]);
        rays[i].origin = glm::dvec3(0.0);
        rays[i].direction = glm::dvec3(0.0, 0.0, 1.0);
        rays[i].t_far = -1.0; // meets nothing
        if (!(glm::length(starts[i].normal) > 0.0))
            continue;
        Hit start;
        start.position = starts[i].position;
        start.normal = starts[i].normal;
        start.geometry_id = 0;
        start.primitive_id = starts[i].primitive_id;
        rays[i] = Ray{};
        rays[i].direction = -starts[i].normal;
        rays[i].origin = scene.offset_position(start, rays[i].direction);
    }
    scene.cast_rays(rays, hits);
    const auto is_known = [&](std::size_t i) { return glm::length(starts[i].normal) > 0.0; };
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        // A ray that enters has left the solid before, where it is open.
        if (!is_known(i))
            thickness[i] = std::numeric_limits<double>::quiet_NaN();
        else if (std::isfinite(hits[i].t) && glm::dot(hits[i].normal, rays[i].direction) >= 0.0)
            thickness[i] = hits[i].t + glm::length(rays[i].origin - starts[i].position);
        else
            thickness[i] = std::numeric_limits<double>::infinity();
    }
    if (method == ThicknessMethod::ray)
        return;

    const Box bounds = scene.bounds();
    const std::vector<HalfSpace> half_spaces = half_spaces_of(surface);
    const double largest = glm::length(bounds.size());
    const double edge = LatticeMetric(surface.volume().lattice_to_world()).shortest_edge;
    const double precision = std::clamp(0.02 * ripple, 1e-3 * edge, 1e-2 * edge);
    ClosestPointFinder find_within_precision(surface, {.tolerance = precision});
    for (std::size_t i = 0; i < points_world.size(); ++i) {
        if (!is_known(i))
            continue;
        const double ray = std::min(thickness[i], 2.0 * largest);
        const Ball ball = inscribed_ball(find_within_precision, starts[i], 0.5 * (ray + std::min(ripple, 0.5 * ray)),
                                         !std::isfinite(thickness[i]), ripple, precision, bounds, half_spaces);
        if (std::isfinite(thickness[i]) || ball.radius < largest - ripple)
            thickness[i] = 2.0 * ball.radius;
    }
}

} // namespace isospline
