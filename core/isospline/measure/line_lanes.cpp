#include "isospline/measure/line_lanes.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/measure/line_lanes.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {

#ifndef ISOSPLINE_MEASURE_LINE_LANE_SUMS
#define ISOSPLINE_MEASURE_LINE_LANE_SUMS
// Sums over the nodes along the first coordinate by three rules, for each node along the second one. They do not depend
// on the SIMD target.
struct LineLaneSums {
    explicit LineLaneSums(std::size_t count)
    {
        for (std::size_t rule = 0; rule < 3; ++rule) {
            std::fill_n(volume[rule], count, 0.0);
            std::fill_n(area[rule], count, 0.0);
        }
    }

    double whole[3] = {}; ///< of planes that are in the solid as a whole
    alignas(64) double volume[3][LineNodes::most];
    alignas(64) double area[3][LineNodes::most];
};
#endif

namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, LineNodes::group>;
using V = hn::Vec<Doubles>;
using M = hn::Mask<Doubles>;

// Where lines in [0, 1] leave the solid or enter it, in order.
struct Crossings {
    M has_first, has_second;
    V first, second;
};

HWY_INLINE V within_line(V s)
{
    const Doubles d;
    return hn::IfThenElseZero(hn::Ge(s, hn::Zero(d)), hn::Min(s, hn::Set(d, 1.0))); // also for NaN
}

HWY_INLINE Crossings crossings_of(const std::array<V, 2>& b)
{
    const Doubles d;
    const M begins = hn::Ge(b[0], hn::Zero(d)), ends = hn::Ge(b[1], hn::Zero(d));
    return {hn::Xor(begins, ends), hn::FirstN(d, 0), within_line(hn::Div(b[0], hn::Sub(b[0], b[1]))), hn::Zero(d)};
}

// With the sign for which f is negative at the begin, f = c + 2 h s + a s^2. It has the slope 2 r at its first root and
// -2 r at its second, where r^2 = h^2 - a c. Of the two formulas for each root, the one without a difference of similar
// numbers is taken.
HWY_INLINE Crossings crossings_of(const std::array<V, 3>& b)
{
    const Doubles d;
    const V zero = hn::Zero(d);
    const M begins = hn::Ge(b[0], zero);
    const auto negative_at_begin = [&](V of) HWY_ATTR { return hn::IfThenElse(begins, hn::Neg(of), of); };
    const V c = negative_at_begin(b[0]), h = negative_at_begin(hn::Sub(b[1], b[0]));
    const V a = hn::Sub(negative_at_begin(hn::Sub(b[2], b[1])), h);
    const V square = hn::Sub(hn::Mul(h, h), hn::Mul(a, c));
    const V r = hn::Sqrt(hn::Max(square, zero));
    const M changes = hn::Xor(begins, hn::Ge(b[2], zero));
    const M twice = hn::AndNot(changes, hn::And(hn::Xor(begins, hn::Ge(b[1], zero)), hn::Gt(square, zero)));
    const M is_rising = hn::Ge(h, zero);
    const V first =
        hn::Div(hn::IfThenElse(is_rising, hn::Neg(c), hn::Sub(r, h)), hn::IfThenElse(is_rising, hn::Add(h, r), a));
    if (hn::AllFalse(d, twice))
        return {changes, twice, within_line(first), zero};
    // With two roots, f rises at the begin.
    const V second = hn::Div(hn::Neg(hn::Add(r, h)), a);
    return {hn::Or(changes, twice), twice, within_line(first), within_line(second)};
}

// Whether the coefficients of a line have both signs.
template <std::size_t Count>
HWY_INLINE M has_both_signs(const std::array<V, Count>& b)
{
    const Doubles d;
    const M begins = hn::Ge(b[0], hn::Zero(d));
    M differs = hn::Xor(begins, hn::Ge(b[1], hn::Zero(d)));
    for (std::size_t k = 2; k < Count; ++k)
        differs = hn::Or(differs, hn::Xor(begins, hn::Ge(b[k], hn::Zero(d))));
    return differs;
}

