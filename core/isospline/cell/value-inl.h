// f - level and its gradient at points of one cell. Included once for each SIMD target.
#include "isospline/cell/coefficients.h"
#include "isospline/spline/cell_weights-inl.h"

#include <glm/vec3.hpp>

#include <array>
#include <type_traits>

#if defined(ISOSPLINE_CELL_VALUE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_VALUE_INL_H
#undef ISOSPLINE_CELL_VALUE_INL_H
#else
#define ISOSPLINE_CELL_VALUE_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// f - level at local coordinates in [0, 1]^3, a glm::dvec3 or three numbers; coefficient(i, j, k) is less the
/// threshold, as in CellCoefficients.
template <int Degree, class Coefficients, class Point>
HWY_INLINE auto value_in_cell(const Coefficients& coefficient, const Point& local)
{
    return weighted_sum(coefficient, cell_weights<Degree>(local[0]), cell_weights<Degree>(local[1]),
                        cell_weights<Degree>(local[2]));
}

template <class N>
struct ValueAndGradient {
    N value;
    std::array<N, 3> gradient; ///< of f, by lattice coordinates
};

/// The value and the gradient.
template <int Degree, class Coefficients, class Point>
HWY_INLINE auto value_and_gradient_in_cell(const Coefficients& coefficient, const Point& local)
{
    using N = std::remove_cvref_t<decltype(local[0])>;
    const auto x = cell_weights<Degree>(local[0]), y = cell_weights<Degree>(local[1]),
               z = cell_weights<Degree>(local[2]);
    const auto dx = cell_derivatives<Degree>(local[0]), dy = cell_derivatives<Degree>(local[1]),
               dz = cell_derivatives<Degree>(local[2]);
    const N zero = number<N>(0.0);
    ValueAndGradient<N> sum{zero, {zero, zero, zero}};
    for (int i = 0; i <= Degree; ++i) {
        // The value of one plane, and its derivatives with respect to y and z.
        N plane = zero, plane_dy = zero, plane_dz = zero;
        for (int k = 0; k <= Degree; ++k) {
            const N first = in_lanes<N>(coefficient(i, 0, k));
            N line = y[0] * first, line_dy = dy[0] * first;
            for (int j = 1; j <= Degree; ++j) {
                const N next = in_lanes<N>(coefficient(i, j, k));
                line = mul_add(y[j], next, line);
                line_dy = mul_add(dy[j], next, line_dy);
            }
            plane = mul_add(z[k], line, plane);
            plane_dy = mul_add(z[k], line_dy, plane_dy);
            plane_dz = mul_add(dz[k], line, plane_dz);
        }
        sum.value = mul_add(x[i], plane, sum.value);
        sum.gradient[0] = mul_add(dx[i], plane, sum.gradient[0]);
        sum.gradient[1] = mul_add(x[i], plane_dy, sum.gradient[1]);
        sum.gradient[2] = mul_add(x[i], plane_dz, sum.gradient[2]);
    }
    return sum;
}

/// The same for many points: lanes are the points.
template <int Degree, class Coefficients>
struct PointsOfCell {
    template <class Point>
    HWY_INLINE auto value(const Point& local) const
    {
        return value_in_cell<Degree>(coefficients, local);
    }
    template <class Point>
    HWY_INLINE auto value_and_gradient(const Point& local) const
    {
        return value_and_gradient_in_cell<Degree>(coefficients, local);
    }

    const Coefficients& coefficients;
};

// A single number takes the same operations as a lane.
using OneFloat = hn::Vec<hn::CappedTag<float, 1>>;
using OneDouble = hn::Vec<hn::CappedTag<double, 1>>;

/// The coefficients of one cell less the threshold, for single points: lanes are the coefficients of a row. The numbers
/// equal those of value_in_cell() and value_and_gradient_in_cell() for vectors.
template <int Degree>
class RowsOfCell {
public:
    explicit HWY_INLINE RowsOfCell(const CellCoefficients& cell)
    {
        const D d;
        const hn::Rebind<float, D> singles;
        const auto threshold = hn::Set(d, cell.threshold);
        for (int k = 0; k <= Degree; ++k)
            for (int j = 0; j <= Degree; ++j)
                for (int part = 0; part < parts; ++part)
                    rows_[part][k][j] =
                        hn::Sub(hn::PromoteTo(d, hn::LoadU(singles, cell.row(j, k) + part * lanes)), threshold);
    }

