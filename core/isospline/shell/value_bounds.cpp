#include "isospline/shell/value_bounds.h"

#include "isospline/util/parallel.h"

#include <algorithm>

namespace isospline {

namespace {

/// Extremes of each of `Count` columns of coefficients, in a form that compilers vectorise.
template <int Count>
struct Columns {
    float lower[Count];
    float upper[Count];

    explicit Columns(const float* row)
    {
        std::copy_n(row, Count, lower);
        std::copy_n(row, Count, upper);
    }

    void extend(const float* row)
    {
        for (int i = 0; i < Count; ++i)
            lower[i] = row[i] < lower[i] ? row[i] : lower[i];
        for (int i = 0; i < Count; ++i)
            upper[i] = row[i] > upper[i] ? row[i] : upper[i];
    }

    ValueBounds::Range range() const
    {
        return {*std::min_element(lower, lower + Count), *std::max_element(upper, upper + Count)};
    }
};

/// The range of a block of coefficients, taken in strips of `Count` along x, of which the last overlaps those before.
template <int Count>
ValueBounds::Range range_of_block(const float* first, const Volume& volume, const glm::ivec3& size)
{
    ValueBounds::Range range{*first, *first};
    for (int x = 0; x < size.x; x += Count) {
        const float* corner = first + std::min(x, size.x - Count);
        Columns<Count> columns(corner);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                columns.extend(corner + y * volume.row_stride() + z * volume.slice_stride());
        const ValueBounds::Range strip = columns.range();
        range = {std::min(range.lower, strip.lower), std::max(range.upper, strip.upper)};
    }
    return range;
}

} // namespace

ValueBounds::ValueBounds(const Volume& volume) : shape_(brick_shape(volume.cell_shape()))
{
    const glm::ivec3 cell_shape = volume.cell_shape();
    const glm::vec<3, std::size_t> shape(shape_);
    ranges_.resize(shape.x * shape.y * shape.z);
    parallel_for(ranges_.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index) {
            const Brick brick = brick_at(cell_shape, index);
            const float* first = volume.cell_coefficients(brick.first.x, brick.first.y, brick.first.z);
            const glm::ivec3 size = brick.size + volume.degree();
            ranges_[index] =
                size.x >= 4 ? range_of_block<4>(first, volume, size) : range_of_block<1>(first, volume, size);
        }
    });
}

} // namespace isospline
