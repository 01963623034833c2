#include "isospline/render/camera.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace isospline {

glm::dvec2 LensDistortion::distort(const glm::dvec2& point, glm::dmat2* derivative) const
{
    const auto [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = coefficients;
    const double x = point.x, y = point.y, square = x * x + y * y;
    const double above = 1.0 + square * (k1 + square * (k2 + square * k3));
    const double below = 1.0 + square * (k4 + square * (k5 + square * k6));
    const double radial = above / below;
    if (derivative != nullptr) {
        const double above_slope = k1 + square * (2.0 * k2 + square * 3.0 * k3);
        const double below_slope = k4 + square * (2.0 * k5 + square * 3.0 * k6);
        const double slope = (above_slope - radial * below_slope) / below; // by the square
        const double x_prism = s1 + 2.0 * square * s2, y_prism = s3 + 2.0 * square * s4;
        const double cross = 2.0 * x * y * slope + 2.0 * (p1 * x + p2 * y);
        (*derivative)[0] = {radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + 2.0 * x * x_prism,
                            cross + 2.0 * x * y_prism};
        (*derivative)[1] = {cross + 2.0 * y * x_prism,
                            radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + 2.0 * y * y_prism};
    }
    return {x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x) + square * (s1 + square * s2),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y + square * (s3 + square * s4)};
}

std::optional<glm::dvec2> LensDistortion::search(const glm::dvec2& distorted, const glm::dvec2& start) const
{
    constexpr int most_steps = 30;
    constexpr double accuracy = 1e-14;
    glm::dvec2 point = start;
    for (int step = 0; step < most_steps; ++step) {
        glm::dmat2 derivative;
        const glm::dvec2 miss = distorted - distort(point, &derivative);
        if (!(glm::determinant(derivative) > 0.0))
            return std::nullopt;
        const glm::dvec2 change = glm::inverse(derivative) * miss;
        point += change;
        if (glm::length(change) <= accuracy * (1.0 + glm::length(point)))
            return point;
    }
    return std::nullopt;
}

bool LensDistortion::is_behind_fold(const glm::dvec2& point) const
{
    constexpr int steps = 8;
    for (int step = 1; step < steps; ++step) {
        glm::dmat2 derivative;
        distort(point * (static_cast<double>(step) / steps), &derivative);
        if (!(glm::determinant(derivative) > 0.0))
            return true;
    }
    return false;
}

std::optional<glm::dvec2> LensDistortion::follow(const glm::dvec2& distorted) const
{
    constexpr int steps = 32;
    std::optional<glm::dvec2> point(glm::dvec2(0.0));
    for (int step = 0; step <= steps && point; ++step)
        point = search(distorted * (static_cast<double>(step) / steps), *point);
    return point;
}

std::optional<glm::dvec2> LensDistortion::undistort(const glm::dvec2& distorted) const
{
    const auto direct = search(distorted, distorted);
    return direct && !is_behind_fold(*direct) ? direct : follow(distorted);
}

bool LensDistortion::reaches(const glm::dvec2& distorted) const
{
    const auto point = follow(distorted), direct = undistort(distorted);
    return point && direct && glm::distance(*direct, *point) <= 1e-9 * (1.0 + glm::length(*point));
}

} // namespace isospline
