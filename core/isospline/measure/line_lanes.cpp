#include "isospline/measure/line_lanes.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/measure/line_lanes.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {

#ifndef ISOSPLINE_MEASURE_LINE_LANE_SUMS
#define ISOSPLINE_MEASURE_LINE_LANE_SUMS
// Sums over lines. They do not depend on the SIMD target: lanes are lines of a row, and are added one after the other.
struct LineLaneSums {
    // Adds the sums of some rows to those in double precision.
    void flush()
    {
        for (std::size_t i = 0; i < LineLattice::group; ++i) {
            found.volumes[LineSumsOverFace::half_of(i)] += static_cast<double>(volumes[i]);
            found.areas[LineSumsOverFace::half_of(i)] += static_cast<double>(areas[i]);
            volumes[i] = areas[i] = 0.0f;
        }
    }

    LineSumsOverFace found;
    alignas(64) float volumes[LineLattice::group] = {};
    alignas(64) float areas[LineLattice::group] = {};
};
#endif

namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, LineLattice::group>;
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

// Bernstein polynomials and their derivatives at nodes along a coordinate.
template <std::size_t Count>
struct Nodes {
    std::array<V, Count> values, slopes;
};

template <std::size_t Count>
HWY_INLINE Nodes<Count> nodes_at(V t)
{
    const Floats d;
    const V one = hn::Set(d, 1.0f), u = hn::Sub(one, t);
    if constexpr (Count == 2) {
        return {{u, t}, {hn::Neg(one), one}};
    } else {
        const V product = hn::Mul(t, u), difference = hn::Sub(u, t);
        return {{hn::Mul(u, u), hn::Add(product, product), hn::Mul(t, t)},
                {hn::Neg(hn::Add(u, u)), hn::Add(difference, difference), hn::Add(t, t)}};
    }
}

// The nodes from `first` on, of `count` that are mirrored in pairs; see LineLattice.
template <std::size_t Count>
HWY_INLINE Nodes<Count> nodes_from(std::size_t first, float count, double shift)
{
    const Floats d;
    const V i = hn::Iota(d, static_cast<float>(first)), pair = hn::Mul(i, hn::Set(d, 0.5f));
    const V of_even = hn::Set(d, static_cast<float>(shift)), of_odd = hn::Sub(hn::Set(d, 1.0f), of_even);
    const V offset = hn::IfThenElse(hn::Eq(hn::Floor(pair), pair), of_even, of_odd);
    return nodes_at<Count>(hn::Mul(hn::Add(i, offset), hn::Set(d, 1.0f / count)));
}

// Polynomials over the second coordinate and the axis, one for each of a group of rows.
template <std::size_t Count>
struct Planes {
    alignas(64) float values[Count][Count][LineLattice::group];
    alignas(64) float slopes[Count][Count][LineLattice::group];
    alignas(64) float least[LineLattice::group]; // of the values
    alignas(64) float most[LineLattice::group];
};

template <std::size_t Count>
HWY_INLINE void set_planes(const LinesOverFace& face, const LineLattice& lattice, std::size_t first,
                           Planes<Count>& planes)
{
    const Floats d;
    for (std::size_t x = 0; x < LineLattice::group; x += hn::Lanes(d)) {
        const Nodes<Count> nodes = nodes_from<Count>(first + x, static_cast<float>(lattice.rows), lattice.shifts[0]);
        const auto sum_over = [&](const std::array<V, Count>& of_nodes, std::size_t j, std::size_t k) HWY_ATTR {
            V sum = hn::Mul(of_nodes[0], hn::Set(d, face.c[0][j][k]));
            for (std::size_t i = 1; i < Count; ++i)
                sum = hn::Add(sum, hn::Mul(of_nodes[i], hn::Set(d, face.c[i][j][k])));
            return sum;
        };
        V least = sum_over(nodes.values, 0, 0), most = least;
        for (std::size_t j = 0; j < Count; ++j)
            for (std::size_t k = 0; k < Count; ++k) {
                const V value = sum_over(nodes.values, j, k);
                least = hn::Min(least, value);
                most = hn::Max(most, value);
                hn::Store(value, d, planes.values[j][k] + x);
                if (face.area)
                    hn::Store(sum_over(nodes.slopes, j, k), d, planes.slopes[j][k] + x);
            }
        hn::Store(least, d, planes.least + x);
        hn::Store(most, d, planes.most + x);
    }
}

// Adds the lines of row x of a group, from the line `first` on.
template <std::size_t Count>
HWY_INLINE void add_lines(const LinesOverFace& face, const Nodes<Count>& nodes, const Planes<Count>& planes,
                          std::size_t x, std::size_t first, LineLaneSums& sums)
{
    const Floats d;
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const auto along_line = [&](const std::array<V, Count>& of_nodes,
                                const float(&of_planes)[Count][Count][LineLattice::group]) HWY_ATTR {
        std::array<V, Count> sums_over_nodes;
        for (std::size_t k = 0; k < Count; ++k) {
            sums_over_nodes[k] = zero;
            for (std::size_t j = 0; j < Count; ++j)
                sums_over_nodes[k] = hn::Add(sums_over_nodes[k], hn::Mul(of_nodes[j], hn::Set(d, of_planes[j][k][x])));
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
void add_lines_of_degree(const LinesOverFace& face, const LineLattice& lattice, LineLaneSums& sums)
{
    const auto rows = static_cast<std::size_t>(lattice.rows);
    Planes<Count> planes;
    for (std::size_t first = 0; first < rows; first += LineLattice::group) {
        set_planes(face, lattice, first, planes);
        const std::size_t count = std::min(rows - first, std::size_t{LineLattice::group});
        for (std::size_t x = 0; x < count; ++x) {
            if (planes.least[x] >= 0.0f && face.volume)
                for (double& volume : sums.found.volumes)
                    volume += 0.5 * LineLattice::group;
            if (planes.least[x] >= 0.0f || planes.most[x] < 0.0f)
                continue;
            const double shift = lattice.shift_of_row(static_cast<int>(first + x));
            for (std::size_t y = 0; y < LineLattice::group; y += hn::Lanes(Floats()))
                add_lines(face, nodes_from<Count>(y, LineLattice::group, shift), planes, x, y, sums);
        }
        sums.flush();
    }
}

void add_lines_in_lanes(const LinesOverFace& face, const LineLattice& lattice, LineLaneSums& sums)
{
    if (face.degree == 1)
        add_lines_of_degree<2>(face, lattice, sums);
    else
        add_lines_of_degree<3>(face, lattice, sums);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(add_lines_in_lanes);

LineSumsOverFace sum_over_lines(const LinesOverFace& face, const LineLattice& lattice)
{
    LineLaneSums sums;
    HWY_DYNAMIC_DISPATCH(add_lines_in_lanes)(face, lattice, sums);
    return sums.found;
}

} // namespace isospline
#endif
