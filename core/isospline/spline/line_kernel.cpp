#include "isospline/spline/line_filter.h"

// The kernel is compiled once for every instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/spline/line_kernel.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

// Between the two pragmas stands nothing of the standard library: an inline function that the linker shared with other
// files would carry this file's instruction set into them.
HWY_BEFORE_NAMESPACE();
namespace isospline::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <typename Real>
HWY_INLINE void copy_row(const Real* HWY_RESTRICT from, Real* HWY_RESTRICT to)
{
    const hn::ScalableTag<Real> d;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::Store(hn::Load(d, from + lane), d, to + lane);
}

/// row += sum over k < Count of factors[k] before[k * step].
template <int Count, typename Real>
HWY_INLINE void add_rows(Real* HWY_RESTRICT row, const Real* HWY_RESTRICT before, std::ptrdiff_t step,
                         const Real* HWY_RESTRICT factors)
{
    const hn::ScalableTag<Real> d;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d)) {
        auto sum = hn::Load(d, row + lane);
        for (int k = 0; k < Count; ++k)
            sum = hn::MulAdd(hn::Set(d, factors[k]), hn::Load(d, before + k * step + lane), sum);
        hn::Store(sum, d, row + lane);
    }
}

/// Replaces a state that was reached from zero over one whole period by the one that is periodic.
template <typename Real>
HWY_INLINE void make_periodic(const LineFilter<Real>& filter, Real* last, std::ptrdiff_t step)
{
    for (int lane = 0; lane < strip_width; ++lane) {
        Real state[largest_order] = {};
        for (int k = 0; k < filter.order; ++k)
            state[k] = last[lane - k * step];
        for (int i = 0; i < filter.order; ++i) {
            Real sum = 0;
            for (int k = 0; k < filter.order; ++k)
                sum += filter.to_periodic[i][k] * state[k];
            last[lane - i * step] = sum;
        }
    }
}

/// One pass of the recursion, over `count` rows from `first` on in steps of `step`.
template <int Order, typename Real>
HWY_INLINE void recurse(const LineFilter<Real>& filter, Real* first, std::ptrdiff_t step, int count)
{
    const hn::ScalableTag<Real> d;
    for (int k = 1; k <= Order; ++k)
        for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
            hn::Store(hn::Zero(d), d, first - k * step + lane);

    int i = 0;
    if (filter.whole_period) {
        for (; i < filter.extension; ++i)
            add_rows<Order>(first + i * step, first + (i - 1) * step, -step, filter.feedback);
        make_periodic(filter, first + (i - 1) * step, step);
    }
    for (; i < count; ++i)
        add_rows<Order>(first + i * step, first + (i - 1) * step, -step, filter.feedback);
}

template <int Order, typename Real>
HWY_INLINE void forth_and_back(const LineFilter<Real>& filter, Real* begin, Real* end, int forth, int back)
{
    recurse<Order>(filter, begin, std::ptrdiff_t{strip_width}, forth);
    recurse<Order>(filter, end, -std::ptrdiff_t{strip_width}, back);
}

/// Filters the strip whose first sample is in `line`: continues it on both sides, then one pass forth and one back.
template <typename Real>
HWY_INLINE void filter_strip(const LineFilter<Real>& filter, Real* line)
{
    const int margin = filter.extension + filter.reach;
    const std::ptrdiff_t last = filter.size - 1;
    for (std::ptrdiff_t i = 0; i < margin; ++i) {
        copy_row(line + filter.before[i] * strip_width, line - (i + 1) * strip_width);
        copy_row(line + filter.after[i] * strip_width, line + (last + 1 + i) * strip_width);
    }

    Real* const begin = line - margin * strip_width;
    Real* const end = line + (last + margin) * strip_width;
    const int forth = filter.size + 2 * margin;
    const int back = forth - filter.extension;
    switch (filter.order) {
    case 1:
        forth_and_back<1>(filter, begin, end, forth, back);
        break;
    case 2:
        forth_and_back<2>(filter, begin, end, forth, back);
        break;
    case 3:
        forth_and_back<3>(filter, begin, end, forth, back);
        break;
    case 4:
        forth_and_back<4>(filter, begin, end, forth, back);
        break;
    default:
        break;
    }
}

