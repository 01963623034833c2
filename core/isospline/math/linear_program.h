// Linear programs with few variables.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace isospline {

/// normal . z <= offset
template <std::size_t N>
struct LinearConstraint {
    std::array<double, N> normal;
    double offset;
};

/// Maximizes objective . z within lower <= z <= upper and the constraints, whose normals and offsets have magnitudes
/// near 1. Returns whether there is such a z.
///
/// R. Seidel, "Small-dimensional linear programming and convex hulls made easy", Discrete & Computational Geometry 6,
/// 1991: constraints are added one by one. If the optimum violates the new one, the next optimum is in its plane.
template <std::size_t N>
bool maximize(const std::array<double, N>& objective, const std::vector<LinearConstraint<N>>& constraints,
              const std::array<double, N>& lower, const std::array<double, N>& upper, std::array<double, N>& z)
{
    constexpr double rounding = 1e-12;
    for (std::size_t k = 0; k < N; ++k) {
        if (lower[k] > upper[k])
            return false;
        z[k] = objective[k] > 0.0 ? upper[k] : objective[k] < 0.0 ? lower[k] : std::clamp(0.0, lower[k], upper[k]);
    }
    for (std::size_t i = 0; i < constraints.size(); ++i) {
        const auto& [normal, offset] = constraints[i];
        double value = -offset;
        for (std::size_t k = 0; k < N; ++k)
            value += normal[k] * z[k];
        if (value <= rounding)
            continue;
        std::size_t pivot = 0;
        for (std::size_t k = 1; k < N; ++k)
            if (std::abs(normal[k]) > std::abs(normal[pivot]))
                pivot = k;
        if (std::abs(normal[pivot]) <= rounding)
            return false;
        if constexpr (N == 1) {
            // The objective prefers the end that the constraint cuts off.
            z[0] = offset / normal[0];
            if (z[0] < lower[0] - rounding || z[0] > upper[0] + rounding)
                return false;
            for (std::size_t m = 0; m < i; ++m)
                if (constraints[m].normal[0] * z[0] > constraints[m].offset + rounding)
                    return false;
        } else {
            // z[pivot] = plane_offset - plane . (the other variables)
            std::array<double, N - 1> plane, less_objective, less_lower, less_upper, less;
            const double plane_offset = offset / normal[pivot];
            const auto others = [&](std::size_t k) { return k < pivot ? k : k + 1; };
            for (std::size_t k = 0; k + 1 < N; ++k) {
                plane[k] = normal[others(k)] / normal[pivot];
                less_objective[k] = objective[others(k)] - objective[pivot] * plane[k];
                less_lower[k] = lower[others(k)];
                less_upper[k] = upper[others(k)];
            }
            const auto in_plane = [&](const LinearConstraint<N>& constraint) {
                LinearConstraint<N - 1> reduced{{}, constraint.offset - constraint.normal[pivot] * plane_offset};
                for (std::size_t k = 0; k + 1 < N; ++k)
                    reduced.normal[k] = constraint.normal[others(k)] - constraint.normal[pivot] * plane[k];
                return reduced;
            };
            std::vector<LinearConstraint<N - 1>> reduced;
            LinearConstraint<N> bound{{}, upper[pivot]};
            bound.normal[pivot] = 1.0;
            reduced.push_back(in_plane(bound));
            bound = {{}, -lower[pivot]};
            bound.normal[pivot] = -1.0;
            reduced.push_back(in_plane(bound));
            for (std::size_t m = 0; m < i; ++m)
                reduced.push_back(in_plane(constraints[m]));
            if (!maximize<N - 1>(less_objective, reduced, less_lower, less_upper, less))
                return false;
            z[pivot] = plane_offset;
            for (std::size_t k = 0; k + 1 < N; ++k) {
                z[others(k)] = less[k];
                z[pivot] -= plane[k] * less[k];
            }
        }
    }
    return true;
}

} // namespace isospline
