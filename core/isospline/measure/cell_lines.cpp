#include "isospline/measure/cell_lines.h"

#include "isospline/cell/jet.h"
#include "isospline/math/bernstein_box.h"
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
#include <vector>

namespace isospline {

namespace {

constexpr std::size_t at(Quantity quantity)
{
    return static_cast<std::size_t>(quantity);
}

} // namespace

struct CellLines::Method {
    virtual ~Method() = default;
    virtual bool add(const CellCoefficients& cell, double sign, LineSums& to) const = 0;
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
        std::array<double, 3> weights; ///< of the rules
        Line values, slopes;           ///< of the Bernstein polynomials there
    };

    explicit MethodOfDegree(const QuadratureOptions& given)
        : options(given), to_lattice(glm::inverse(given.lattice_to_world)),
          determinant(std::abs(glm::determinant(given.lattice_to_world)))
    {
        const std::vector<QuadratureNode> rule = gauss_legendre(given.order);
        const auto middle = rule.size() / 2;
        const auto without_middle = weights_without(rule, [&](std::size_t i) { return i == middle; });
        const auto every_other = weights_without(rule, [&](std::size_t i) { return i % 2 == 1; });
        for (std::size_t i = 0; i < rule.size(); ++i)
            nodes.push_back({rule[i].position,
                             {rule[i].weight, without_middle[i], every_other[i]},
                             bernstein_values<Degree>(rule[i].position),
                             bernstein_slopes<Degree>(rule[i].position)});
        if constexpr (Degree <= 2)
            set_lanes();
    }

    /// The nodes for SIMD lanes.
    void set_lanes()
    {
        in_lanes.count = nodes.size();
        const std::size_t padded = (nodes.size() + LineNodes::group - 1) / LineNodes::group * LineNodes::group;
        for (std::size_t i = 0; i < padded; ++i) {
            const Node& node = nodes[std::min(i, nodes.size() - 1)];
            for (std::size_t k = 0; k < count; ++k) {
                in_lanes.values[k].push_back(node.values[k]);
                in_lanes.slopes[k].push_back(node.slopes[k]);
            }
            for (std::size_t r = 0; r < 3; ++r)
                in_lanes.weights[r].push_back(i < nodes.size() ? node.weights[r] : 0.0);
        }
        const glm::dmat3 metric = to_lattice * glm::transpose(to_lattice);
        for (int axis = 0; axis < 3; ++axis) {
            const int order[3] = {first_of_face(axis), second_of_face(axis), axis};
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    metrics[axis][i][j] = metric[order[i]][order[j]];
        }
    }

    /// The weights of the rule that integrates the polynomial through the values at some of the nodes of a Gauss rule.
    template <typename IsLeftOut>
    static std::vector<double> weights_without(const std::vector<QuadratureNode>& rule, const IsLeftOut& is_left_out)
    {
        std::vector<double> weights(rule.size(), 0.0);
        for (std::size_t i = 0; i < rule.size(); ++i)
            for (const QuadratureNode& node : rule) {
                double lagrange = is_left_out(i) ? 0.0 : 1.0;
                for (std::size_t j = 0; j < rule.size(); ++j)
                    if (j != i && !is_left_out(j))
                        lagrange *= (node.position - rule[j].position) / (rule[i].position - rule[j].position);
                weights[i] += node.weight * lagrange;
            }
        return weights;
    }

    bool add(const CellCoefficients& cell, double sign, LineSums& to) const override
    {
        BernsteinBox<Degree> b = bernstein_of<Degree>(cell);
        if (std::find(b.begin(), b.end(), 0.0) != b.end())
            return false;
        for (double& each : b)
            each *= sign;
        const auto [least, most] = extremes_of(b);
        if (most < 0.0)
            return true;
        if (least > 0.0) {
            for (auto& rule : to.rules)
                rule[at(Quantity::volume)] += determinant;
            to.magnitude[at(Quantity::volume)] += determinant;
            return true;
        }
        ++to.cells;
        const int steepest = steepest_axis(b);
        if (!options.surface) {
            add_lines({cell, sign, steepest, true, oriented(b, steepest)}, to);
            return true;
        }
        for (int axis = 0; axis < 3; ++axis)
            add_lines({cell, sign, axis, axis == steepest, oriented(b, axis)}, to);
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
        Oriented c;
    };

    /// The polynomial at a node's first coordinate, and its derivative along this coordinate.
    struct Plane {
        std::array<Line, count> values{}, slopes{};
    };