HWY_INLINE void load_row(const float* HWY_RESTRICT from, float* HWY_RESTRICT to)
{
    const hn::ScalableTag<float> d;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::Store(hn::LoadU(d, from + lane), d, to + lane);
}

HWY_INLINE void load_row(const float* HWY_RESTRICT from, double* HWY_RESTRICT to)
{
    const hn::ScalableTag<double> d;
    const hn::Rebind<float, decltype(d)> half;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::Store(hn::PromoteTo(d, hn::LoadU(half, from + lane)), d, to + lane);
}

HWY_INLINE void store_row(const float* HWY_RESTRICT from, float* HWY_RESTRICT to)
{
    const hn::ScalableTag<float> d;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::StoreU(hn::Load(d, from + lane), d, to + lane);
}

HWY_INLINE void store_row(const double* HWY_RESTRICT from, float* HWY_RESTRICT to)
{
    const hn::ScalableTag<double> d;
    const hn::Rebind<float, decltype(d)> half;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::StoreU(hn::DemoteTo(half, hn::Load(d, from + lane)), half, to + lane);
}

/// The numerator at row `i`: what is to be stored, in `weighted`, or the row itself where there is no numerator.
template <typename Real>
HWY_INLINE const Real* finished_row(const LineFilter<Real>& filter, const Real* row, Real* weighted)
{
    if (filter.reach == 0)
        return row;
    for (int lane = 0; lane < strip_width; ++lane) {
        Real sum = filter.numerator[0] * row[lane];
        for (std::ptrdiff_t k = 1; k <= filter.reach; ++k)
            sum += filter.numerator[k] * (row[lane - k * strip_width] + row[lane + k * strip_width]);
        weighted[lane] = sum;
    }
    return weighted;
}

template <typename Real>
HWY_INLINE Real* line_in(const LineFilter<Real>& filter, Real* buffer)
{
    return buffer + (filter.order + filter.extension + filter.reach) * strip_width;
}

template <typename Real>
HWY_INLINE void columns(const LineFilter<Real>& filter, float* first, std::ptrdiff_t stride, int count, Real* buffer)
{
    Real* const line = line_in(filter, buffer);
    for (std::ptrdiff_t i = 0; i < filter.size; ++i) {
        Real* const row = line + i * strip_width;
        if (count == strip_width) {
            load_row(first + i * stride, row);
        } else {
            for (int lane = 0; lane < strip_width; ++lane)
                row[lane] = lane < count ? static_cast<Real>(first[i * stride + lane]) : Real(0);
        }
    }

    filter_strip(filter, line);

    HWY_ALIGN Real weighted[strip_width];
    for (std::ptrdiff_t i = 0; i < filter.size; ++i) {
        const Real* const row = finished_row(filter, line + i * strip_width, weighted);
        if (count == strip_width) {
            store_row(row, first + i * stride);
        } else {
            for (int lane = 0; lane < count; ++lane)
                first[i * stride + lane] = static_cast<float>(row[lane]);
        }
    }
}

#if HWY_TARGET != HWY_SCALAR
/// Transposes 4 x 4 numbers from rows `from_stride` apart to rows `to_stride` apart.
HWY_INLINE void transpose_4x4(const float* HWY_RESTRICT from, std::ptrdiff_t from_stride, float* HWY_RESTRICT to,
                              std::ptrdiff_t to_stride)
{
    const hn::FixedTag<float, 4> d;
    const auto a = hn::LoadU(d, from);
    const auto b = hn::LoadU(d, from + from_stride);
    const auto c = hn::LoadU(d, from + 2 * from_stride);
    const auto e = hn::LoadU(d, from + 3 * from_stride);
    const auto ab_lower = hn::InterleaveLower(d, a, b);
    const auto ab_upper = hn::InterleaveUpper(d, a, b);
    const auto ce_lower = hn::InterleaveLower(d, c, e);
    const auto ce_upper = hn::InterleaveUpper(d, c, e);
    hn::StoreU(hn::ConcatLowerLower(d, ce_lower, ab_lower), d, to);
    hn::StoreU(hn::ConcatUpperUpper(d, ce_lower, ab_lower), d, to + to_stride);
    hn::StoreU(hn::ConcatLowerLower(d, ce_upper, ab_upper), d, to + 2 * to_stride);
    hn::StoreU(hn::ConcatUpperUpper(d, ce_upper, ab_upper), d, to + 3 * to_stride);
}
#endif

