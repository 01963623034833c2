#include "isospline/measure/measure_gradient.h"

#include "isospline/cell/jet.h"
#include "isospline/math/grid.h"
#include "isospline/measure/cell_quadrature.h"
#include "isospline/spline/degree.h"
#include "isospline/spline/line_filter.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace isospline {

namespace {

/// Bricks whose sums are kept at the same time.
constexpr std::size_t bricks_at_a_time = 1024;

/// The sums of a brick: one for each coefficient that influences one of its cells.
struct BrickSums {
    static constexpr int most = brick_size + 3;

    std::array<double, static_cast<std::size_t>(most* most* most)> by_coefficient{};
    bool is_empty = true;

    double& at(int x, int y, int z) { return by_coefficient[static_cast<std::size_t>(x + most * (y + most * z))]; }
};

/// Adds up the derivatives of the cells of bricks. One thread at a time.
template <int Degree>
class BrickGradient {
public:
    BrickGradient(const Solid& solid, const MeasureWeights& weights, int order)
        : solid_(solid), weights_(weights), to_lattice_(glm::inverse(glm::dmat3(solid.volume.lattice_to_world()))),
          quadrature_(Degree, {order, true, false, solid.volume.lattice_to_world(), false})
    {
    }

    void operator()(const Brick& brick, BrickSums& sums)
    {
        sums_ = &sums;
        for_each_cell(solid_.cells.cells(brick), [&](int x, int y, int z) { add_cell(brick, {x, y, z}); });
    }

private:
    /// A plane that ends the surface in a cell.
    struct End {
        glm::dvec3 outward; ///< unit normal in world space
        bool has_caps;
    };

    void add_cell(const Brick& brick, const glm::ivec3& in_brick)
    {
        const glm::ivec3 at = brick.first + in_brick;
        const VolumeCell cell(solid_.volume, solid_.threshold, at);
        if (!may_cross(cell) || !find_planes(at))
            return;
        // Nodes of the surface, and of its ends, do not depend on the side: see CellQuadrature on faces.
        quadrature_.integrate(cell, 1.0, planes_, [&](const glm::dvec3& local, double area) {
            const Jet jet = jet_in_cell<Degree>(cell, local);
            const glm::dvec3 gradient = jet.gradient * to_lattice_;
            const double steepness = glm::length(gradient);
            double weight = solid_.sign * weights_.volume;
            if (weights_.area != 0.0) { // the surface moves by -B / |gradient|: its area by twice the mean curvature
                const glm::dmat3 hessian = glm::transpose(to_lattice_) * jet.hessian * to_lattice_;
                const glm::dvec3 normal = gradient / steepness;
                const double trace = hessian[0][0] + hessian[1][1] + hessian[2][2];
                weight -= weights_.area * (trace - glm::dot(normal, hessian * normal)) / steepness;
            }
            add(in_brick, local, weight * area / steepness);
        });
        if (weights_.area == 0.0)
            return;
        for (std::size_t i = 0; i < planes_.size(); ++i)
            quadrature_.integrate_cap(cell, 1.0, planes_, i, [&](const glm::dvec3& local, double length) {
                const glm::dvec3 gradient = jet_in_cell<Degree>(cell, local).gradient * to_lattice_;
                const double cosine = glm::dot(glm::normalize(gradient), ends_[i].outward);
                add(in_brick, local, weights_.area * length * (cosine + (ends_[i].has_caps ? solid_.sign : 0.0)));
            });
    }

