// The model around a hit, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/bernstein_box.h"
#include "isospline/math/enclosure.h"
#include "isospline/spline/volume.h"
#include "isospline/trace/certified_line.h"
#include "isospline/trace/certified_polynomial.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace isospline::certified {

/// Directions within an angle, in radians, of a unit vector.
struct Cone {
    glm::dvec3 axis{0.0}; ///< zero if nothing is known
    double angle = std::numbers::pi;
    double least_length = 0.0; ///< of the part of any of the vectors along the axis
};

/// The directions of all vectors with these coordinates.
inline Cone cone_of(const std::array<Enclosure, 3>& vector)
{
    const glm::dvec3 middle(vector[0].value, vector[1].value, vector[2].value);
    const double length = glm::length(middle);
    // The vectors are in a ball around the one in the middle, and the sine of the angle to a vector in a ball is at
    // most the ratio. asin(x) is below x + x^3 up to 1/2, and below pi / 2 x.
    const double radius = glm::length(glm::dvec3(vector[0].radius, vector[1].radius, vector[2].radius));
    const double sine = radius / length * (1.0 + 0x1p-48);
    if (!(sine < 1.0))
        return {};
    const double angle = sine < 0.5 ? sine + sine * sine * sine : 1.5708 * sine;
    return {middle / length, angle + 0x1p-50, (length - radius) * (1.0 - 0x1p-48)};
}

/// The points of a line between two t, in lattice space.
template <int Degree>
class PlaceOnSurface {
public:
    /// No partial derivative of f is larger than `slope`.
    PlaceOnSurface(const Volume& volume, double threshold, double slope, const Line& line, double t_lower,
                   double t_upper)
        : volume_(volume), threshold_(threshold), slope_(slope), middle_(line.at(0.5 * t_lower + 0.5 * t_upper)),
          radius_(line.error(std::max(std::abs(t_lower), std::abs(t_upper))))
    {
        for (const Enclosure& along : line.along)
            radius_ += (t_upper - t_lower) * (std::abs(along.value) + along.radius);
    }

    /// The largest distance of the points from the middle, summed over the axes.
    double radius() const { return radius_; }

    /// The gradient at all the points.
    std::array<Enclosure, 3> gradient() const
    {
        const glm::ivec3 first = cell_at(Degree == 1 ? middle_ - radius_ : middle_);
        const glm::ivec3 last = cell_at(Degree == 1 ? middle_ + radius_ : middle_); // it jumps between these cells
        glm::dvec3 lower(HUGE_VAL), upper(-HUGE_VAL);
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    add_gradient({x, y, z}, lower, upper);
        std::array<Enclosure, 3> result;
        for (int axis = 0; axis < 3; ++axis) {
            const double middle = 0.5 * lower[axis] + 0.5 * upper[axis];
            const double half = std::max(upper[axis] - middle, middle - lower[axis]);
            result[static_cast<std::size_t>(axis)] = {middle, half * (1.0 + 0x1p-50)};
        }
        return result;
    }

    /// Whether f is proven to be beyond the level by more than `least` at this distance from the middle on both sides,
    /// and on different sides of the level. To first order, f grows by at least `growth` towards one of them.
    bool changes_sides(const glm::dvec3& from_middle, double growth, double least) const
    {
        if constexpr (Degree == 1)
            return sign_at(middle_ + from_middle, least) * sign_at(middle_ - from_middle, least) < 0;
        const glm::dvec3 reach = glm::abs(from_middle);
        const double moved = reach.x + reach.y + reach.z;
        // f is the level within the radius; a gradient changes by at most 2 slope_ for each unit.
        const double error = least + slope_ * (radius_ + moved * moved);
        return is_inside(middle_ - reach) && is_inside(middle_ + reach) && growth > error * (1.0 + 0x1p-40);
    }

private:
    using Row = std::array<double, Degree + 1>;

