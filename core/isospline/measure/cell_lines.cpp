#include "isospline/measure/cell_lines.h"

#include "isospline/cell/jet.h"
#include "isospline/math/bernstein_box.h"
#include "isospline/math/random.h"
#include "isospline/measure/brick_solid.h"
#include "isospline/measure/line_lanes.h"
#include "isospline/measure/plane_section.h"
#include "isospline/measure/polynomial.h"
#include "isospline/spline/curvature.h"
#include "isospline/spline/degree.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace isospline {

namespace {

/// sqrt(7/4): one of 2 x 2 columns of cells has a pair of lattices. Half of the square of their difference estimates
/// the variance v of one of them; that of their mean is v / 2, and that of each of the other three columns v.
constexpr double deviation_of_pair = 1.3228756555322954;
/// Where a coefficient is smaller than this part of the largest one, its sign might be lost in single precision.
constexpr double least_in_lanes = 1e-18;

/// The shifts of the lines along an axis through the cells at a place of the plane across it, as if at random.
struct Shifts {
    int x = -1, y = -1; ///< the place
    std::array<double, 2> first, second;
    bool is_pair; ///< whether the second one is wanted: in one of 2 x 2 places
};

Shifts shifts_of(int axis, int x, int y)
{
    const auto words = [axis](int i, int j, std::uint32_t kind) {
        return pcg4d(
            {static_cast<std::uint32_t>(axis), static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), kind});
    };
    const auto at_place = words(x, y, 0);
    const auto chosen = static_cast<int>(words(x / 2, y / 2, 1)[0] >> 30);
    return {x,
            y,
            {to_unit_interval(at_place[0]), to_unit_interval(at_place[1])},
            {to_unit_interval(at_place[2]), to_unit_interval(at_place[3])},
            chosen == x % 2 + 2 * (y % 2)};
}

/// Remembers the shifts in the columns of a brick, most of which are wanted several times.
class KnownShifts {
public:
    const Shifts& at(int axis, int x, int y)
    {
        constexpr int size = 8;
        Shifts& known = known_[static_cast<std::size_t>((axis * size + x % size) * size + y % size)];
        if (known.x != x || known.y != y)
            known = shifts_of(axis, x, y);
        return known;
    }

private:
    std::array<Shifts, 192> known_;
};

} // namespace

struct CellLines::Method {
    virtual ~Method() = default;
    virtual bool add(const CellCoefficients& cell, const glm::ivec3& place, double sign, LineSums& to) = 0;
};

template <int Degree>
struct CellLines::MethodOfDegree final : Method {
    static constexpr std::size_t count = Degree + 1;
    using Line = std::array<double, count>;
    /// Coefficients by the first coordinate of the face across the axis, the second one, and the axis.
    using Oriented = std::array<std::array<Line, count>, count>;

    /// A node along one coordinate.
    struct Node {
        double position;
        Line values, slopes; ///< of the Bernstein polynomials there
    };

    static Node node_at(double position)
    {
        return {position, bernstein_values<Degree>(position), bernstein_slopes<Degree>(position)};
    }

    explicit MethodOfDegree(const QuadratureOptions& given)
        : options(given), to_lattice(glm::inverse(given.lattice_to_world)),
          determinant(std::abs(glm::determinant(given.lattice_to_world)))
    {
        const glm::dmat3 metric = to_lattice * glm::transpose(to_lattice);
        const double largest = std::max({metric[0][0], metric[1][1], metric[2][2]});
        unit_of_metrics = std::sqrt(largest);
        for (int axis = 0; axis < 3; ++axis) {
            const int order[3] = {first_of_face(axis), second_of_face(axis), axis};
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    metrics[axis][i][j] = static_cast<float>(metric[order[i]][order[j]] / largest);
        }
    }

    bool add(const CellCoefficients& cell, const glm::ivec3& place, double sign, LineSums& to) override
    {
        BernsteinBox<Degree> b = bernstein_of<Degree>(cell);
        double smallest = std::abs(b[0]);
        for (const double each : b)
            smallest = std::min(smallest, std::abs(each));
        if (smallest == 0.0)
            return false;
        for (double& each : b)
            each *= sign;
        const auto [least, most] = extremes_of(b);
        if (most < 0.0)
            return true;
        if (least > 0.0) {
            to.value[index_of(Quantity::volume)] += determinant;
            to.magnitude[index_of(Quantity::volume)] += determinant;
            return true;
        }
        ++to.cells;
        const int steepest = steepest_axis(b);
        const double largest = std::max(most, -least);
        const bool in_lanes = has_lanes(Degree, options.curvature) && smallest > least_in_lanes * largest;
        const double unit = in_lanes ? std::ldexp(1.0, -std::ilogb(largest)) : 1.0;
        for (int axis = 0; axis < 3; ++axis)
            if (axis == steepest || options.surface) {
                const int x = place[first_of_face(axis)], y = place[second_of_face(axis)];
                const Lines lines{cell, sign, axis, axis == steepest, in_lanes, unit, oriented(b, axis)};
                const Shifts& shifts = known_shifts.at(axis, x, y);
                const Means means = mean_over(lines, shifts.first);
                LineSums::Column& column = to.columns[LineSums::column(axis, x, y)];
                add_to(shifts.is_pair ? column.halves_of_pairs : column.halves_of_others, means.half);
                if (shifts.is_pair)
                    add_pair(means, mean_over(lines, shifts.second), column.deviation, to);
                else
                    add(means, 1.0, to);
            }
        return true;
    }