    /// Finds the planes that cut a cell or end the surface on one of its faces. False if nothing of it is left.
    bool find_planes(const glm::ivec3& at)
    {
        planes_.clear();
        ends_.clear();
        const Box box{glm::dvec3(at), glm::dvec3(at) + 1.0};
        const std::vector<HalfSpace>& all = solid_.planes.all();
        const auto add = [&](const HalfSpace& plane, bool has_caps) {
            if (std::find(planes_.begin(), planes_.end(), plane) != planes_.end())
                return;
            planes_.push_back(plane);
            ends_.push_back({-glm::normalize(plane.normal * to_lattice_), has_caps});
        };
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (is_outside(box, all[i]))
                return false;
            if (!is_inside(box, all[i]))
                add(all[i], solid_.planes.caps_have_area(i));
        }
        if (weights_.area == 0.0)
            return true;
        for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) {
                glm::ivec3 next = at;
                next[axis] += step;
                if (next[axis] >= 0 && next[axis] < solid_.volume.cell_shape()[axis] && solid_.cells.contains(next))
                    continue;
                HalfSpace face{glm::dvec3(0.0), step < 0 ? at[axis] : -(at[axis] + 1.0)};
                face.normal[axis] = -step;
                add(face, false);
            }
        return true;
    }

    bool may_cross(const CellCoefficients& cell) const
    {
        bool has_above = false, has_below = false;
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int i = 0; i <= Degree; ++i) {
                    has_above |= cell(i, j, k) >= 0.0;
                    has_below |= cell(i, j, k) <= 0.0;
                }
        return has_above && has_below;
    }

    /// Adds a weight times each B-spline at a point.
    void add(const glm::ivec3& cell, const glm::dvec3& local, double weight)
    {
        if (!std::isfinite(weight))
            return; // the gradient is zero: a point without a neighbourhood of other such points
        const auto x = scalar::cell_basis<Degree>(local.x), y = scalar::cell_basis<Degree>(local.y),
                   z = scalar::cell_basis<Degree>(local.z);
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int i = 0; i <= Degree; ++i)
                    sums_->at(cell.x + i, cell.y + j, cell.z + k) += weight * x.values[i] * y.values[j] * z.values[k];
        sums_->is_empty = false;
    }

    const Solid& solid_;
    MeasureWeights weights_;
    glm::dmat3 to_lattice_;
    CellQuadrature quadrature_;
    std::vector<HalfSpace> planes_; ///< of a cell
    std::vector<End> ends_;         ///< of each of them
    BrickSums* sums_ = nullptr;
};

/// Adds the sums of a brick to the gradient.
void add_sums(BrickSums& sums, const Brick& brick, const Volume& volume, MeasureGradient& to)
{
    const glm::ivec3 count = brick.size + volume.degree(), first = brick.first - volume.degree() / 2;
    const auto inside = [&](int axis, int i) {
        return detail::inside_index(first[axis] + i, volume.shape()[axis], volume.boundary());
    };
    const bool has_coefficients = !to.by_coefficients.empty();
    for (int z = 0; z < count.z; ++z)
        for (int y = 0; y < count.y; ++y)
            for (int x = 0; x < count.x; ++x) {
                const double sum = sums.at(x, y, z);
                if (has_coefficients)
                    to.by_coefficients[place_in(volume.shape(), {inside(0, x), inside(1, y), inside(2, z)})] += sum;
                to.by_level -= sum; // the level does what all coefficients do together, the other way
            }
}

} // namespace

MeasureGradient measure_gradient(const Solid& solid, const MeasureWeights& weights, int order, bool coefficients,
                                 const Progress& progress)
{
    if (order < 2 || order > 10)
        throw_invalid("order", "2 to 10", order);
    if (weights.area != 0.0 && solid.volume.degree() < 2)
        throw_invalid("degree", "2 or 3 of a volume for the derivative of an area: surfaces of degree 1 have creases",
                      solid.volume.degree());
    std::vector<Brick> bricks;
    for_each_brick(solid, [&](const Brick& brick, Side side) {
        if (side == Side::unknown)
            bricks.push_back(brick);
    });
    MeasureGradient result;
    const glm::dvec3 shape(solid.volume.shape());
    if (coefficients)
        result.by_coefficients.resize(static_cast<std::size_t>(shape.x * shape.y * shape.z));
    std::vector<BrickSums> sums;
    for (std::size_t begin = 0; begin < bricks.size(); begin += bricks_at_a_time) {
        const std::size_t end = std::min(begin + bricks_at_a_time, bricks.size());
        const auto total = static_cast<double>(bricks.size());
        sums.assign(end - begin, BrickSums());
        parallel_for(
            end - begin, 8,
            [&](std::size_t first, std::size_t last) {
                dispatch_degree(solid.volume.degree(), [&](auto degree) {
                    BrickGradient<degree> gradient(solid, weights, order);
                    for (std::size_t i = first; i < last; ++i)
                        gradient(bricks[begin + i], sums[i]);
                });
            },
            part_of(progress, static_cast<double>(begin) / total, static_cast<double>(end) / total));
        for (std::size_t i = begin; i < end; ++i) // in this order, for any number of threads
            if (!sums[i - begin].is_empty)
                add_sums(sums[i - begin], bricks[i], solid.volume, result);
    }
    return result;
}

} // namespace isospline
