#include "isospline/query/inscribed_ball.h"

#include "isospline/math/linear_program.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace isospline {

namespace {

/// The radius of the largest ball whose centre is on the inward normal, whose sphere contains the point, and in which
/// no point of the surface is deeper than the gap.
double shrunk_radius(ClosestPointFinder& find, const ClosestPoint& at, double radius, double gap, double precision)
{
    constexpr int most_balls = 64;
    for (int ball = 0; ball < most_balls && radius > gap; ++ball) {
        const ClosestPoint other = find.within(at.position - radius * at.normal, radius - gap);
        if (!(other.distance < radius - gap - precision))
            break;
        // The other point becomes as deep as the gap.
        const glm::dvec3 between = at.position - other.position;
        const double along = glm::dot(between, at.normal) - gap;
        const double next = 0.5 * (glm::dot(between, between) - gap * gap) / along;
        if (!(along > 0.0 && next < radius))
            break;
        radius = std::max(next, gap);
    }
    return radius;
}

/// The centre of a larger ball, and its radius if no points of the surface are nearer than `touched`. `step` bounds the
/// change of each coordinate.
Ball grown(const Ball& ball, const glm::dvec3& point, const std::vector<glm::dvec3>& touched, double gap, double step,
           const Box& bounds)
{
    // In units of the radius; the variables are the change of the centre and the new radius.
    const double unit = ball.radius;
    std::vector<LinearConstraint<4>> constraints;
    const glm::dvec3 from_point = ball.center - point;
    const double away = glm::length(from_point);
    const glm::dvec3 direction = from_point / away;
    constraints.push_back({{direction.x, direction.y, direction.z, -1.0}, (gap - away) / unit});
    for (const glm::dvec3& other : touched) {
        // |center - other| is convex, so its tangent plane is below it.
        const glm::dvec3 from_other = ball.center - other;
        const double distance = glm::length(from_other);
        const glm::dvec3 slope = from_other / distance;
        constraints.push_back({{-slope.x, -slope.y, -slope.z, 1.0}, distance / unit});
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

} // namespace

Ball inscribed_ball(ClosestPointFinder& find, const ClosestPoint& at, double radius, double gap, double precision,
                    const Box& bounds)
{
    Ball ball{at.position, shrunk_radius(find, at, radius, gap, precision)};
    ball.center -= ball.radius * at.normal;
    if (gap == 0.0)
        return ball;
    const ClosestPoint first = find(ball.center);
    if (!(first.distance > 0.0) || !std::isfinite(first.distance))
        return ball;
    ball.radius = first.distance;
    std::vector<glm::dvec3> touched{first.position};
    constexpr int most_balls = 64;
    double step = 0.5 * ball.radius; // the centre stays in the ball
    for (int i = 0; i < most_balls; ++i) {
        const Ball next = grown(ball, at.position, touched, gap, step, bounds);
        if (!(next.radius > ball.radius + precision))
            break;
        const ClosestPoint other = find(next.center);
        touched.push_back(other.position);
        if (other.distance > ball.radius &&
            glm::length(next.center - at.position) <= other.distance + gap + 0.1 * precision) {
            ball = {next.center, other.distance};
            step = std::min(2.0 * step, 0.5 * ball.radius);
        } else {
            step *= 0.5;
        }
    }
    return ball;
}

} // namespace isospline
