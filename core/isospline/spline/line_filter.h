// The prefilter of many lines side by side, one line a SIMD lane.
#pragma once

#include "isospline/spline/filter.h"
#include "isospline/spline/filter_design.h"

#include <cstddef>
#include <vector>

namespace isospline::detail {

/// The number of lines that are filtered side by side, as a strip. One row of a strip is one sample of each line.
inline constexpr int strip_width = 64;
inline constexpr int largest_order = 4;

/// The sample that the boundary rule gives for any index `i` of a line of `size` samples.
int inside_index(long long i, int size, Boundary boundary);

/// A filter prepared for lines of one length. The caller applies the gain.
///
/// The recursion is in double precision. A recursion in float32 never forgets its start while samples are constant: it
/// settles at one of several fixed points, or in a cycle of two. Blocks of a volume would then have other coefficients
/// than the whole volume.
///
/// The boundary rule continues each line on both sides, far enough that the zero state at the start has no effect. The
/// continuation is as long as the impulse response, or one whole period of the continued line. After one period, the
/// periodic state is known exactly: s = (1 - A^period)^-1 s_zero, where A is the matrix of the recursion.
struct LineFilter {
    LineFilter(const RecursiveFilter& filter, int line_size, Boundary boundary);
    LineFilter(LineFilter&&) noexcept = default;

    int size;
    int order;
    int reach;     ///< of the numerator
    int extension; ///< on each side, besides `reach`
    bool whole_period;
    double feedback[largest_order] = {};
    double numerator[largest_order + 1] = {};
    double to_periodic[largest_order][largest_order] = {};
    const int* before; ///< the samples at indices -1, -2, ... by the boundary rule; extension + reach of them
    const int* after;  ///< the samples at indices size, size + 1, ... by the boundary rule

    /// The count of numbers in the buffer of one strip: state, extension, lines, extension, state.
    std::size_t buffer_size() const
    {
        return static_cast<std::size_t>(size + 2 * (extension + reach + order)) * strip_width;
    }

private:
    std::vector<int> continuation_;
};

/// Filters, in place, at most strip_width lines that lie side by side: sample i of line k is at first[i * stride + k].
/// `buffer` is aligned to 64 bytes and holds filter.buffer_size() numbers.
void filter_columns(const LineFilter& filter, float* first, std::ptrdiff_t stride, int count, double* buffer);

/// The same for lines along memory: sample i of line k is at first[i + k * stride].
void filter_rows(const LineFilter& filter, float* first, std::ptrdiff_t stride, int count, double* buffer);

} // namespace isospline::detail
