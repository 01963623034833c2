#include "isospline/brick/ranges.h"

#include "isospline/math/grid.h"
#include "isospline/spline/volume.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <limits>

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

    BrickRanges::Range range() const
    {
        return {*std::min_element(lower, lower + Count), *std::max_element(upper, upper + Count)};
    }
};

/// The range of a box of coefficients, taken in strips of `Count` along x, of which the last overlaps those before.
template <int Count>
BrickRanges::Range range_of_coefficients(const float* first, const Volume& volume, const glm::ivec3& size)
{
    BrickRanges::Range range{*first, *first};
    for (int x = 0; x < size.x; x += Count) {
        const float* corner = first + std::min(x, size.x - Count);
        Columns<Count> columns(corner);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                columns.extend(corner + y * volume.row_stride() + z * volume.slice_stride());
        const BrickRanges::Range strip = columns.range();
        range = {std::min(range.lower, strip.lower), std::max(range.upper, strip.upper)};
    }
    return range;
}

} // namespace

BrickRanges::BrickRanges(const Volume& volume) : shape_(octet_shape(volume.cell_shape()))
{
    const glm::ivec3 cell_shape = volume.cell_shape();
    const glm::vec<3, std::size_t> shape(shape_);
    octets_.resize(shape.x * shape.y * shape.z);
    parallel_for(octets_.size(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index)
            for (int child = 0; child < 8; ++child) {
                const glm::ivec3 position = 2 * at_place(shape_, index) + child_position(child);
                const Brick brick = brick_at(cell_shape, position);
                Range range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
                if (brick.size.x > 0 && brick.size.y > 0 && brick.size.z > 0) {
                    const float* first = volume.cell_coefficients(brick.first.x, brick.first.y, brick.first.z);
                    const glm::ivec3 size = brick.size + volume.degree();
                    range = size.x >= 4 ? range_of_coefficients<4>(first, volume, size)
                                        : range_of_coefficients<1>(first, volume, size);
                }
                const auto at = static_cast<std::size_t>(child);
                octets_[index].lower[at] = range.lower;
                octets_[index].upper[at] = range.upper;
            }
    });
}

unsigned BrickRanges::straddling(std::size_t octet, double threshold) const
{
    unsigned bricks = 0;
    for (std::size_t child = 0; child < 8; ++child)
        bricks |= static_cast<unsigned>(octets_[octet].brick(child).straddles(threshold)) << child;
    return bricks;
}

} // namespace isospline
