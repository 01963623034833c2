// Polynomials over a face of a box: a polynomial of the box restricted to its faces or to planes, and planes
// themselves.
#pragma once

#include "isospline/math/bernstein_box.h"
#include "isospline/math/half_space.h"
#include "isospline/measure/polynomial.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace isospline {

/// The coordinates of the face across an axis: the other two axes, ascending.
constexpr int first_of_face(int axis)
{
    return axis == 0 ? 1 : 0;
}
constexpr int second_of_face(int axis)
{
    return axis == 2 ? 1 : 2;
}

inline glm::dvec3 point_of_face(int axis, const glm::dvec2& on_face, double height)
{
    glm::dvec3 point;
    point[first_of_face(axis)] = on_face.x;
    point[second_of_face(axis)] = on_face.y;
    point[axis] = height;
    return point;
}

/// The item of b at `i` along the first coordinate of the face, `j` along the second, and `k` along the axis.
template <int Degree>
constexpr std::size_t item_over_face(int axis, int i, int j, int k)
{
    return axis == 0   ? bernstein_item<Degree>(k, i, j)
           : axis == 1 ? bernstein_item<Degree>(i, k, j)
                       : bernstein_item<Degree>(i, j, k);
}

/// The polynomial on the lower or the upper face.
template <int Degree>
PatchPolynomial face_of(const BernsteinBox<Degree>& b, int axis, bool upper)
{
    PatchPolynomial face{{Degree, Degree}, {}};
    for (int j = 0; j <= Degree; ++j)
        for (int i = 0; i <= Degree; ++i)
            face.item(i, j) = b[item_over_face<Degree>(axis, i, j, upper ? Degree : 0)];
    return face;
}

/// The polynomial along an axis, over a point of the face.
template <int Degree>
LinePolynomial line_along(const BernsteinBox<Degree>& b, int axis, double x, double y)
{
    const auto of_x = bernstein_values<Degree>(x), of_y = bernstein_values<Degree>(y);
    LinePolynomial line{Degree, {}};
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                line.b[k] += of_x[i] * of_y[j] * b[item_over_face<Degree>(axis, i, j, k)];
    return line;
}

/// A polynomial where one coordinate of the face is fixed.
template <int Degree>
struct FaceRow {
    static constexpr std::size_t count = Degree + 1;
    using Coefficients = std::array<std::array<double, count>, count>; ///< by the other coordinate, and the axis

    FaceRow() = default;
    FaceRow(const BernsteinBox<Degree>& b, int axis, int fixed_coordinate, double s) : fixed(fixed_coordinate)
    {
        const auto of_s = bernstein_values<Degree>(s), slopes_of_s = bernstein_slopes<Degree>(s);
        for (int i = 0; i <= Degree; ++i)
            for (int j = 0; j <= Degree; ++j)
                for (int k = 0; k <= Degree; ++k) {
                    const double item =
                        b[fixed == 0 ? item_over_face<Degree>(axis, j, i, k) : item_over_face<Degree>(axis, i, j, k)];
                    values[i][k] += of_s[j] * item;
                    slopes[i][k] += slopes_of_s[j] * item;
                }
    }

    /// The polynomial along the axis.
    LinePolynomial line(const glm::dvec2& on_face) const
    {
        const auto weights = bernstein_values<Degree>(on_face[1 - fixed]);
        LinePolynomial line{Degree, {}};
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < count; ++k)
                line.b[k] += weights[i] * values[i][k];
        return line;
    }

    /// The derivatives by the coordinates of the face and by the height.
    glm::dvec3 gradient(const glm::dvec2& on_face, double height) const
    {
        const double x = on_face[1 - fixed];
        const auto weights = bernstein_values<Degree>(x), slopes_of_x = bernstein_slopes<Degree>(x),
                   of_height = bernstein_values<Degree>(height), slopes_of_height = bernstein_slopes<Degree>(height);
        glm::dvec3 found(0.0);
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < count; ++k) {
                found[fixed] += weights[i] * of_height[k] * slopes[i][k];
                found[1 - fixed] += slopes_of_x[i] * of_height[k] * values[i][k];
                found[2] += weights[i] * slopes_of_height[k] * values[i][k];
            }
        return found;
    }

    int fixed = 0;
    Coefficients values{}, slopes{}; ///< slopes: derivatives by the fixed coordinate
};

/// a + b x + c y.
inline PatchPolynomial linear_patch(double constant, double along_x, double along_y)
{
    PatchPolynomial patch{{1, 1}, {}};
    for (int j = 0; j <= 1; ++j)
        for (int i = 0; i <= 1; ++i)
            patch.item(i, j) = constant + i * along_x + j * along_y;
    return patch;
}

/// The axis that is nearest to a plane's normal.
inline int steepest_axis(const HalfSpace& plane)
{
    const glm::dvec3 normal = glm::abs(plane.normal);
    return normal.x >= normal.y && normal.x >= normal.z ? 0 : normal.y >= normal.z ? 1 : 2;
}