    /// The axis along which the coefficients change most.
    static int steepest_axis(const BernsteinBox<Degree>& b)
    {
        glm::dvec3 slope(0.0);
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                for (int axis = 0; axis < 3; ++axis)
                    slope[axis] +=
                        b[item_over_face<Degree>(axis, i, j, Degree)] - b[item_over_face<Degree>(axis, i, j, 0)];
        slope = glm::abs(slope);
        return slope.x >= slope.y && slope.x >= slope.z ? 0 : slope.y >= slope.z ? 1 : 2;
    }

    static Oriented oriented(const BernsteinBox<Degree>& b, int axis)
    {
        Oriented c;
        for (int i = 0; i <= Degree; ++i)
            for (int j = 0; j <= Degree; ++j)
                for (int k = 0; k <= Degree; ++k)
                    c[i][j][k] = b[item_over_face<Degree>(axis, i, j, k)];
        return c;
    }

    /// The lines along one axis in a cell.
    struct Lines {
        const CellCoefficients& cell;
        double sign;
        int axis;
        bool add_volume;
        bool in_lanes; ///< whether they are cut in SIMD lanes
        double unit;   ///< a power of two by which the largest coefficient then becomes about 1
        Oriented c;
    };

    /// The polynomial at a node's first coordinate, and its derivative along this coordinate.
    struct Plane {
        std::array<Line, count> values{}, slopes{};
    };

    using ByQuantity = std::array<double, quantity_count>;

    /// Means over lines, by quantity; `half` is the part of the first half of them less that of the second one.
    struct Means {
        ByQuantity value{}, magnitude{}, half{};

        void add(Quantity quantity, double number, std::size_t of_half)
        {
            value[index_of(quantity)] += number;
            magnitude[index_of(quantity)] += std::abs(number);
            half[index_of(quantity)] += of_half == 0 ? number : -number;
        }
    };

    static void add_to(ByQuantity& sums, const ByQuantity& numbers)
    {
        for (std::size_t i = 0; i < quantity_count; ++i)
            sums[i] += numbers[i];
    }

    static void add(const Means& means, double weight, LineSums& to)
    {
        for (std::size_t i = 0; i < quantity_count; ++i) {
            to.value[i] += weight * means.value[i];
            to.magnitude[i] += weight * means.magnitude[i];
        }
    }

    static void add_pair(const Means& first, const Means& second, ByQuantity& deviation, LineSums& to)
    {
        add(first, 0.5, to);
        add(second, 0.5, to);
        for (std::size_t i = 0; i < quantity_count; ++i)
            deviation[i] += deviation_of_pair * (first.value[i] - second.value[i]);
    }

    /// The means over the lines of a lattice with these shifts.
    Means mean_over(const Lines& lines, const std::array<double, 2>& shifts) const
    {
        const LineLattice lattice{options.order, shifts};
        if constexpr (Degree <= 2)
            if (lines.in_lanes)
                return mean_in_lanes(lines, lattice);
        const double row_weight = 1.0 / lattice.rows;
        Means means;
        for (int i = 0; i < lattice.rows; ++i) {
            const Node x = node_at(lattice.row(i));
            Plane plane;
            for (std::size_t of_x = 0; of_x < count; ++of_x)
                for (std::size_t j = 0; j < count; ++j)
                    for (std::size_t k = 0; k < count; ++k)
                        plane.values[j][k] += x.values[of_x] * lines.c[of_x][j][k];
            double least = plane.values[0][0], most = least;
            for (const Line& row : plane.values)
                for (const double each : row) {
                    least = each < least ? each : least;
                    most = each > most ? each : most;
                }
            if (least >= 0.0 && lines.add_volume)
                for (const std::size_t half : {0, 1})
                    means.add(Quantity::volume, 0.5 * determinant * row_weight, half);
            if (least >= 0.0 || most < 0.0)
                continue;
            if (options.surface)
                for (std::size_t of_x = 0; of_x < count; ++of_x)
                    for (std::size_t j = 0; j < count; ++j)
                        for (std::size_t k = 0; k < count; ++k)
                            plane.slopes[j][k] += x.slopes[of_x] * lines.c[of_x][j][k];
            const double shift = lattice.shift_of_row(i);
            for (int j = 0; j < LineLattice::group; ++j)
                add_line(lines, plane,
                         {x, node_at(LineLattice::line(j, shift)), row_weight / LineLattice::group,
                          LineSumsOverFace::half_of(static_cast<std::size_t>(j))},
                         means);
        }
        return means;
    }

