#include "isospline/trace/cell_intersector.h"

#include "isospline/math/roots.h"
#include "isospline/trace/bracket.h"
#include "isospline/trace/node_tables.h"
#include "isospline/util/error.h"

#include <algorithm>

// Vectors whose size is known at run time only cannot be array elements.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/cell_intersector.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Lanes are the Chebyshev-Lobatto nodes, in one vector if the target has one that is wide enough.
template <typename T, int Degree>
using NodeTag = hn::CappedTag<T, NodeTables<T, Degree>::padded_count>;

// Weights of the n+1 coefficients along one axis at local coordinates u in [0, 1].
template <int Degree, class V, class D>
HWY_INLINE void Weights(D d, V u, V (&w)[Degree + 1])
{
    const V one = hn::Set(d, 1);
    const V v = hn::Sub(one, u);
    if constexpr (Degree == 1) {
        w[0] = v;
        w[1] = u;
    } else if constexpr (Degree == 2) {
        const V half = hn::Set(d, 0.5f);
        w[0] = hn::Mul(hn::Mul(half, v), v);
        w[2] = hn::Mul(hn::Mul(half, u), u);
        w[1] = hn::Sub(hn::Sub(one, w[0]), w[2]);
    } else {
        static_assert(Degree == 3);
        const V sixth = hn::Div(one, hn::Set(d, 6));
        const V uu = hn::Mul(u, u), vv = hn::Mul(v, v);
        w[0] = hn::Mul(hn::Mul(sixth, v), vv);
        w[3] = hn::Mul(hn::Mul(sixth, u), uu);
        // 2/3 - u^2 + u^3 / 2
        w[1] = hn::MulAdd(uu, hn::Sub(hn::Mul(hn::Set(d, 0.5f), u), one), hn::Div(hn::Set(d, 2), hn::Set(d, 3)));
        w[2] = hn::Sub(hn::Sub(hn::Sub(one, w[0]), w[1]), w[3]);
    }
}

// Rows of a cell's coefficients, less the threshold, are four apart here whatever the degree.
constexpr int local_row = 4;

template <int Degree>
constexpr int local_count = (Degree + 1) * (Degree + 1) * local_row;

// Bernstein coefficients, padded, of f - level from `entry` to `exit`, which are relative to the cell's lower corner.
template <typename T, int Degree>
HWY_INLINE void BernsteinAlongRay(const T* HWY_RESTRICT coefficients, const glm::dvec3& entry, const glm::dvec3& exit,
                                  T* HWY_RESTRICT bernstein)
{
    using Tables = NodeTables<T, Degree>;
    const Tables& tables = node_tables<T, Degree>;
    const NodeTag<T, Degree> d;
    using V = hn::Vec<decltype(d)>;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
    constexpr int vectors = (Tables::count + lanes - 1) / lanes;

    // Values at the nodes: separable sums, x innermost.
    alignas(64) T values[Tables::padded_count];
    for (int vector = 0; vector < vectors; ++vector) {
        const V s = hn::Load(d, tables.nodes + vector * lanes);
        V wx[Degree + 1], wy[Degree + 1], wz[Degree + 1];
        const auto coordinate = [&](int axis) HWY_ATTR {
            return hn::MulAdd(s, hn::Set(d, static_cast<T>(exit[axis] - entry[axis])),
                              hn::Set(d, static_cast<T>(entry[axis])));
        };
        Weights<Degree>(d, coordinate(0), wx);
        Weights<Degree>(d, coordinate(1), wy);
        Weights<Degree>(d, coordinate(2), wz);
        V sum = hn::Zero(d);
        for (int k = 0; k <= Degree; ++k) {
            V plane = hn::Zero(d);
            for (int j = 0; j <= Degree; ++j) {
                const T* row = coefficients + (k * (Degree + 1) + j) * local_row;
                V line = hn::Mul(wx[0], hn::Set(d, row[0]));
                for (int i = 1; i <= Degree; ++i)
                    line = hn::MulAdd(wx[i], hn::Set(d, row[i]), line);
                plane = hn::MulAdd(wy[j], line, plane);
            }
            sum = hn::MulAdd(wz[k], plane, sum);
        }
        hn::Store(sum, d, values + vector * lanes);
    }

    // Values to Bernstein coefficients: a constant matrix, column by column.
    for (int vector = 0; vector < vectors; ++vector) {
        V sum = hn::Zero(d);
        for (int j = 0; j < Tables::count; ++j)
            sum = hn::MulAdd(hn::Set(d, values[j]), hn::Load(d, tables.columns[j] + vector * lanes), sum);
        hn::Store(sum, d, bernstein + vector * lanes);
    }
}