// The value of a polynomial with Bernstein coefficients b at s.
HWY_INLINE V value_at(const std::array<V, 2>& b, V s)
{
    return hn::Add(b[0], hn::Mul(s, hn::Sub(b[1], b[0])));
}

HWY_INLINE V value_at(const std::array<V, 3>& b, V s)
{
    const V first = value_at(std::array<V, 2>{b[0], b[1]}, s), second = value_at(std::array<V, 2>{b[1], b[2]}, s);
    return value_at(std::array<V, 2>{first, second}, s);
}

// Its derivative.
HWY_INLINE V slope_at(const std::array<V, 2>& b, V)
{
    return hn::Sub(b[1], b[0]);
}

HWY_INLINE V slope_at(const std::array<V, 3>& b, V s)
{
    const V slope = value_at(std::array<V, 2>{hn::Sub(b[1], b[0]), hn::Sub(b[2], b[1])}, s);
    return hn::Add(slope, slope);
}

// Polynomials over the second coordinate and the axis, one for each node along the first coordinate.
template <std::size_t Count>
struct Planes {
    alignas(64) double values[Count][Count][LineNodes::most];
    alignas(64) double slopes[Count][Count][LineNodes::most];
    alignas(64) double least[LineNodes::most]; ///< of the values
    alignas(64) double most[LineNodes::most];
};

template <std::size_t Count>
HWY_INLINE void set_planes(const LinesOverFace& face, const LineNodes& nodes, Planes<Count>& planes)
{
    const Doubles d;
    const auto sum_over = [&](const std::array<std::vector<double>, 3>& of_nodes, std::size_t x, std::size_t j,
                              std::size_t k) HWY_ATTR {
        V sum = hn::Mul(hn::LoadU(d, &of_nodes[0][x]), hn::Set(d, face.c[0][j][k]));
        for (std::size_t i = 1; i < Count; ++i)
            sum = hn::Add(sum, hn::Mul(hn::LoadU(d, &of_nodes[i][x]), hn::Set(d, face.c[i][j][k])));
        return sum;
    };
    for (std::size_t x = 0; x < nodes.values[0].size(); x += hn::Lanes(d)) {
        V least = sum_over(nodes.values, x, 0, 0), most = least;
        for (std::size_t j = 0; j < Count; ++j)
            for (std::size_t k = 0; k < Count; ++k) {
                const V value = sum_over(nodes.values, x, j, k);
                least = hn::Min(least, value);
                most = hn::Max(most, value);
                hn::Store(value, d, planes.values[j][k] + x);
                if (face.area)
                    hn::Store(sum_over(nodes.slopes, x, j, k), d, planes.slopes[j][k] + x);
            }
        hn::Store(least, d, planes.least + x);
        hn::Store(most, d, planes.most + x);
    }
}

