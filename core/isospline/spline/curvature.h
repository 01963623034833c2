// Curvatures of the level surfaces of a function.
#pragma once

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

/// Curvatures of a surface at a point. The mean and the principal curvatures are positive where the surface bends away
/// from its normal, as a sphere does from its outward normal.
struct Curvature {
    double mean = 0.0;     ///< (k1 + k2) / 2, in units of 1 / length
    double gaussian = 0.0; ///< k1 k2, in units of 1 / length^2

    /// The principal curvatures k2 <= k1, the roots of k^2 - 2 mean k + gaussian.
    double maximum() const { return mean + half_difference(); }
    double minimum() const { return mean - half_difference(); }

private:
    double half_difference() const { return std::sqrt(std::max(mean * mean - gaussian, 0.0)); }
};

/// Curvatures at x of the level surface of f through x. Its normal points along the gradient. All are zero where the
/// gradient vanishes.
///
/// Mean: (|g|^2 tr H - <g, H g>) / (2 |g|^3), half the divergence of the normal. Gaussian: <g, adj(H) g> / |g|^4.
/// R. Goldman, "Curvature formulas for implicit curves and surfaces", Computer Aided Geometric Design 22, 2005, section
/// 4 (its mean curvature has the opposite sign).
inline Curvature curvature_of_level_surface(const glm::dvec3& gradient, const glm::dmat3& hessian)
{
    const double square = glm::dot(gradient, gradient);
    if (!(square > 0.0))
        return {};
    // The unit normal n and H / |g| avoid powers of |g|, which may overflow.
    const glm::dvec3 n = gradient / std::sqrt(square);
    const glm::dmat3 h = hessian / std::sqrt(square);
    const double trace = h[0][0] + h[1][1] + h[2][2];
    // The adjugate of a symmetric matrix has the cross products of its columns as its columns.
    const glm::dmat3 adjugate(glm::cross(h[1], h[2]), glm::cross(h[2], h[0]), glm::cross(h[0], h[1]));
    return {0.5 * (trace - glm::dot(n, h * n)), glm::dot(n, adjugate * n)};
}

} // namespace isospline