    HWY_INLINE OneDouble value(const std::array<OneDouble, 3>& local) const
    {
        const auto x = cell_weights<Degree>(local[0]), y = cell_weights<Degree>(local[1]),
                   z = cell_weights<Degree>(local[2]);
        const D d;
        const auto spread = [&](OneDouble number) HWY_ATTR { return hn::Set(d, hn::GetLane(number)); };
        alignas(64) double planes[parts * lanes];
        for (int part = 0; part < parts; ++part) {
            auto plane = hn::Zero(d);
            for (int k = 0; k <= Degree; ++k) {
                auto line = hn::Mul(spread(y[0]), rows_[part][k][0]);
                for (int j = 1; j <= Degree; ++j)
                    line = hn::MulAdd(spread(y[j]), rows_[part][k][j], line);
                plane = hn::MulAdd(spread(z[k]), line, plane);
            }
            hn::Store(plane, d, planes + part * lanes);
        }
        const hn::CappedTag<double, 1> one;
        OneDouble sum = hn::Zero(one);
        for (int i = 0; i <= Degree; ++i)
            sum = mul_add(x[i], hn::Set(one, planes[i]), sum);
        return sum;
    }

    HWY_INLINE ValueAndGradient<OneDouble> value_and_gradient(const std::array<OneDouble, 3>& local) const
    {
        const auto x = cell_weights<Degree>(local[0]), y = cell_weights<Degree>(local[1]),
                   z = cell_weights<Degree>(local[2]);
        const auto dx = cell_derivatives<Degree>(local[0]), dy = cell_derivatives<Degree>(local[1]),
                   dz = cell_derivatives<Degree>(local[2]);
        const D d;
        const auto spread = [&](OneDouble number) HWY_ATTR { return hn::Set(d, hn::GetLane(number)); };
        alignas(64) double planes[parts * lanes], planes_dy[parts * lanes], planes_dz[parts * lanes];
        for (int part = 0; part < parts; ++part) {
            auto plane = hn::Zero(d), plane_dy = hn::Zero(d), plane_dz = hn::Zero(d);
            for (int k = 0; k <= Degree; ++k) {
                const auto& row = rows_[part][k];
                auto line = hn::Mul(spread(y[0]), row[0]), line_dy = hn::Mul(spread(dy[0]), row[0]);
                for (int j = 1; j <= Degree; ++j) {
                    line = hn::MulAdd(spread(y[j]), row[j], line);
                    line_dy = hn::MulAdd(spread(dy[j]), row[j], line_dy);
                }
                plane = hn::MulAdd(spread(z[k]), line, plane);
                plane_dy = hn::MulAdd(spread(z[k]), line_dy, plane_dy);
                plane_dz = hn::MulAdd(spread(dz[k]), line, plane_dz);
            }
            hn::Store(plane, d, planes + part * lanes);
            hn::Store(plane_dy, d, planes_dy + part * lanes);
            hn::Store(plane_dz, d, planes_dz + part * lanes);
        }
        const hn::CappedTag<double, 1> one;
        const OneDouble zero = hn::Zero(one);
        ValueAndGradient<OneDouble> sum{zero, {zero, zero, zero}};
        for (int i = 0; i <= Degree; ++i) {
            const OneDouble plane = hn::Set(one, planes[i]);
            sum.value = mul_add(x[i], plane, sum.value);
            sum.gradient[0] = mul_add(dx[i], plane, sum.gradient[0]);
            sum.gradient[1] = mul_add(x[i], hn::Set(one, planes_dy[i]), sum.gradient[1]);
            sum.gradient[2] = mul_add(x[i], hn::Set(one, planes_dz[i]), sum.gradient[2]);
        }
        return sum;
    }

private:
    using D = hn::CappedTag<double, 4>;
    static constexpr int lanes = static_cast<int>(hn::MaxLanes(D())), parts = (Degree + lanes) / lanes;

    hn::Vec<D> rows_[parts][Degree + 1][Degree + 1];
};

/// Gradient of f, by lattice coordinates.
template <int Degree, class Coefficients>
HWY_INLINE glm::dvec3 gradient_in_cell(const Coefficients& coefficient, const glm::dvec3& local)
{
    const auto [x, y, z] = value_and_gradient_in_cell<Degree>(coefficient, local).gradient;
    return {x, y, z};
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