    void add_lines(const Lines& lines, LineSums& to) const
    {
        if (has_lanes(Degree, options.curvature) && nodes.size() <= LineNodes::most)
            return add_lines_in_lanes(lines, to);
        for (const Node& x : nodes) {
            Plane plane;
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t j = 0; j < count; ++j)
                    for (std::size_t k = 0; k < count; ++k)
                        plane.values[j][k] += x.values[i] * lines.c[i][j][k];
            double least = plane.values[0][0], most = least;
            for (const Line& row : plane.values)
                for (const double each : row) {
                    least = each < least ? each : least;
                    most = each > most ? each : most;
                }
            if (least >= 0.0 && lines.add_volume)
                add(Quantity::volume, determinant, x.weights, {1.0, 1.0, 1.0}, to);
            if (least >= 0.0 || most < 0.0)
                continue;
            if (options.surface)
                for (std::size_t i = 0; i < count; ++i)
                    for (std::size_t j = 0; j < count; ++j)
                        for (std::size_t k = 0; k < count; ++k)
                            plane.slopes[j][k] += x.slopes[i] * lines.c[i][j][k];
            for (const Node& y : nodes)
                add_line(lines, plane, x, y, to);
        }
    }

    void add_lines_in_lanes(const Lines& lines, LineSums& to) const
    {
        LinesOverFace face{Degree, {}, metrics[lines.axis], lines.add_volume, options.surface};
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = 0; j < count; ++j)
                std::copy(lines.c[i][j].begin(), lines.c[i][j].end(), face.c[i][j].begin());
        const LineSumsOverFace sums = sum_lines(face, in_lanes);
        const auto add_sums = [&](Quantity quantity, const std::array<double, 3>& of_rules) {
            for (std::size_t rule = 0; rule < 3; ++rule)
                to.rules[rule][at(quantity)] += determinant * of_rules[rule];
            to.magnitude[at(quantity)] += determinant * of_rules[0];
        };
        if (lines.add_volume)
            add_sums(Quantity::volume, sums.volume);
        if (options.surface)
            add_sums(Quantity::area, sums.area);
    }

    void add_line(const Lines& lines, const Plane& plane, const Node& x, const Node& y, LineSums& to) const
    {
        Line b{};
        for (std::size_t j = 0; j < count; ++j)
            for (std::size_t k = 0; k < count; ++k)
                b[k] += y.values[j] * plane.values[j][k];
        if (!has_both_signs(b, count)) {
            if (lines.add_volume && b[0] >= 0.0)
                add(Quantity::volume, determinant, x.weights, y.weights, to);
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
                add_crossing(s, lines, plane, x, y, to);
        });
        if (is_inside)
            length += 1.0 - begin;
        if (lines.add_volume)
            add(Quantity::volume, determinant * length, x.weights, y.weights, to);
    }

    void add_crossing(double s, const Lines& lines, const Plane& plane, const Node& x, const Node& y,
                      LineSums& to) const
    {
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
        const double area =
            determinant * glm::length(gradient * to_lattice) * std::abs(along_axis) / glm::dot(gradient, gradient);
        if (!std::isfinite(area))
            return;
        add(Quantity::area, area, x.weights, y.weights, to);
        if (!options.curvature)
            return;
        const Jet jet = jet_in_cell<Degree>(lines.cell, point_of_face(lines.axis, {x.position, y.position}, s));
        const Curvature curvature = curvature_of_level_surface(jet.gradient * to_lattice,
                                                               glm::transpose(to_lattice) * jet.hessian * to_lattice);
        add(Quantity::mean_curvature, -lines.sign * area * curvature.mean, x.weights, y.weights, to);
        add(Quantity::gaussian_curvature, area * curvature.gaussian, x.weights, y.weights, to);
    }

    static void add(Quantity quantity, double found, const std::array<double, 3>& x, const std::array<double, 3>& y,
                    LineSums& to)
    {
        for (std::size_t rule = 0; rule < 3; ++rule)
            to.rules[rule][at(quantity)] += x[rule] * y[rule] * found;
        to.magnitude[at(quantity)] += x[0] * y[0] * std::abs(found);
    }

    QuadratureOptions options;
    glm::dmat3 to_lattice;
    double determinant;
    std::vector<Node> nodes;
    LineNodes in_lanes;    ///< the same
    glm::dmat3 metrics[3]; ///< by axis
};

CellLines::CellLines(int degree, const QuadratureOptions& options)
    : method_(dispatch_degree(degree, [&](auto of_degree) -> std::unique_ptr<Method> {
          return std::make_unique<MethodOfDegree<of_degree>>(options);
      }))
{
}

CellLines::~CellLines() = default;
CellLines::CellLines(CellLines&&) noexcept = default;

bool CellLines::add(const CellCoefficients& cell, double sign, LineSums& to) const
{
    return method_->add(cell, sign, to);
}

} // namespace isospline