    /// A point in a cell, or the nearest one of the cell.
    struct Corner {
        Corner(const PlaceOnSurface& place, const glm::ivec3& cell, const glm::dvec3& point)
        {
            std::array<float, 64> own; // coefficients of a volume that has none in memory
            const CoefficientView view = place.volume_.cell(cell, own.data());
            Row most{};
            for (int k = 0; k <= Degree; ++k)
                for (int j = 0; j <= Degree; ++j)
                    for (int i = 0; i <= Degree; ++i) {
                        const float each = view.first[i + j * view.row_stride + k * view.slice_stride];
                        double& number = numbers[static_cast<std::size_t>(k)][static_cast<std::size_t>(j)]
                                                [static_cast<std::size_t>(i)];
                        number = static_cast<double>(each) - place.threshold_;
                        double& largest = most[static_cast<std::size_t>(i)];
                        largest = std::abs(number) > largest ? std::abs(number) : largest;
                    }
            magnitude = *std::max_element(most.begin(), most.end());
            const glm::dvec3 local = point - glm::dvec3(cell), inside = glm::clamp(local, 0.0, 1.0);
            const glm::dvec3 off = glm::abs(local - inside);
            beside = off.x + off.y + off.z;
            for (int axis = 0; axis < 3; ++axis) {
                const auto at = static_cast<std::size_t>(axis);
                values[at] = polar_weights<Degree>(inside[axis], inside[axis], 0);
                const auto lower = polar_weights<Degree - 1>(inside[axis], inside[axis], 0);
                slopes[at] = {};
                for (std::size_t i = 0; i < Degree; ++i) { // the weights of c_(i+1) - c_i
                    slopes[at][i] -= lower[i];
                    slopes[at][i + 1] += lower[i];
                }
            }
        }

        /// f - threshold, and its derivatives.
        double value() const { return sums()[0]; }
        glm::dvec3 gradient() const
        {
            const std::array<double, 4> all = sums();
            return {all[1], all[2], all[3]};
        }

        std::array<double, 4> sums() const
        {
            std::array<double, 4> total{};
            for (std::size_t k = 0; k <= Degree; ++k) {
                double value = 0.0, along_x = 0.0, along_y = 0.0;
                for (std::size_t j = 0; j <= Degree; ++j) {
                    double of_row = 0.0, slope_of_row = 0.0;
                    for (std::size_t i = 0; i <= Degree; ++i) {
                        of_row += values[0][i] * numbers[k][j][i];
                        slope_of_row += slopes[0][i] * numbers[k][j][i];
                    }
                    value += values[1][j] * of_row;
                    along_x += values[1][j] * slope_of_row;
                    along_y += slopes[1][j] * of_row;
                }
                total[0] += values[2][k] * value;
                total[1] += values[2][k] * along_x;
                total[2] += values[2][k] * along_y;
                total[3] += slopes[2][k] * value;
            }
            return total;
        }

        std::array<std::array<Row, Degree + 1>, Degree + 1> numbers; ///< coefficients minus the threshold
        double magnitude = 0.0;                                      ///< of the largest of them
        std::array<Row, 3> values, slopes;                           ///< weights in f and in its derivatives
        double beside = 0.0;                                         ///< distance of the point from the cell
    };

    glm::ivec3 cell_at(const glm::dvec3& point) const
    {
        return glm::ivec3(glm::clamp(point, glm::dvec3(0.0), glm::dvec3(volume_.cell_shape() - 1)));
    }

    bool is_inside(const glm::dvec3& point) const
    {
        return glm::clamp(point, glm::dvec3(0.0), glm::dvec3(volume_.cell_shape())) == point;
    }

    /// The proven sign of f - level at a point, by more than `least`; 0 if there is none.
    int sign_at(const glm::dvec3& point, double least) const
    {
        const Corner corner(*this, cell_at(point), point);
        const double error = (least + polynomial_error(corner.magnitude)) * (1.0 + 0x1p-40);
        return is_inside(point) ? proven_sign(corner.value(), error) : 0;
    }

    /// Widens bounds so that they contain the gradient in a cell. No second derivative is larger than a difference of
    /// differences of coefficients, 2 slope.
    void add_gradient(const glm::ivec3& cell, glm::dvec3& lower, glm::dvec3& upper) const
    {
        const Corner corner(*this, cell, middle_);
        const glm::dvec3 gradient = corner.gradient();
        // The absolute values of the weights of a derivative sum to at most 2. The points are in this cell alone if it
        // is larger than their distance; then its coefficients bound the second derivatives.
        const glm::dvec3 local = middle_ - glm::dvec3(cell), room = glm::min(local, 1.0 - local);
        const bool is_alone = Degree == 1 || std::min(std::min(room.x, room.y), room.z) > radius_;
        const double bend = is_alone ? std::min(2.0 * slope_, 4.0 * corner.magnitude) : 2.0 * slope_;
        const double error =
            (bend * (radius_ + corner.beside) + 2.0 * polynomial_error(corner.magnitude)) * (1.0 + 0x1p-40);
        lower = glm::min(lower, gradient - error);
        upper = glm::max(upper, gradient + error);
    }

    const Volume& volume_;
    double threshold_, slope_;
    glm::dvec3 middle_;
    double radius_;
};

} // namespace isospline::certified
