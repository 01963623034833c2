#include "isospline/shell/signs.h"

#include "isospline/spline/volume.h"

#include <cmath>
#include <limits>

namespace isospline {

namespace {

/// A brick has at most 8 + 3 rows of coefficients along an axis.
constexpr std::size_t most_rows = brick_size + 3;

/// The smallest float not below x: c < x and c < round_up(x) say the same of every float c.
float round_up(double x)
{
    const auto nearest = static_cast<float>(x);
    return nearest < x ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
}

/// Bit i tells whether row[i] < threshold, of `count` coefficients; compilers vectorise the loop for the first eight.
unsigned below(const float* row, int count, float threshold)
{
    unsigned bits = 0;
    int i = 0;
    if (count >= brick_size)
        for (; i < brick_size; ++i)
            bits |= row[i] < threshold ? 1u << i : 0u;
    for (; i < count; ++i)
        bits |= row[i] < threshold ? 1u << i : 0u;
    return bits;
}

/// For the cells of one slice of coefficients: whether any, and whether all, of (n+1)^2 are below the threshold.
struct Slice {
    std::uint64_t any = 0;
    std::uint64_t all = 0;
};

Slice slice_signs(const float* first_row, std::ptrdiff_t row_stride, const Brick& brick, int degree, float threshold)
{
    // Along x: cell x reads the coefficients x ... x + n.
    std::array<std::uint8_t, most_rows> any_in_row{}, all_in_row{};
    for (int y = 0; y < brick.size.y + degree; ++y) {
        const unsigned bits = below(first_row + y * row_stride, brick.size.x + degree, threshold);
        unsigned any = bits, all = bits;
        for (int shift = 1; shift <= degree; ++shift) {
            any |= bits >> shift;
            all &= bits >> shift;
        }
        any_in_row[static_cast<std::size_t>(y)] = static_cast<std::uint8_t>(any);
        all_in_row[static_cast<std::size_t>(y)] = static_cast<std::uint8_t>(all);
    }

    // Along y.
    Slice slice;
    for (int y = 0; y < brick.size.y; ++y) {
        unsigned any = 0, all = 0xff;
        for (int j = y; j <= y + degree; ++j) {
            any |= any_in_row[static_cast<std::size_t>(j)];
            all &= all_in_row[static_cast<std::size_t>(j)];
        }
        slice.any |= std::uint64_t(any) << (brick_size * y);
        slice.all |= std::uint64_t(all) << (brick_size * y);
    }
    return slice;
}

} // namespace

BrickCells mixed_cells(const Volume& volume, const Brick& brick, double threshold)
{
    const int degree = volume.degree();
    const float limit = round_up(threshold);
    const float* first = volume.cell_coefficients(brick.first.x, brick.first.y, brick.first.z);

    std::array<Slice, most_rows> slices;
    for (int z = 0; z < brick.size.z + degree; ++z)
        slices[static_cast<std::size_t>(z)] =
            slice_signs(first + z * volume.slice_stride(), volume.row_stride(), brick, degree, limit);

    // Along z. Rows shorter than eight cells have left bits that are no cells.
    // A brick is 1 to 8 cells wide. NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult)
    const std::uint64_t cells_of_row = (1u << brick.size.x) - 1u;
    const std::uint64_t valid = cells_of_row * 0x0101010101010101u;
    BrickCells cells{};
    for (int z = 0; z < brick.size.z; ++z) {
        std::uint64_t any = 0, all = ~std::uint64_t(0);
        for (int k = z; k <= z + degree; ++k) {
            any |= slices[static_cast<std::size_t>(k)].any;
            all &= slices[static_cast<std::size_t>(k)].all;
        }
        cells[static_cast<std::size_t>(z)] = any & ~all & valid;
    }
    return cells;
}

} // namespace isospline