/// The point of a plane over a point of the face.
inline glm::dvec3 point_on_plane(const HalfSpace& plane, int axis, const glm::dvec2& on_face)
{
    glm::dvec3 point = point_of_face(axis, on_face, 0.0);
    point[axis] = (plane.offset - glm::dot(plane.normal, point)) / plane.normal[axis];
    return point;
}

/// Whether a point is in all half-spaces but one, or in all for -1.
inline bool is_within(const std::vector<HalfSpace>& half_spaces, int but, const glm::dvec3& point)
{
    for (int i = 0; i < static_cast<int>(half_spaces.size()); ++i) {
        const HalfSpace& plane = half_spaces[static_cast<std::size_t>(i)];
        if (i != but && glm::dot(plane.normal, point) < plane.offset)
            return false;
    }
    return true;
}

inline bool is_in_cube(const glm::dvec3& point)
{
    return glm::all(glm::greaterThanEqual(point, glm::dvec3(0.0))) &&
           glm::all(glm::lessThanEqual(point, glm::dvec3(1.0)));
}

/// <normal, x> - offset at one height.
inline PatchPolynomial plane_on_face(const HalfSpace& plane, int axis, double height)
{
    return linear_patch(plane.normal[axis] * height - plane.offset, plane.normal[first_of_face(axis)],
                        plane.normal[second_of_face(axis)]);
}

/// Zero below the line where two planes meet.
inline PatchPolynomial plane_on_plane(const HalfSpace& a, const HalfSpace& b, int axis)
{
    const auto difference = [&](double of_a, double of_b) { return of_a * b.normal[axis] - of_b * a.normal[axis]; };
    const int first = first_of_face(axis), second = second_of_face(axis);
    return linear_patch(-difference(a.offset, b.offset), difference(a.normal[first], b.normal[first]),
                        difference(a.normal[second], b.normal[second]));
}

/// Whether a plane is so far from parallel to the axis that a polynomial can be followed along it.
inline bool is_section_sound(const HalfSpace& plane, int axis)
{
    const glm::dvec3 normal = glm::abs(plane.normal);
    return normal[axis] >= 0.02 * std::max({normal.x, normal.y, normal.z});
}

/// The matrix from values at Chebyshev-Lobatto nodes to Bernstein coefficients.
template <int Degree>
struct BernsteinInterpolation {
    static constexpr int count = Degree + 1;

    BernsteinInterpolation()
    {
        // The inverse of the matrix of Bernstein polynomials at the nodes, by Gauss-Jordan elimination.
        std::array<std::array<double, 2 * count>, count> rows{};
        for (int i = 0; i < count; ++i) {
            nodes[i] = 0.5 - 0.5 * std::cos(std::numbers::pi * i / Degree);
            const auto values = bernstein_values<Degree>(nodes[i]);
            std::copy(values.begin(), values.end(), rows[i].begin());
            rows[i][count + i] = 1.0;
        }
        for (int column = 0; column < count; ++column) {
            int pivot = column;
            for (int i = column; i < count; ++i)
                if (std::abs(rows[i][column]) > std::abs(rows[pivot][column]))
                    pivot = i;
            std::swap(rows[pivot], rows[column]);
            const double scale = 1.0 / rows[column][column];
            for (double& number : rows[column])
                number *= scale;
            for (int i = 0; i < count; ++i) {
                const double factor = i == column ? 0.0 : rows[i][column];
                for (int j = 0; j < 2 * count; ++j)
                    rows[i][j] -= factor * rows[column][j];
            }
        }
        for (int i = 0; i < count; ++i)
            std::copy_n(rows[i].begin() + count, count, inverse[i].begin());
    }

    std::array<double, count> nodes;
    std::array<std::array<double, count>, count> inverse;
};

/// A polynomial on a plane, as a polynomial over the face. Height is linear in both coordinates, so the degree is 2 n
/// along each.
template <int Degree>
PatchPolynomial section(const BernsteinBox<Degree>& b, const HalfSpace& plane, int axis)
{
    static const BernsteinInterpolation<2 * Degree> interpolation;
    constexpr int count = 2 * Degree + 1;
    const double slope = plane.normal[axis];
    std::array<std::array<double, count>, count> values{}; // by y, then x; then of coefficients along x
    for (int j = 0; j < count; ++j) {
        std::array<double, count> row;
        for (int i = 0; i < count; ++i) {
            const double x = interpolation.nodes[i], y = interpolation.nodes[j];
            const double height =
                (plane.offset - plane.normal[first_of_face(axis)] * x - plane.normal[second_of_face(axis)] * y) / slope;
            row[i] = line_along<Degree>(b, axis, x, y).value(height);
        }
        for (int i = 0; i < count; ++i)
            for (int from = 0; from < count; ++from)
                values[j][i] += interpolation.inverse[i][from] * row[from];
    }
    PatchPolynomial patch{{2 * Degree, 2 * Degree}, {}};
    for (int j = 0; j < count; ++j)
        for (int i = 0; i < count; ++i)
            for (int from = 0; from < count; ++from)
                patch.item(i, j) += interpolation.inverse[j][from] * values[from][i];
    return patch;
}

} // namespace isospline