template <typename From, typename To>
HWY_INLINE void transpose(const From* HWY_RESTRICT from, std::ptrdiff_t from_stride, To* HWY_RESTRICT to,
                          std::ptrdiff_t to_stride, int rows, int columns)
{
    for (std::ptrdiff_t column = 0; column < columns; ++column)
        for (std::ptrdiff_t row = 0; row < rows; ++row)
            to[column * to_stride + row] = static_cast<To>(from[row * from_stride + column]);
}

HWY_INLINE void transpose(const float* HWY_RESTRICT from, std::ptrdiff_t from_stride, float* HWY_RESTRICT to,
                          std::ptrdiff_t to_stride, int rows, int columns)
{
#if HWY_TARGET == HWY_SCALAR
    transpose<float, float>(from, from_stride, to, to_stride, rows, columns);
#else
    const std::ptrdiff_t whole_rows = rows - rows % 4;
    const std::ptrdiff_t whole_columns = columns - columns % 4;
    for (std::ptrdiff_t row = 0; row < whole_rows; row += 4)
        for (std::ptrdiff_t column = 0; column < whole_columns; column += 4)
            transpose_4x4(from + row * from_stride + column, from_stride, to + column * to_stride + row, to_stride);
    transpose<float, float>(from + whole_rows * from_stride, from_stride, to + whole_rows, to_stride, rows % 4,
                            columns);
    transpose<float, float>(from + whole_columns, from_stride, to + whole_columns * to_stride, to_stride,
                            static_cast<int>(whole_rows), columns % 4);
#endif
}

template <typename Real>
HWY_INLINE void rows(const LineFilter<Real>& filter, float* first, std::ptrdiff_t stride, int count, Real* buffer)
{
    Real* const line = line_in(filter, buffer);
    transpose(first, stride, line, std::ptrdiff_t{strip_width}, count, filter.size);
    for (std::ptrdiff_t i = 0; i < filter.size; ++i)
        for (int lane = count; lane < strip_width; ++lane)
            line[i * strip_width + lane] = Real(0);

    filter_strip(filter, line);

    if (filter.reach == 0) {
        transpose(line, std::ptrdiff_t{strip_width}, first, stride, filter.size, count);
        return;
    }
    Real weighted[strip_width];
    for (std::ptrdiff_t i = 0; i < filter.size; ++i) {
        finished_row(filter, line + i * strip_width, weighted);
        for (std::ptrdiff_t k = 0; k < count; ++k)
            first[i + k * stride] = static_cast<float>(weighted[k]);
    }
}

void columns_float(const LineFilter<float>& filter, float* first, std::ptrdiff_t stride, int count, float* buffer)
{
    columns(filter, first, stride, count, buffer);
}

void columns_double(const LineFilter<double>& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    columns(filter, first, stride, count, buffer);
}

void rows_float(const LineFilter<float>& filter, float* first, std::ptrdiff_t stride, int count, float* buffer)
{
    rows(filter, first, stride, count, buffer);
}

void rows_double(const LineFilter<double>& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    rows(filter, first, stride, count, buffer);
}

} // namespace isospline::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace isospline::detail {

HWY_EXPORT(columns_float);
HWY_EXPORT(columns_double);
HWY_EXPORT(rows_float);
HWY_EXPORT(rows_double);

void filter_columns(const LineFilter<float>& filter, float* first, std::ptrdiff_t stride, int count, float* buffer)
{
    HWY_DYNAMIC_DISPATCH(columns_float)(filter, first, stride, count, buffer);
}

void filter_columns(const LineFilter<double>& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    HWY_DYNAMIC_DISPATCH(columns_double)(filter, first, stride, count, buffer);
}

void filter_rows(const LineFilter<float>& filter, float* first, std::ptrdiff_t stride, int count, float* buffer)
{
    HWY_DYNAMIC_DISPATCH(rows_float)(filter, first, stride, count, buffer);
}

void filter_rows(const LineFilter<double>& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    HWY_DYNAMIC_DISPATCH(rows_double)(filter, first, stride, count, buffer);
}

} // namespace isospline::detail

#endif
