#include "isospline/measure/line_lanes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/measure/line_lanes.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, LineNodes::group>;
using V = hn::Vec<Doubles>;
using M = hn::Mask<Doubles>;

// Where lines in [0, 1] leave the solid and enter it; each at most once.
struct Crossings {
    M has_exit, has_entry;
    V exit, entry;
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
    const V s = within_line(hn::Div(b[0], hn::Sub(b[0], b[1])));
    return {hn::AndNot(ends, begins), hn::AndNot(begins, ends), s, s};
}

// f = c + 2 h s + a s^2. Its slope at a root is -2 r at an exit and 2 r at an entry, where r^2 = h^2 - a c. Of the two
// formulas for each root, the one without a difference of similar numbers is taken.
HWY_INLINE Crossings crossings_of(const std::array<V, 3>& b)
{
    const Doubles d;
    const V zero = hn::Zero(d), c = b[0], h = hn::Sub(b[1], b[0]);
    const V a = hn::Sub(hn::Sub(b[2], b[1]), h);
    const V square = hn::Sub(hn::Mul(h, h), hn::Mul(a, c));
    const V r = hn::Sqrt(hn::Max(square, zero));
    const M begins = hn::Ge(b[0], zero), bulges = hn::Ge(b[1], zero), ends = hn::Ge(b[2], zero);
    const M both_ends = hn::And(begins, ends), no_end = hn::AndNot(begins, hn::Not(ends));
    const M twice = hn::And(hn::Or(hn::AndNot(bulges, both_ends), hn::And(bulges, no_end)), hn::Gt(square, zero));
    const V falling = hn::IfThenElse(hn::Le(h, zero), hn::Div(c, hn::Sub(r, h)), hn::Div(hn::Neg(hn::Add(r, h)), a));
    const V rising = hn::IfThenElse(hn::Ge(h, zero), hn::Div(hn::Neg(c), hn::Add(h, r)), hn::Div(hn::Sub(r, h), a));
    return {hn::Or(hn::AndNot(ends, begins), twice), hn::Or(hn::AndNot(begins, ends), twice), within_line(falling),
            within_line(rising)};
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

// One line for each node along the second coordinate, at one node along the first.
template <std::size_t Count>
struct Plane {
    double values[Count][Count] = {}, slopes[Count][Count] = {};
    double weights[3];
};

template <std::size_t Count>
HWY_INLINE void add_group(const LinesOverFace& face, const LineNodes& nodes, const Plane<Count>& plane,
                          std::size_t first, LineLaneSums& sums)
{
    const Doubles d;
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
    const std::size_t lane = first % LineNodes::group;
    const auto along_line = [&](const std::array<std::vector<double>, 3>& of_nodes,
                                const double(&of_plane)[Count][Count]) HWY_ATTR {
        std::array<V, Count> sums_over_nodes;
        for (std::size_t k = 0; k < Count; ++k) {
            sums_over_nodes[k] = zero;
            for (std::size_t j = 0; j < Count; ++j)
                sums_over_nodes[k] =
                    hn::Add(sums_over_nodes[k], hn::Mul(hn::LoadU(d, &of_nodes[j][first]), hn::Set(d, of_plane[j][k])));
        }
        return sums_over_nodes;
    };
    const std::array<V, Count> b = along_line(nodes.values, plane.values);
    const M begins = hn::Ge(b[0], zero);
    V weights[3];
    for (std::size_t rule = 0; rule < 3; ++rule)
        weights[rule] = hn::Mul(hn::Set(d, plane.weights[rule]), hn::LoadU(d, &nodes.weights[rule][first]));
    const auto add = [&](V number, double(&to)[3][LineNodes::group]) HWY_ATTR {
        for (std::size_t rule = 0; rule < 3; ++rule) {
            double* const sum = to[rule] + lane;
            hn::Store(hn::Add(hn::Load(d, sum), hn::Mul(weights[rule], number)), d, sum);
        }
    };
    if (hn::AllFalse(d, has_both_signs(b))) {
        if (face.volume)
            add(hn::IfThenElseZero(begins, one), sums.volume);
        return;
    }
    const Crossings found = crossings_of(b);
    if (face.volume) {
        const V end = hn::IfThenElse(found.has_exit, found.exit, one);
        const V behind = hn::IfThenElseZero(found.has_entry, hn::Sub(one, found.entry));
        const V within = hn::IfThenElseZero(found.has_entry, hn::Sub(end, found.entry));
        add(hn::IfThenElse(begins, hn::Add(end, behind), within), sums.volume);
    }
    if (!face.area)
        return;
    const std::array<V, Count> along_x = along_line(nodes.values, plane.slopes);
    const std::array<V, Count> along_y = along_line(nodes.slopes, plane.values);
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
    add_crossing(found.has_exit, found.exit);
    add_crossing(found.has_entry, found.entry);
}

template <std::size_t Count>
void add_lines_of_degree(const LinesOverFace& face, const LineNodes& nodes, LineLaneSums& sums)
{
    for (std::size_t x = 0; x < nodes.count; ++x) {
        Plane<Count> plane;
        for (std::size_t i = 0; i < Count; ++i)
            for (std::size_t j = 0; j < Count; ++j)
                for (std::size_t k = 0; k < Count; ++k)
                    plane.values[j][k] += nodes.values[i][x] * face.c[i][j][k];
        double least = plane.values[0][0], most = least;
        for (const auto& row : plane.values)
            for (const double each : row) {
                least = each < least ? each : least;
                most = each > most ? each : most;
            }
        if (most < 0.0)
            continue;
        for (std::size_t rule = 0; rule < 3; ++rule)
            plane.weights[rule] = nodes.weights[rule][x];
        if (least >= 0.0) {
            for (std::size_t rule = 0; face.volume && rule < 3; ++rule)
                sums.volume[rule][0] += plane.weights[rule];
            continue;
        }
        for (std::size_t i = 0; face.area && i < Count; ++i)
            for (std::size_t j = 0; j < Count; ++j)
                for (std::size_t k = 0; k < Count; ++k)
                    plane.slopes[j][k] += nodes.slopes[i][x] * face.c[i][j][k];
        for (std::size_t first = 0; first < nodes.values[0].size(); first += hn::Lanes(Doubles()))
            add_group(face, nodes, plane, first, sums);
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

double LineLaneSums::total(const double (&lanes)[LineNodes::group])
{
    double sum = 0.0;
    for (const double each : lanes)
        sum += each;
    return sum;
}

void add_lines(const LinesOverFace& face, const LineNodes& nodes, LineLaneSums& sums)
{
    HWY_DYNAMIC_DISPATCH(add_lines_in_lanes)(face, nodes, sums);
}

} // namespace isospline
#endif