    Means mean_in_lanes(const Lines& lines, const LineLattice& lattice) const
    {
        LinesOverFace face{Degree, {}, metrics[lines.axis], lines.add_volume, options.surface};
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = 0; j < count; ++j)
                for (std::size_t k = 0; k < count; ++k)
                    face.c[i][j][k] = static_cast<float>(lines.unit * lines.c[i][j][k]);
        const LineSumsOverFace found = sum_over_lines(face, lattice);
        const double weight = determinant / (static_cast<double>(lattice.rows) * LineLattice::group);
        Means means;
        for (const std::size_t half : {0, 1}) {
            means.add(Quantity::volume, weight * found.volumes[half], half);
            means.add(Quantity::area, weight * unit_of_metrics * found.areas[half], half);
        }
        return means;
    }

    /// A line, and its part in a mean.
    struct LinePlace {
        const Node& x;
        const Node& y;
        double weight;
        std::size_t half;
    };

    void add_line(const Lines& lines, const Plane& plane, const LinePlace& place, Means& to) const
    {
        Line b{};
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t k = 0; k < count; ++k)
                b[k] += place.y.values[j] * plane.values[j][k];
        if (!has_both_signs(b, count)) {
            if (lines.add_volume && b[0] >= 0.0)
                to.add(Quantity::volume, determinant * place.weight, place.half);
            return;
        }
        LinePolynomial line{Degree, {}};
        std::copy(b.begin(), b.end(), line.b.begin());
        // What is inside begins or ends at each crossing.
        bool is_inside = b[0] >= 0.0;
        double length = 0.0, begin = 0.0;
        for_each_root(line, [&](double s) {
            if (is_inside)
                length += s - begin;
            is_inside = !is_inside;
            begin = s;
            if (options.surface)
                add_crossing(s, lines, plane, place, to);
        });
        if (is_inside)
            length += 1.0 - begin;
        if (lines.add_volume)
            to.add(Quantity::volume, determinant * length * place.weight, place.half);
    }

    void add_crossing(double s, const Lines& lines, const Plane& plane, const LinePlace& place, Means& to) const
    {
        const auto& [x, y, weight, half] = place;
        const auto values = bernstein_values<Degree>(s);
        const Line slopes = bernstein_slopes<Degree>(s);
        glm::dvec3 gradient(0.0);
        double along_x = 0.0, along_y = 0.0, along_axis = 0.0;
        for (std::size_t j = 0; j < count; ++j) {
            double value = 0.0;
            for (std::size_t k = 0; k < count; ++k) {
                value += values[k] * plane.values[j][k];
                along_x += y.values[j] * values[k] * plane.slopes[j][k];
                along_axis += y.values[j] * slopes[k] * plane.values[j][k];
            }
            along_y += y.slopes[j] * value;
        }
        gradient[first_of_face(lines.axis)] = along_x;
        gradient[second_of_face(lines.axis)] = along_y;
        gradient[lines.axis] = along_axis;
        const double area = determinant * weight * glm::length(gradient * to_lattice) * std::abs(along_axis) /
                            glm::dot(gradient, gradient);
        if (!std::isfinite(area))
            return;
        to.add(Quantity::area, area, half);
        if (!options.curvature)
            return;
        const Jet jet = jet_in_cell<Degree>(lines.cell, point_of_face(lines.axis, {x.position, y.position}, s));
        const Curvature curvature = curvature_of_level_surface(jet.gradient * to_lattice,
                                                               glm::transpose(to_lattice) * jet.hessian * to_lattice);
        to.add(Quantity::mean_curvature, -lines.sign * area * curvature.mean, half);
        to.add(Quantity::gaussian_curvature, area * curvature.gaussian, half);
    }

    QuadratureOptions options;
    glm::dmat3 to_lattice;
    double determinant;
    glm::mat3 metrics[3]; ///< by axis, see LinesOverFace
    double unit_of_metrics;
    KnownShifts known_shifts;
};

CellLines::CellLines(int degree, const QuadratureOptions& options)
    : method_(dispatch_degree(degree, [&](auto of_degree) -> std::unique_ptr<Method> {
          return std::make_unique<MethodOfDegree<of_degree>>(options);
      }))
{
}

CellLines::~CellLines() = default;
CellLines::CellLines(CellLines&&) noexcept = default;

bool CellLines::add(const CellCoefficients& cell, const glm::ivec3& place, double sign, LineSums& to)
{
    return method_->add(cell, place, sign, to);
}

} // namespace isospline