// Whether single precision proves that f - level has one sign from `entry` to `exit`.
template <int Degree>
HWY_INLINE bool ProvesNoRoot(const CellBlock& cell, const glm::dvec3& entry, const glm::dvec3& exit)
{
    // Coefficients less threshold, and the largest of their magnitudes.
    const hn::CappedTag<float, local_row> row_tag;
    constexpr int row_lanes = static_cast<int>(hn::MaxLanes(row_tag));
    alignas(64) float coefficients[local_count<Degree>];
    const auto threshold = hn::Set(row_tag, static_cast<float>(cell.threshold));
    auto magnitudes = hn::Zero(row_tag);
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            float* reduced_row = coefficients + (k * (Degree + 1) + j) * local_row;
            for (int i = 0; i <= Degree; i += row_lanes) {
                const auto used = hn::FirstN(row_tag, static_cast<std::size_t>(Degree + 1 - i));
                const auto reduced = hn::IfThenElseZero(used, hn::Sub(hn::LoadU(row_tag, row + i), threshold));
                hn::Store(reduced, row_tag, reduced_row + i);
                magnitudes = hn::Max(magnitudes, hn::Abs(reduced));
            }
        }

    using Tables = NodeTables<float, Degree>;
    alignas(64) float bernstein[Tables::padded_count];
    BernsteinAlongRay<float, Degree>(coefficients, entry, exit, bernstein);

    // Rounding error of a value at a node, in units of 2^-24 times the largest magnitude: at most 5 in each local
    // coordinate, times the at most 2 that the weights of an axis vary by, for 3 axes: 30; at most 4 in the weights of
    // each axis: 12; one a multiply-add, three chains of n+1: 12; subtraction of the threshold: 1. The product with the
    // matrix adds 3n+2 roundings: at most 11. 80 covers them, and the threshold's own rounding is apart.
    constexpr float unit_roundoff = 0x1p-24f;
    const float magnitude = hn::GetLane(hn::MaxOfLanes(row_tag, magnitudes));
    const float value_error = unit_roundoff * (80.0f * magnitude + 2.0f * std::abs(static_cast<float>(cell.threshold)));
    const NodeTag<float, Degree> d;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
    constexpr int vectors = (Tables::count + lanes - 1) / lanes;
    bool above = true, below = true;
    for (int vector = 0; vector < vectors; ++vector) {
        const auto b = hn::Load(d, bernstein + vector * lanes);
        const auto bound =
            hn::Mul(hn::Set(d, value_error), hn::Load(d, node_tables<float, Degree>.bounds + vector * lanes));
        above = above && hn::AllTrue(d, hn::Gt(b, bound));
        below = below && hn::AllTrue(d, hn::Lt(b, hn::Neg(bound)));
    }
    return above || below;
}

template <int Degree>
std::optional<double> IntersectExact(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near > inside.t_far)
        return std::nullopt;
    const glm::dvec3 entry = ray.at(inside.t_near) - cell.lower;
    const glm::dvec3 exit = ray.at(inside.t_far) - cell.lower;
    if (ProvesNoRoot<Degree>(cell, entry, exit))
        return std::nullopt;

    alignas(64) double coefficients[local_count<Degree>];
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* row = cell.coefficients + j * cell.row_stride + k * cell.slice_stride;
            for (int i = 0; i <= Degree; ++i)
                coefficients[(k * (Degree + 1) + j) * local_row + i] = static_cast<double>(row[i]) - cell.threshold;
        }
    constexpr int bernstein_degree = 3 * Degree;
    alignas(64) double padded[NodeTables<double, Degree>::padded_count];
    BernsteinAlongRay<double, Degree>(coefficients, entry, exit, padded);
    Bernstein<bernstein_degree> bernstein;
    std::copy_n(padded, bernstein.size(), bernstein.begin());
    const std::optional<double> s = first_root<bernstein_degree>(bernstein);
    if (!s)
        return std::nullopt;
    return inside.t_near + *s * (inside.t_far - inside.t_near);
}

CellIntersector ExactIntersector(int degree)
{
    switch (degree) {
    case 1:
        return IntersectExact<1>;
    case 2:
        return IntersectExact<2>;
    default:
        return IntersectExact<3>;
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(ExactIntersector);

namespace {

template <int Degree>
std::optional<double> intersect_reference(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near > inside.t_far)
        return std::nullopt;

    constexpr int bernstein_degree = 3 * Degree;
    const auto& interpolation = chebyshev_lobatto<bernstein_degree>;
    std::array<double, bernstein_degree + 1> values;
    for (std::size_t node = 0; node < values.size(); ++node) {
        const double t = inside.t_near + interpolation.nodes[node] * (inside.t_far - inside.t_near);
        values[node] = value_in_cell<Degree>(cell, ray.at(t) - cell.lower);
    }
    Bernstein<bernstein_degree> bernstein;
    for (std::size_t i = 0; i < values.size(); ++i) {
        bernstein[i] = 0.0;
        for (std::size_t j = 0; j < values.size(); ++j)
            bernstein[i] += interpolation.to_bernstein[i][j] * values[j];
    }
    const std::optional<double> s = first_root<bernstein_degree>(bernstein);
    if (!s)
        return std::nullopt;
    return inside.t_near + *s * (inside.t_far - inside.t_near);
}

template <int Degree>
CellIntersector intersector_of_degree(Method method)
{
    switch (method) {
    case Method::exact:
        return HWY_DYNAMIC_DISPATCH(ExactIntersector)(Degree);
    case Method::reference:
        return intersect_reference<Degree>;
    case Method::bracket:
        return intersect_bracket<Degree>;
    }
    throw_invalid("method", "exact, reference or bracket", static_cast<int>(method));
}

} // namespace

CellIntersector cell_intersector(int degree, Method method)
{
    switch (degree) {
    case 1:
        return intersector_of_degree<1>(method);
    case 2:
        return intersector_of_degree<2>(method);
    case 3:
        return intersector_of_degree<3>(method);
    }
    throw_invalid("degree", "1, 2 or 3 for a surface", degree);
}

} // namespace isospline
#endif
