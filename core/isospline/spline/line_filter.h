// The prefilter of many lines side by side, one a SIMD lane.
#pragma once

#include "isospline/spline/filter.h"
#include "isospline/spline/filter_design.h"

#include <cstddef>
#include <vector>

namespace isospline::detail {

/// Lines that are filtered side by side. One row of a strip is one sample of each.
inline constexpr int strip_width = 64;
inline constexpr int largest_order = 4;

/// The sample that index `i` of a line of `size` samples stands for by the boundary rule, for any i.
int inside_index(long long i, int size, Boundary boundary);

/// A filter made ready for lines of one length; `Real` is the number type of the recursion. The gain is left to the
/// caller.
///
/// Each line is continued on both sides by the boundary rule, far enough for the recursion to forget that it began
/// with zeros: by as many samples as its impulse response needs, or by one whole period of the continued line, after
/// which the state that is periodic is known exactly, s = (1 - A^period)^-1 s_zero with the recursion's matrix A.
template <typename Real>
struct LineFilter {
    LineFilter(const RecursiveFilter& filter, int line_size, Boundary boundary);
    LineFilter(LineFilter&&) noexcept = default;

    int size;
    int order;
    int reach;     ///< of the numerator
    int extension; ///< on each side, besides `reach`
    bool whole_period;
    Real feedback[largest_order] = {};
    Real numerator[largest_order + 1] = {};
    Real to_periodic[largest_order][largest_order] = {};
    const int* before; ///< the samples that stand for indices -1, -2, ..., extension + reach of them
    const int* after;  ///< the samples that stand for indices size, size + 1, ...

    /// Numbers that the buffer of one strip holds: state, extension, lines, extension, state.
    std::size_t buffer_size() const
    {
        return static_cast<std::size_t>(size + 2 * (extension + reach + order)) * strip_width;
    }

private:
    std::vector<int> continuation_;
};

extern template struct LineFilter<float>;
extern template struct LineFilter<double>;

/// Filters, in place, at most strip_width lines that lie side by side: sample i of line k is at first[i * stride + k].
/// `buffer` is aligned to 64 bytes and holds filter.buffer_size() numbers.
void filter_columns(const LineFilter<float>& filter, float* first, std::ptrdiff_t stride, int count, float* buffer);
void filter_columns(const LineFilter<double>& filter, float* first, std::ptrdiff_t stride, int count, double* buffer);

/// The same for lines along memory: sample i of line k is at first[i + k * stride].
void filter_rows(const LineFilter<float>& filter, float* first, std::ptrdiff_t stride, int count, float* buffer);
void filter_rows(const LineFilter<double>& filter, float* first, std::ptrdiff_t stride, int count, double* buffer);

} // namespace isospline::detail
