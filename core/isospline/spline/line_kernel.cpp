#include "isospline/spline/line_filter.h"

// The kernel is compiled once for every instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/spline/line_kernel.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

// Nothing of the standard library is included or instantiated in this namespace. The linker shares inline functions
// between files, and would bring this file's instruction set into the others.
HWY_BEFORE_NAMESPACE();
namespace isospline::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE void copy_row(const double* HWY_RESTRICT from, double* HWY_RESTRICT to)
{
    const hn::ScalableTag<double> d;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::Store(hn::Load(d, from + lane), d, to + lane);
}

/// row += sum over k < Count of factors[k] before[k * step].
template <int Count>
HWY_INLINE void add_rows(double* HWY_RESTRICT row, const double* HWY_RESTRICT before, std::ptrdiff_t step,
                         const double* HWY_RESTRICT factors)
{
    const hn::ScalableTag<double> d;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d)) {
        auto sum = hn::Load(d, row + lane);
        for (int k = 0; k < Count; ++k)
            sum = hn::MulAdd(hn::Set(d, factors[k]), hn::Load(d, before + k * step + lane), sum);
        hn::Store(sum, d, row + lane);
    }
}

/// Replaces the state after one whole period from zero by the periodic state.
HWY_INLINE void make_periodic(const LineFilter& filter, double* last, std::ptrdiff_t step)
{
    for (int lane = 0; lane < strip_width; ++lane) {
        double state[largest_order] = {};
        for (int k = 0; k < filter.order; ++k)
            state[k] = last[lane - k * step];
        for (int i = 0; i < filter.order; ++i) {
            double sum = 0;
            for (int k = 0; k < filter.order; ++k)
                sum += filter.to_periodic[i][k] * state[k];
            last[lane - i * step] = sum;
        }
    }
}

/// One pass of the recursion over `count` rows that begin at `first` and are `step` apart.
template <int Order>
HWY_INLINE void recurse(const LineFilter& filter, double* first, std::ptrdiff_t step, int count)
{
    const hn::ScalableTag<double> d;
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

template <int Order>
HWY_INLINE void forth_and_back(const LineFilter& filter, double* begin, double* end, int forth, int back)
{
    recurse<Order>(filter, begin, std::ptrdiff_t{strip_width}, forth);
    recurse<Order>(filter, end, -std::ptrdiff_t{strip_width}, back);
}

/// Filters the strip whose first sample is in `line`: continues it on both sides, then passes forwards and backwards.
HWY_INLINE void filter_strip(const LineFilter& filter, double* line)
{
    const int margin = filter.extension + filter.reach;
    const std::ptrdiff_t last = filter.size - 1;
    for (std::ptrdiff_t i = 0; i < margin; ++i) {
        copy_row(line + filter.before[i] * strip_width, line - (i + 1) * strip_width);
        copy_row(line + filter.after[i] * strip_width, line + (last + 1 + i) * strip_width);
    }

    double* const begin = line - margin * strip_width;
    double* const end = line + (last + margin) * strip_width;
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

HWY_INLINE void load_row(const float* HWY_RESTRICT from, double* HWY_RESTRICT to)
{
    const hn::ScalableTag<double> d;
    const hn::Rebind<float, decltype(d)> half;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::Store(hn::PromoteTo(d, hn::LoadU(half, from + lane)), d, to + lane);
}

HWY_INLINE void store_row(const double* HWY_RESTRICT from, float* HWY_RESTRICT to)
{
    const hn::ScalableTag<double> d;
    const hn::Rebind<float, decltype(d)> half;
    for (std::size_t lane = 0; lane < strip_width; lane += hn::Lanes(d))
        hn::StoreU(hn::DemoteTo(half, hn::Load(d, from + lane)), half, to + lane);
}

/// Applies the numerator to row `i`. Returns the row to be stored: `weighted`, or the row itself if there is no
/// numerator.
HWY_INLINE const double* finished_row(const LineFilter& filter, const double* row, double* weighted)
{
    if (filter.reach == 0)
        return row;
    for (int lane = 0; lane < strip_width; ++lane) {
        double sum = filter.numerator[0] * row[lane];
        for (std::ptrdiff_t k = 1; k <= filter.reach; ++k)
            sum += filter.numerator[k] * (row[lane - k * strip_width] + row[lane + k * strip_width]);
        weighted[lane] = sum;
    }
    return weighted;
}

HWY_INLINE double* line_in(const LineFilter& filter, double* buffer)
{
    return buffer + (filter.order + filter.extension + filter.reach) * strip_width;
}

void columns(const LineFilter& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    double* const line = line_in(filter, buffer);
    for (std::ptrdiff_t i = 0; i < filter.size; ++i) {
        double* const row = line + i * strip_width;
        if (count == strip_width) {
            load_row(first + i * stride, row);
        } else {
            for (int lane = 0; lane < strip_width; ++lane)
                row[lane] = lane < count ? static_cast<double>(first[i * stride + lane]) : double(0);
        }
    }

    filter_strip(filter, line);

    HWY_ALIGN double weighted[strip_width];
    for (std::ptrdiff_t i = 0; i < filter.size; ++i) {
        const double* const row = finished_row(filter, line + i * strip_width, weighted);
        if (count == strip_width) {
            store_row(row, first + i * stride);
        } else {
            for (int lane = 0; lane < count; ++lane)
                first[i * stride + lane] = static_cast<float>(row[lane]);
        }
    }
}

template <typename From, typename To>
HWY_INLINE void transpose(const From* HWY_RESTRICT from, std::ptrdiff_t from_stride, To* HWY_RESTRICT to,
                          std::ptrdiff_t to_stride, int rows, int columns)
{
    for (std::ptrdiff_t column = 0; column < columns; ++column)
        for (std::ptrdiff_t row = 0; row < rows; ++row)
            to[column * to_stride + row] = static_cast<To>(from[row * from_stride + column]);
}

void rows(const LineFilter& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    double* const line = line_in(filter, buffer);
    transpose(first, stride, line, std::ptrdiff_t{strip_width}, count, filter.size);
    for (std::ptrdiff_t i = 0; i < filter.size; ++i)
        for (int lane = count; lane < strip_width; ++lane)
            line[i * strip_width + lane] = double(0);

    filter_strip(filter, line);

    if (filter.reach == 0) {
        transpose(line, std::ptrdiff_t{strip_width}, first, stride, filter.size, count);
        return;
    }
    double weighted[strip_width];
    for (std::ptrdiff_t i = 0; i < filter.size; ++i) {
        finished_row(filter, line + i * strip_width, weighted);
        for (std::ptrdiff_t k = 0; k < count; ++k)
            first[i + k * stride] = static_cast<float>(weighted[k]);
    }
}

} // namespace isospline::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace isospline::detail {

HWY_EXPORT(columns);
HWY_EXPORT(rows);

void filter_columns(const LineFilter& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    HWY_DYNAMIC_DISPATCH(columns)(filter, first, stride, count, buffer);
}

void filter_rows(const LineFilter& filter, float* first, std::ptrdiff_t stride, int count, double* buffer)
{
    HWY_DYNAMIC_DISPATCH(rows)(filter, first, stride, count, buffer);
}

} // namespace isospline::detail

#endif
