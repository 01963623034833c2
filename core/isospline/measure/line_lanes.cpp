#include "isospline/measure/line_lanes.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/measure/line_lanes.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {

#ifndef ISOSPLINE_MEASURE_LINE_LANE_SUMS
#define ISOSPLINE_MEASURE_LINE_LANE_SUMS
// Sums over lines. They do not depend on the SIMD target: lanes are nodes along the second coordinate, and are added
// one after the other.
struct LineLaneSums {
    explicit LineLaneSums(const LineGrid& grid) : count(static_cast<std::size_t>(grid.counts[1])) { clear(); }

    void clear()
    {
        std::fill_n(volumes, count, 0.0f);
        std::fill_n(areas, count, 0.0f);
    }

    // Adds the sums of some nodes along the first coordinate to those in double precision.
    void flush()
    {
        volume = std::accumulate(volumes, volumes + count, volume);
        area = std::accumulate(areas, areas + count, area);
        clear();
    }

    std::size_t count;
    double volume = 0.0, area = 0.0;
    alignas(64) float volumes[LineGrid::most];
    alignas(64) float areas[LineGrid::most];
};
#endif

namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, LineGrid::group>;
using V = hn::Vec<Floats>;
using M = hn::Mask<Floats>;

// Where lines in [0, 1] leave the solid or enter it, in order.
struct Crossings {
    M has_first, has_second;
    V first, second;
};

HWY_INLINE V within_line(V s)
{
    const Floats d;
    return hn::IfThenElseZero(hn::Ge(s, hn::Zero(d)), hn::Min(s, hn::Set(d, 1.0f))); // also for NaN
}

HWY_INLINE Crossings crossings_of(const std::array<V, 2>& b)
{
    const Floats d;
    const M begins = hn::Ge(b[0], hn::Zero(d)), ends = hn::Ge(b[1], hn::Zero(d));
    return {hn::Xor(begins, ends), hn::FirstN(d, 0), within_line(hn::Div(b[0], hn::Sub(b[0], b[1]))), hn::Zero(d)};
}

