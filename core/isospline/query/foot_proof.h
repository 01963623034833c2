// Proof that no part of a surface is nearer to a point than the foot of a perpendicular.
#pragma once

#include "isospline/cell/jet.h"
#include "isospline/math/frame.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/query/surface_descent.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace isospline {

/// Bounds on a quadratic form v^T M v at v = v_t + v_n n, for a unit vector n and v_t perpendicular to it: it is at
/// most tangential |v_t|^2 + 2 mixed |v_t| |v_n| + normal v_n^2.
struct Bend {
    double tangential, mixed, normal;
};

/// Second derivatives of f in a cell, from those at one of its points and bounds on third derivatives. Third
/// derivatives are weighted means of third differences of the coefficients.
struct HessianBound {
    /// For `sign` times f; the columns of the frame, in world coordinates, are n and two unit vectors perpendicular to
    /// it.
    template <int Degree>
    static HessianBound at(const CellCoefficients& cell, const glm::dvec3& local, double sign,
                           const LatticeMetric& metric, const glm::dmat3& frame)
    {
        constexpr int count = Degree + 1;
        std::array<double, count * count * count> c;
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j)
                for (int i = 0; i < count; ++i)
                    c[static_cast<std::size_t>(i + count * (j + count * k))] = static_cast<double>(cell.row(j, k)[i]);
        constexpr int strides[3] = {1, count, count * count};
        HessianBound bound;
        const glm::dmat3 to_lattice = metric.to_lattice * frame;
        bound.hessian = sign * (glm::transpose(to_lattice) * jet_in_cell<Degree>(cell, local).hessian * to_lattice);
        for (int a = 0; a < 3; ++a)
            for (int b = a; b < 3; ++b)
                for (int d = b; d < 3; ++d) {
                    glm::ivec3 counts(count);
                    for (const int axis : {a, b, d})
                        counts[axis] -= 1;
                    const int x = strides[a], y = strides[b], z = strides[d];
                    double largest = 0.0;
                    for (int k = 0; k < counts.z; ++k)
                        for (int j = 0; j < counts.y; ++j)
                            for (int i = 0; i < counts.x; ++i) {
                                const double* const p = c.data() + i + count * (j + count * k);
                                const double difference =
                                    (p[x + y + z] - p[x + y] - p[x + z] + p[x]) - (p[y + z] - p[y] - p[z] + p[0]);
                                largest = std::max(largest, std::abs(difference));
                            }
                    bound.third[a][b][d] = bound.third[a][d][b] = bound.third[b][a][d] = bound.third[b][d][a] =
                        bound.third[d][a][b] = bound.third[d][b][a] = largest;
                }
        return bound;
    }

    /// The bound where coordinates differ from the point's by at most `reach`.
    Bend bend(const glm::dvec3& reach, const LatticeMetric& metric) const
    {
        // A matrix with entries of at most those of `change` adds at most the largest row sum, in the world.
        glm::dmat3 change(0.0);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
                change[a][b] = third[a][b][0] * reach.x + third[a][b][1] * reach.y + third[a][b][2] * reach.z;
        const glm::dmat3& map = metric.to_lattice;
        const glm::dmat3 absolute(glm::abs(map[0]), glm::abs(map[1]), glm::abs(map[2]));
        const glm::dvec3 row_sums = glm::transpose(absolute) * (change * (absolute * glm::dvec3(1.0)));
        const double spread = std::max({row_sums.x, row_sums.y, row_sums.z});
        const double largest =
            0.5 * (hessian[1][1] + hessian[2][2]) + std::hypot(0.5 * (hessian[1][1] - hessian[2][2]), hessian[1][2]);
        return {largest + spread, std::hypot(hessian[0][1], hessian[0][2]) + spread, hessian[0][0] + spread};
    }

    glm::dmat3 hessian;                                        ///< in the frame
    std::array<std::array<std::array<double, 3>, 3>, 3> third; ///< bounds on third derivatives, in local coordinates
};

/// A proof for one point at a time, by bounds on second derivatives of f.
template <int Degree>
class FootProof {
public:
    FootProof(const IsosurfaceSnapshot& surface, const LatticeMetric& metric) : surface_(surface), metric_(metric) {}

    /// Forgets the foot; without a foot nothing is proven.
    void clear() { foot_.reset(); }

    /// Starts the proof for a point in lattice space and its foot.
    void begin(const glm::dvec3& point, const Foot& foot)
    {
        point_ = point;
        foot_ = foot;
        const glm::dvec3 foot_lattice = glm::dvec3(foot.cell) + foot.local;
        slope_ = glm::length(foot.gradient_world);
        is_above_ = glm::dot(foot.gradient_world, metric_.to_world * (point - foot_lattice)) > 0.0;
        const Frame frame((is_above_ ? 1.0 : -1.0) / slope_ * foot.gradient_world);
        frame_ = {frame.z, frame.x, frame.y};
        has_bend_.fill(false);
    }

