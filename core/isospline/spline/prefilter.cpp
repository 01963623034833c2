#include "isospline/spline/prefilter.h"

#include "isospline/spline/line_filter.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <new>

namespace isospline {

namespace {

using detail::filter_columns;
using detail::filter_rows;
using detail::inside_index;
using detail::LineFilter;
using detail::strip_width;

/// The number of slices that are read together if x is not the samples' fastest axis. A tile of this many samples along
/// each axis uses every cache line of the input once.
constexpr int tile_size = 16;

bool x_is_fastest(const SampleView& samples)
{
    const auto distance = [&](std::size_t axis) { return std::abs(samples.strides[axis]); };
    return distance(0) <= distance(1) && distance(0) <= distance(2);
}

/// Writes (sample - offset) scale for slices [z_begin, z_end).
void read_slices(const SampleView& samples, int z_begin, int z_end, double offset, double scale,
                 const CoefficientArray& array)
{
    const auto row_at = [&](int x, int y, int z) {
        return array.origin + x + y * array.row_stride + z * array.slice_stride;
    };
    if (x_is_fastest(samples)) {
        for (int z = z_begin; z < z_end; ++z)
            for (int y = 0; y < array.shape.y; ++y)
                read_row(samples, {0, y, z}, array.shape.x, offset, scale, row_at(0, y, z));
        return;
    }
    for (int y_begin = 0; y_begin < array.shape.y; y_begin += tile_size)
        for (int x = 0; x < array.shape.x; x += tile_size)
            for (int z = z_begin; z < z_end; ++z)
                for (int y = y_begin; y < std::min(y_begin + tile_size, array.shape.y); ++y)
                    read_row(samples, {x, y, z}, std::min(tile_size, array.shape.x - x), offset, scale,
                             row_at(x, y, z));
}

/// Fills the padding at both ends of a line of runs of numbers, by copying from inside. The runs are `stride` apart and
/// `count` numbers long.
void pad(float* first, std::ptrdiff_t stride, std::ptrdiff_t count, int size, int padding, Boundary boundary)
{
    for (int i = 1; i <= padding; ++i) {
        std::copy_n(first + inside_index(-i, size, boundary) * stride, count, first - i * stride);
        const int after = size - 1 + i;
        std::copy_n(first + inside_index(after, size, boundary) * stride, count, first + after * stride);
    }
}

/// Numbers that SIMD instructions load and store in whole vectors.
class LineBuffer {
public:
    explicit LineBuffer(std::size_t count)
        : numbers_(static_cast<double*>(::operator new(count * sizeof(double), alignment)))
    {
    }
    double* data() const { return numbers_.get(); }

private:
    static constexpr std::align_val_t alignment{64};
    struct Delete {
        void operator()(double* numbers) const { ::operator delete(numbers, alignment); }
    };
    std::unique_ptr<double, Delete> numbers_;
};

/// Filters of the three axes.
class Prefilter {
public:
    Prefilter(const RecursiveFilter& filter, Boundary boundary, const CoefficientArray& array)
        : array_(array), boundary_(boundary),
          active_(!filter.is_identity()), lines_{LineFilter(filter, array.shape.x, boundary),
                                                 LineFilter(filter, array.shape.y, boundary),
                                                 LineFilter(filter, array.shape.z, boundary)}
    {
        for (int axis = 0; axis < 3; ++axis)
            if (filters(axis))
                gain_ *= filter.gain;
    }

    void run(const SampleView& samples, double offset, const Progress& progress) const
    {
        const auto slab = static_cast<std::size_t>(x_is_fastest(samples) ? 1 : tile_size);
        parallel_for(
            static_cast<std::size_t>(array_.shape.z), slab,
            [&](std::size_t begin, std::size_t end) {
                filter_slices(samples, offset, static_cast<int>(begin), static_cast<int>(end));
            },
            part_of(progress, 0.0, 0.6));

        // The last row's padding need not be filtered.
        const auto count = static_cast<std::size_t>(padded_slice_size() + strip_width - 1) / strip_width;
        if (filters(2) || array_.padding > 0)
            parallel_for(
                count, strips_at_once, [&](std::size_t begin, std::size_t end) { filter_strips(begin, end); },
                part_of(progress, 0.6, 1.0));
    }

private:
    static constexpr std::size_t strips_at_once = 8;

    bool filters(int axis) const { return active_ && array_.shape[axis] > 1; }
    const LineFilter& line(std::size_t axis) const { return lines_[axis]; }

    std::ptrdiff_t padded_slice_size() const { return (array_.shape.y + 2 * array_.padding) * array_.row_stride; }

    /// Filters along x and y, slice by slice: a slice is read, filtered and padded while it is in the cache.
    void filter_slices(const SampleView& samples, double offset, int z_begin, int z_end) const
    {
        read_slices(samples, z_begin, z_end, offset, gain_, array_);
        const LineBuffer buffer(std::max(line(0).buffer_size(), line(1).buffer_size()));
        for (int z = z_begin; z < z_end; ++z) {
            float* const slice = array_.origin + z * array_.slice_stride;
            for (int y = 0; filters(0) && y < array_.shape.y; y += strip_width)
                filter_rows(line(0), slice + y * array_.row_stride, array_.row_stride,
                            std::min(strip_width, array_.shape.y - y), buffer.data());
            for (int y = 0; y < array_.shape.y; ++y)
                pad(slice + y * array_.row_stride, 1, 1, array_.shape.x, array_.padding, boundary_);

            const int width = array_.shape.x + 2 * array_.padding;
            for (int x = 0; filters(1) && x < width; x += strip_width)
                filter_columns(line(1), slice - array_.padding + x, array_.row_stride, std::min(strip_width, width - x),
                               buffer.data());
            pad(slice - array_.padding, array_.row_stride, width, array_.shape.y, array_.padding, boundary_);
        }
    }

    /// Filters along z, in strips of the padded slices.
    void filter_strips(std::size_t begin, std::size_t end) const
    {
        const LineBuffer buffer(line(2).buffer_size());
        float* const slice = array_.origin - array_.padding * (array_.row_stride + 1);
        for (std::size_t strip = begin; strip < end; ++strip) {
            const auto first = static_cast<std::ptrdiff_t>(strip) * strip_width;
            const auto count = std::min<std::ptrdiff_t>(strip_width, padded_slice_size() - first);
            if (filters(2))
                filter_columns(line(2), slice + first, array_.slice_stride, static_cast<int>(count), buffer.data());
            pad(slice + first, array_.slice_stride, count, array_.shape.z, array_.padding, boundary_);
        }
    }

    CoefficientArray array_;
    Boundary boundary_;
    bool active_;
    std::array<LineFilter, 3> lines_;
    double gain_ = 1.0;
};

} // namespace

void compute_coefficients(const SampleView& samples, double offset, const RecursiveFilter& filter, Boundary boundary,
                          const CoefficientArray& coefficients, const Progress& progress)
{
    Prefilter(filter, boundary, coefficients).run(samples, offset, progress);
}

} // namespace isospline