// Adds the lines at node x along the first coordinate, and a group of nodes along the second one.
template <std::size_t Count>
HWY_INLINE void add_group(const LinesOverFace& face, const LineNodes& nodes, const Planes<Count>& planes, std::size_t x,
                          std::size_t first, LineLaneSums& sums)
{
    const Doubles d;
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
    const auto along_line = [&](const std::array<std::vector<double>, 3>& of_nodes,
                                const double(&of_planes)[Count][Count][LineNodes::most]) HWY_ATTR {
        std::array<V, Count> sums_over_nodes;
        for (std::size_t k = 0; k < Count; ++k) {
            sums_over_nodes[k] = zero;
            for (std::size_t j = 0; j < Count; ++j)
                sums_over_nodes[k] = hn::Add(
                    sums_over_nodes[k], hn::Mul(hn::LoadU(d, &of_nodes[j][first]), hn::Set(d, of_planes[j][k][x])));
        }
        return sums_over_nodes;
    };
    const std::array<V, Count> b = along_line(nodes.values, planes.values);
    const M begins = hn::Ge(b[0], zero);
    const auto add = [&](V number, double(&to)[3][LineNodes::most]) HWY_ATTR {
        for (std::size_t rule = 0; rule < 3; ++rule) {
            const V part = hn::Mul(hn::Set(d, nodes.weights[rule][x]), number);
            hn::Store(hn::Add(hn::Load(d, to[rule] + first), part), d, to[rule] + first);
        }
    };
    if (hn::AllFalse(d, has_both_signs(b))) {
        if (face.volume)
            add(hn::IfThenElseZero(begins, one), sums.volume);
        return;
    }
    const Crossings found = crossings_of(b);
    if (face.volume) {
        // Between the crossings, the sign is that of neither end.
        const V second = hn::IfThenElse(found.has_second, found.second, one);
        const V between = hn::IfThenElseZero(found.has_first, hn::Sub(second, found.first));
        add(hn::IfThenElse(begins, hn::Sub(one, between), between), sums.volume);
    }
    if (!face.area)
        return;
    const std::array<V, Count> along_x = along_line(nodes.values, planes.slopes);
    const std::array<V, Count> along_y = along_line(nodes.slopes, planes.values);
    const auto add_crossing = [&](M has, V s) HWY_ATTR {
        if (hn::AllFalse(d, has))
            return;
        const std::array<V, 3> g{value_at(along_x, s), value_at(along_y, s), slope_at(b, s)};
        V square = zero, square_world = zero;
        for (int i = 0; i < 3; ++i) {
            square = hn::Add(square, hn::Mul(g[static_cast<std::size_t>(i)], g[static_cast<std::size_t>(i)]));
            V row = zero;
            for (int j = 0; j < 3; ++j)
                row = hn::Add(row, hn::Mul(hn::Set(d, face.metric[j][i]), g[static_cast<std::size_t>(j)]));
            square_world = hn::Add(square_world, hn::Mul(row, g[static_cast<std::size_t>(i)]));
        }
        const V area = hn::Div(hn::Mul(hn::Sqrt(hn::Max(square_world, zero)), hn::Abs(g[2])), square);
        add(hn::IfThenElseZero(hn::And(has, hn::Gt(square, zero)), area), sums.area);
    };
    add_crossing(found.has_first, found.first);
    add_crossing(found.has_second, found.second);
}

template <std::size_t Count>
void add_lines_of_degree(const LinesOverFace& face, const LineNodes& nodes, LineLaneSums& sums)
{
    Planes<Count> planes;
    set_planes(face, nodes, planes);
    for (std::size_t x = 0; x < nodes.count; ++x) {
        if (planes.most[x] < 0.0)
            continue;
        if (planes.least[x] >= 0.0) {
            for (std::size_t rule = 0; face.volume && rule < 3; ++rule)
                sums.whole[rule] += nodes.weights[rule][x];
            continue;
        }
        for (std::size_t first = 0; first < nodes.values[0].size(); first += hn::Lanes(Doubles()))
            add_group(face, nodes, planes, x, first, sums);
    }
}

void add_lines_in_lanes(const LinesOverFace& face, const LineNodes& nodes, LineLaneSums& sums)
{
    if (face.degree == 1)
        add_lines_of_degree<2>(face, nodes, sums);
    else
        add_lines_of_degree<3>(face, nodes, sums);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(add_lines_in_lanes);

LineSumsOverFace sum_lines(const LinesOverFace& face, const LineNodes& nodes)
{
    LineLaneSums sums(nodes.values[0].size());
    HWY_DYNAMIC_DISPATCH(add_lines_in_lanes)(face, nodes, sums);
    LineSumsOverFace total;
    for (std::size_t rule = 0; rule < 3; ++rule) {
        total.volume[rule] = sums.whole[rule];
        for (std::size_t y = 0; y < nodes.count; ++y) {
            total.volume[rule] += nodes.weights[rule][y] * sums.volume[rule][y];
            total.area[rule] += nodes.weights[rule][y] * sums.area[rule][y];
        }
    }
    return total;
}

} // namespace isospline
#endif