    /// Whether the foot is proven to be the nearest point of the whole surface.
    bool is_nearest()
    {
        // All cells that the ball around the point touches.
        const double distance = foot_->distance * (1.0 + 1e-9);
        glm::dvec3 reach;
        for (int axis = 0; axis < 3; ++axis)
            reach[axis] = distance * glm::length(glm::dvec3(metric_.to_lattice[0][axis], metric_.to_lattice[1][axis],
                                                            metric_.to_lattice[2][axis]));
        if (glm::any(glm::greaterThan(reach, glm::dvec3(reach_of_foot))))
            return false;
        const glm::ivec3 end = surface_.volume().cell_shape() - 1;
        const glm::ivec3 first = glm::clamp(glm::ivec3(glm::floor(point_ - reach)), glm::ivec3(0), end);
        const glm::ivec3 last = glm::clamp(glm::ivec3(glm::floor(point_ + reach)), glm::ivec3(0), end);
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x) {
                    const glm::dvec3 lower(x, y, z);
                    if (metric_.distance_bound(point_, {lower, lower + 1.0}) <= distance &&
                        !is_flat({x, y, z}, 2.0 * distance, distance, 2.0 * reach))
                        return false;
                }
        return true;
    }

    /// Whether a box of a cell is proven to contain no point of the surface that is nearer than the foot.
    bool clears(const glm::ivec3& cell, const glm::dvec3& lower, const glm::dvec3& size)
    {
        if (!foot_ || bend_in(cell) == nullptr)
            return false;
        const glm::dvec3 to_middle =
            metric_.to_world * (glm::dvec3(cell - foot_->cell) + lower + 0.5 * size - foot_->local);
        const glm::dvec3 half = 0.5 * size;
        double radius = 0.0, along = glm::dot(frame_[0], to_middle);
        for (int axis = 0; axis < 3; ++axis) {
            radius += half[axis] * glm::length(metric_.to_world[axis]);
            along += half[axis] * std::abs(glm::dot(frame_[0], metric_.to_world[axis]));
        }
        if (along <= 0.0) // on the other side of the tangent plane
            return true;
        const double across = glm::length(to_middle) + radius;
        const glm::dvec3 from_foot = glm::dvec3(cell - foot_->cell) + lower - foot_->local;
        const glm::dvec3 reach = glm::max(glm::abs(from_foot), glm::abs(from_foot + size));
        const glm::ivec3 first = glm::min(cell, foot_->cell), last = glm::max(cell, foot_->cell);
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    if (!is_flat({x, y, z}, along, across, reach))
                        return false;
        return true;
    }

private:
    /// The number of cells around the foot's cell that are examined.
    static constexpr int reach_of_foot = 3;

    /// The bound on second derivatives of f in a cell; null in cells far from the foot. The sign of f is that of the
    /// point's side of the surface at the foot.
    const HessianBound* bend_in(const glm::ivec3& cell)
    {
        const glm::ivec3 from_foot = cell - foot_->cell;
        if (glm::any(glm::greaterThan(glm::abs(from_foot), glm::ivec3(reach_of_foot))) ||
            (Degree == 1 && from_foot != glm::ivec3(0)))
            return nullptr;
        constexpr int count = 2 * reach_of_foot + 1;
        const glm::ivec3 place = from_foot + reach_of_foot;
        const auto item = static_cast<std::size_t>(place.x + count * (place.y + count * place.z));
        if (!has_bend_[item]) {
            has_bend_[item] = true;
            const glm::dvec3 nearest_in_cell =
                glm::clamp(foot_->local - glm::dvec3(from_foot), glm::dvec3(0.0), glm::dvec3(1.0));
            bends_[item] = HessianBound::at<Degree>(VolumeCell(surface_.volume(), surface_.threshold(), cell),
                                                    nearest_in_cell, is_above_ ? -1.0 : 1.0, metric_, frame_);
        }
        return &bends_[item];
    }

    /// Whether the second derivatives in a cell are so small that it contains no part of the surface nearer than the
    /// foot, given that they are as small in all cells between. Only points are considered that are at most `along`
    /// from the foot in the direction to the point, `across` from that line, and `reach` along the axes of the lattice.
    ///
    /// Let g be the gradient at the foot q, d the distance, and n the direction to the point. A nearer point
    /// q + v_t + v_n n has v_n > 0 and |v_t|^2 < 2 d v_n - v_n^2. By Taylor's theorem, f there, with the sign of the
    /// point's side, is at least |g| v_n - (t |v_t|^2 + 2 m |v_t| v_n + b v_n^2) / 2, where t >= 0, m and b are the
    /// tangential, mixed and normal bounds. That is more than v_n (|g| - t d - m |v_t| - (b - t) v_n / 2). The gradient
    /// must be continuous: at degree 1 it is continuous only within a cell.
    bool is_flat(const glm::ivec3& cell, double along, double across, const glm::dvec3& reach)
    {
        const HessianBound* const bound = bend_in(cell);
        if (bound == nullptr)
            return false;
        const Bend bend = bound->bend(glm::min(reach, glm::dvec3(1.0)), metric_);
        const double tangential = std::max(bend.tangential, 0.0);
        return tangential * foot_->distance + bend.mixed * std::min(across, foot_->distance) +
                   std::max(bend.normal - tangential, 0.0) * std::min(0.5 * along, foot_->distance) <=
               slope_;
    }

    const IsosurfaceSnapshot& surface_;
    const LatticeMetric& metric_;
    glm::dvec3 point_{0.0};
    std::optional<Foot> foot_;
    double slope_ = 0.0;    ///< length of the gradient at the foot
    bool is_above_ = false; ///< whether f increases from there to the point
    glm::dmat3 frame_{1.0}; ///< the direction to the point, and two perpendicular to it
    static constexpr int bend_count = (2 * reach_of_foot + 1) * (2 * reach_of_foot + 1) * (2 * reach_of_foot + 1);
    std::array<HessianBound, bend_count> bends_; ///< for the cells around the foot's cell, where has_bend_ is set
    std::array<bool, bend_count> has_bend_{};
};

} // namespace isospline
