// Lens distortion in OpenCV's model: a map of the plane at depth 1.
#pragma once

#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>

#include <array>
#include <optional>

namespace isospline {

/// D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971; with the rational and the
/// thin prism terms of OpenCV.
struct LensDistortion {
    /// In OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4.
    std::array<double, 12> coefficients{};

    bool operator==(const LensDistortion&) const = default;
    bool is_none() const { return *this == LensDistortion(); }

    /// The distorted position, on the plane at depth 1, of the point (x, y, 1) of camera space, x to the right and y
    /// down; with the derivatives with respect to x and y as columns.
    glm::dvec2 distort(const glm::dvec2& point, glm::dmat2* derivative = nullptr) const;
    /// The point with a distorted position, searched from `start`; nothing if Newton's method finds none where the
    /// image is not folded.
    std::optional<glm::dvec2> undistort(const glm::dvec2& distorted, const glm::dvec2& start) const;
    std::optional<glm::dvec2> undistort(const glm::dvec2& distorted) const { return undistort(distorted, distorted); }
    /// Whether all points on the line from the centre to a distorted point can be undistorted, and the last one gives
    /// the point that undistort() finds.
    bool reaches(const glm::dvec2& distorted) const;
};

} // namespace isospline