// With the sign for which f is negative at the begin, f = c + 2 h s + a s^2. It has the slope 2 r at its first root and
// -2 r at its second, where r^2 = h^2 - a c. Of the two formulas for each root, the one without a difference of similar
// numbers is taken.
HWY_INLINE Crossings crossings_of(const std::array<V, 3>& b)
{
    const Floats d;
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
    const Floats d;
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

// Bernstein polynomials and their derivatives at the nodes along a coordinate, padded to whole vectors.
template <std::size_t Count>
struct Nodes {
    alignas(64) float values[Count][LineGrid::most];
    alignas(64) float slopes[Count][LineGrid::most];
};

HWY_INLINE void set_nodes(V t, std::size_t at, Nodes<2>& nodes)
{
    const Floats d;
    const V one = hn::Set(d, 1.0f);
    hn::Store(hn::Sub(one, t), d, nodes.values[0] + at);
    hn::Store(t, d, nodes.values[1] + at);
    hn::Store(hn::Neg(one), d, nodes.slopes[0] + at);
    hn::Store(one, d, nodes.slopes[1] + at);
}

HWY_INLINE void set_nodes(V t, std::size_t at, Nodes<3>& nodes)
{
    const Floats d;
    const V u = hn::Sub(hn::Set(d, 1.0f), t), product = hn::Mul(t, u), difference = hn::Sub(u, t);
    hn::Store(hn::Mul(u, u), d, nodes.values[0] + at);
    hn::Store(hn::Add(product, product), d, nodes.values[1] + at);
    hn::Store(hn::Mul(t, t), d, nodes.values[2] + at);
    hn::Store(hn::Neg(hn::Add(u, u)), d, nodes.slopes[0] + at);
    hn::Store(hn::Add(difference, difference), d, nodes.slopes[1] + at);
    hn::Store(hn::Add(t, t), d, nodes.slopes[2] + at);
}

template <std::size_t Count>
HWY_INLINE void set_nodes(const LineGrid& grid, std::size_t coordinate, Nodes<Count>& nodes)
{
    const Floats d;
    const auto count = static_cast<float>(grid.counts[coordinate]);
    const V half = hn::Set(d, 0.5f), shift = hn::Set(d, static_cast<float>(grid.shifts[coordinate]));
    // LineGrid::position
    for (std::size_t at = 0; at < static_cast<std::size_t>(grid.counts[coordinate]); at += hn::Lanes(d)) {
        const V i = hn::Iota(d, static_cast<float>(at)), pair = hn::Mul(i, half);
        const M is_even = hn::Eq(hn::Floor(pair), pair);
        const V offset = hn::IfThenElse(is_even, shift, hn::Sub(hn::Set(d, 1.0f), shift));
        set_nodes(hn::Mul(hn::Add(i, offset), hn::Set(d, 1.0f / count)), at, nodes);
    }
}

// Polynomials over the second coordinate and the axis, one for each node along the first coordinate.
template <std::size_t Count>
struct Planes {
    alignas(64) float values[Count][Count][LineGrid::most];
    alignas(64) float slopes[Count][Count][LineGrid::most];
    alignas(64) float least[LineGrid::most]; ///< of the values
    alignas(64) float most[LineGrid::most];
};

template <std::size_t Count>
HWY_INLINE void set_planes(const LinesOverFace& face, std::size_t node_count, const Nodes<Count>& nodes,
                           Planes<Count>& planes)
{
    const Floats d;
    const auto sum_over = [&](const float(&of_nodes)[Count][LineGrid::most], std::size_t x, std::size_t j,
                              std::size_t k) HWY_ATTR {
        V sum = hn::Mul(hn::Load(d, of_nodes[0] + x), hn::Set(d, face.c[0][j][k]));
        for (std::size_t i = 1; i < Count; ++i)
            sum = hn::Add(sum, hn::Mul(hn::Load(d, of_nodes[i] + x), hn::Set(d, face.c[i][j][k])));
        return sum;
    };
    for (std::size_t x = 0; x < node_count; x += hn::Lanes(d)) {
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
HWY_INLINE void add_group(const LinesOverFace& face, const Nodes<Count>& nodes, const Planes<Count>& planes,
                          std::size_t x, std::size_t first, LineLaneSums& sums)
{
    const Floats d;
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const auto along_line = [&](const float(&of_nodes)[Count][LineGrid::most],
                                const float(&of_planes)[Count][Count][LineGrid::most]) HWY_ATTR {
        std::array<V, Count> sums_over_nodes;
        for (std::size_t k = 0; k < Count; ++k) {
            sums_over_nodes[k] = zero;
            for (std::size_t j = 0; j < Count; ++j)
                sums_over_nodes[k] = hn::Add(sums_over_nodes[k],
                                             hn::Mul(hn::Load(d, of_nodes[j] + first), hn::Set(d, of_planes[j][k][x])));
        }
        return sums_over_nodes;
    };
    const std::array<V, Count> b = along_line(nodes.values, planes.values);
    const M begins = hn::Ge(b[0], zero);
    const auto add = [&](V number, float* to)
                         HWY_ATTR { hn::Store(hn::Add(hn::Load(d, to + first), number), d, to + first); };
    if (hn::AllFalse(d, has_both_signs(b))) {
        if (face.volume)
            add(hn::IfThenElseZero(begins, one), sums.volumes);
        return;
    }
    const Crossings found = crossings_of(b);
    if (face.volume) {
        // Between the crossings, the sign is that of neither end.
        const V second = hn::IfThenElse(found.has_second, found.second, one);
        const V between = hn::IfThenElseZero(found.has_first, hn::Sub(second, found.first));
        add(hn::IfThenElse(begins, hn::Sub(one, between), between), sums.volumes);
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
        add(hn::IfThenElseZero(hn::And(has, hn::Gt(square, zero)), area), sums.areas);
    };
    add_crossing(found.has_first, found.first);
    add_crossing(found.has_second, found.second);
}

template <std::size_t Count>
void add_lines_of_degree(const LinesOverFace& face, const LineGrid& grid, LineLaneSums& sums)
{
    Nodes<Count> first, second;
    set_nodes(grid, 0, first);
    set_nodes(grid, 1, second);
    const auto rows = static_cast<std::size_t>(grid.counts[0]);
    Planes<Count> planes;
    set_planes(face, rows, first, planes);
    for (std::size_t x = 0; x < rows; ++x) {
        if (planes.least[x] >= 0.0f)
            sums.volume += face.volume ? static_cast<double>(sums.count) : 0.0;
        else if (planes.most[x] >= 0.0f)
            for (std::size_t y = 0; y < sums.count; y += hn::Lanes(Floats()))
                add_group(face, second, planes, x, y, sums);
        if (x % 8 == 7 || x + 1 == rows)
            sums.flush();
    }
}

void add_lines_in_lanes(const LinesOverFace& face, const LineGrid& grid, LineLaneSums& sums)
{
    if (face.degree == 1)
        add_lines_of_degree<2>(face, grid, sums);
    else
        add_lines_of_degree<3>(face, grid, sums);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(add_lines_in_lanes);

LineMeansOverFace mean_over_lines(const LinesOverFace& face, const LineGrid& grid)
{
    LineLaneSums sums(grid);
    HWY_DYNAMIC_DISPATCH(add_lines_in_lanes)(face, grid, sums);
    const double lines = static_cast<double>(grid.counts[0]) * grid.counts[1];
    return {sums.volume / lines, sums.area / lines};
}

} // namespace isospline
#endif
