#include "isospline/measure/brick_solid.h"

#include "isospline/math/grid.h"
#include "isospline/spline/degree.h"

namespace isospline {

namespace {

/// The largest numbers of halvings and of parts of a cell.
constexpr int deepest_part = 30;
constexpr int most_parts = 512;

/// Whether a polynomial, f - level, is anywhere in the solid; true if that cannot be decided. Along axis `flat`, if
/// there is one, the coefficients are constant.
template <int Degree>
bool is_anywhere_inside(const BernsteinBox<Degree>& b, double sign, int flat, int depth, int& part_count)
{
    // The corners decide most often, and they are values of f.
    for (int corner = 0; corner < 8; ++corner)
        if (const double value =
                b[bernstein_item<Degree>(Degree * (corner & 1), Degree * (corner >> 1 & 1), Degree * (corner >> 2))];
            side_of(value, value, sign) == Side::inside)
            return true;
    const auto [least, most] = extremes_of(b);
    if (side_of(least, most, sign) == Side::outside)
        return false;
    if (depth == deepest_part || ++part_count > most_parts)
        return true;
    const int axis = depth % 3 == flat ? (depth + 1) % 3 : depth % 3;
    for (const bool upper : {false, true})
        if (is_anywhere_inside<Degree>(half_of<Degree>(b, axis, upper), sign, flat, depth + 1, part_count))
            return true;
    return false;
}

template <int Degree>
bool is_anywhere_inside(const BernsteinBox<Degree>& b, double sign, int flat = -1)
{
    int part_count = 0;
    return is_anywhere_inside<Degree>(b, sign, flat, 0, part_count);
}

/// The polynomial on the upper face of an axis, as a polynomial of three variables.
template <int Degree>
BernsteinBox<Degree> upper_face(BernsteinBox<Degree> b, int axis)
{
    map_rows<Degree>(b, axis, [](Bernstein<Degree>& row) { row.fill(row[Degree]); });
    return b;
}

void add_whole_cell(BrickSolid& to, const glm::ivec3& at)
{
    const auto z = static_cast<std::size_t>(at.z);
    to.cells[z] |= bit_of(at);
    to.inside[z] |= bit_of(at);
    for (BrickCells& links : to.links)
        links[z] |= bit_of(at);
}

template <int Degree>
void add_cell(BrickSolid& to, const CellCoefficients& cell, double sign, const glm::ivec3& at)
{
    Side side = side_of<Degree>(cell, sign);
    BernsteinBox<Degree> b;
    if (side == Side::unknown) {
        b = bernstein_of<Degree>(cell);
        const auto [least, most] = extremes_of(b);
        side = side_of(least, most, sign);
    }
    if (side == Side::outside)
        return;
    if (side == Side::inside)
        return add_whole_cell(to, at);
    if (!is_anywhere_inside<Degree>(b, sign))
        return;
    const auto z = static_cast<std::size_t>(at.z);
    to.cells[z] |= bit_of(at);
    for (int axis = 0; axis < 3; ++axis)
        if (is_anywhere_inside<Degree>(upper_face<Degree>(b, axis), sign, axis))
            to.links[static_cast<std::size_t>(axis)][z] |= bit_of(at);
}

/// The blocks of a brick that may have the surface in them.
std::uint64_t blocks_in_question(const Solid& solid, const Brick& brick)
{
    if (!solid.ranges.has_blocks())
        return ~std::uint64_t{0};
    const glm::ivec3 at = brick.first / brick_size, child = at - 2 * (at / 2);
    return solid.ranges.straddling_blocks(static_cast<std::size_t>(place_in(solid.ranges.shape(), at / 2)),
                                          child.x + 2 * child.y + 4 * child.z, solid.threshold);
}

template <int Degree>
BrickSolid solid_in(const Solid& solid, const Brick& brick)
{
    BrickSolid found;
    const BrickCells cells = solid.cells.cells(brick);
    const std::uint64_t in_question = blocks_in_question(solid, brick);
    for (int block = 0; block < blocks_per_brick; ++block) {
        const unsigned of_block = cells_of_block(cells, block);
        if (of_block == 0)
            continue;
        const glm::ivec3 first = block_position(block);
        const bool is_known = (in_question >> block & 1u) == 0;
        if (is_known) { // one value decides
            const VolumeCell cell(solid.volume, solid.threshold, brick.first + first);
            const double corner = bernstein_of<Degree>(cell)[0];
            if (side_of(corner, corner, solid.sign) == Side::outside)
                continue;
        }
        for (unsigned left = of_block; left != 0; left &= left - 1u) {
            const glm::ivec3 at = first + child_position(std::countr_zero(left));
            if (is_known)
                add_whole_cell(found, at);
            else
                add_cell<Degree>(found, VolumeCell(solid.volume, solid.threshold, brick.first + at), solid.sign, at);
        }
    }
    return found;
}

} // namespace

BrickSolid solid_in(const Solid& solid, const Brick& brick)
{
    const Side side = side_of(solid, brick);
    if (side == Side::unknown)
        return dispatch_degree(solid.volume.degree(), [&](auto degree) { return solid_in<degree>(solid, brick); });
    BrickSolid found;
    if (side == Side::inside) {
        found.cells = found.inside = solid.cells.cells(brick);
        found.links.fill(found.cells);
    }
    return found;
}

} // namespace isospline
