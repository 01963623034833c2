#include "isospline/measure/brick_solid.h"

#include "isospline/math/clipped_box.h"
#include "isospline/math/grid.h"
#include "isospline/math/half_space.h"
#include "isospline/measure/plane_section.h"
#include "isospline/spline/degree.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <vector>

namespace isospline {

namespace {

/// The largest numbers of halvings and of parts of a cell.
constexpr int deepest_part = 30;
constexpr int most_parts = 512;

/// The value of a polynomial at a point of the unit cube.
template <int Degree>
double value_at(const BernsteinBox<Degree>& b, const glm::dvec3& point)
{
    return line_along<Degree>(b, 2, point.x, point.y).value(point.z);
}

/// Whether a polynomial is zero on a whole face of the unit cube.
template <int Degree>
bool has_zero_face(const BernsteinBox<Degree>& b)
{
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true}) {
            const PatchPolynomial face = face_of<Degree>(b, axis, upper);
            if (std::all_of(face.b.begin(), face.b.begin() + static_cast<std::ptrdiff_t>(face.count()),
                            [](double value) { return value == 0.0; }))
                return true;
        }
    return false;
}

/// What a search for the solid has found. `touch`: no more than points and curves where f is the level, or so near to
/// it that this cannot be decided.
enum class Found { nothing, touch, part };

/// Looks for the solid in a part of a cell.
template <int Degree>
struct Search {
    double sign;
    Found enough;  ///< when to stop
    int flat = -1; ///< the axis along which the part has no extent, if there is one
    int part_count = 0;

    /// What a polynomial, f - level on a box, has of the solid in all half-spaces.
    Found operator()(const BernsteinBox<Degree>& b, const Box& box, std::vector<HalfSpace> half_spaces, int depth = 0)
    {
        for (const HalfSpace& half_space : half_spaces)
            if (is_outside(box, half_space))
                return Found::nothing;
        std::erase_if(half_spaces,
                      [&](const HalfSpace& half_space) { return DistanceRange(box, half_space).least >= 0.0; });
        // The corners decide most often, and they are values of f.
        Found found = Found::nothing;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::ivec3 place = child_position(corner);
            const double value = b[bernstein_item<Degree>(Degree * place.x, Degree * place.y, Degree * place.z)];
            const Found of_corner = of_point(value);
            if (of_corner > found && is_kept(box.lower + glm::dvec3(place) * box.size(), half_spaces))
                found = of_corner;
            if (found >= enough)
                return found;
        }
        const auto [least, most] = extremes_of(b);
        if (side_of(least, most, sign) == Side::outside)
            return Found::nothing;
        if (sign > 0.0 && most == 0.0)
            return has_zero_face<Degree>(b) ? Found::part : Found::touch;
        if (!half_spaces.empty()) {
            const std::vector<glm::dvec3> corners = corners_within(box, half_spaces);
            if (corners.empty())
                return Found::nothing;
            const glm::dvec3 size = glm::max(box.size(), std::numeric_limits<double>::min()); // flat boxes
            for (const glm::dvec3& corner : corners)
                found =
                    std::max(found, of_point(value_at<Degree>(b, glm::clamp((corner - box.lower) / size, 0.0, 1.0))));
        }
        if (depth == deepest_part || ++part_count > most_parts)
            return std::max(found, Found::touch);
        const int axis = depth % 3 == flat ? (depth + 1) % 3 : depth % 3;
        for (const bool upper : {false, true}) {
            if (found >= enough)
                return found;
            Box half = box;
            (upper ? half.lower : half.upper)[axis] = box.center()[axis];
            found = std::max(found, (*this)(half_of<Degree>(b, axis, upper), half, half_spaces, depth + 1));
        }
        return found;
    }

    /// At degree 1, coefficients are samples, and a sample at the level is a part of the solid by itself. At other
    /// degrees they are rounded, and that f is the level at a single point means nothing.
    Found of_point(double value) const
    {
        if (side_of(value, value, sign) != Side::inside)
            return Found::nothing;
        return Degree == 1 || value != 0.0 ? Found::part : Found::touch;
    }
    static bool is_kept(const glm::dvec3& point, const std::vector<HalfSpace>& half_spaces)
    {
        return std::all_of(half_spaces.begin(), half_spaces.end(), [&](const HalfSpace& half_space) {
            return glm::dot(half_space.normal, point) >= half_space.offset;
        });
    }
};

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
    to.certain[z] |= bit_of(at);
    to.inside[z] |= bit_of(at);
    for (BrickCells& links : to.links)
        links[z] |= bit_of(at);
}

/// Adds a cell, given the half-spaces whose planes cross it, in lattice space.
template <int Degree>
void add_cell(BrickSolid& to, const CellCoefficients& cell, double sign, const glm::ivec3& at,
              const std::vector<HalfSpace>& crossing)
{
    Side side = side_of<Degree>(cell, sign);
    if (side == Side::outside)
        return;
    BernsteinBox<Degree> b;
    if (side == Side::unknown || !crossing.empty()) {
        b = bernstein_of<Degree>(cell);
        const auto [least, most] = extremes_of(b);
        side = side_of(least, most, sign);
    }
    if (side == Side::outside)
        return;
    if (side == Side::inside && crossing.empty())
        return add_whole_cell(to, at);
    const Box box{cell.lower, cell.lower + 1.0};
    const Found found = Search<Degree>{sign, Found::part}(b, box, crossing);
    if (found == Found::nothing)
        return;
    const auto z = static_cast<std::size_t>(at.z);
    to.cells[z] |= bit_of(at);
    if (found == Found::part)
        to.certain[z] |= bit_of(at);
    for (int axis = 0; axis < 3; ++axis) {
        Box face = box;
        face.lower[axis] = box.upper[axis];
        if (Search<Degree>{sign, Found::touch, axis}(upper_face<Degree>(b, axis), face, crossing) != Found::nothing)
            to.links[static_cast<std::size_t>(axis)][z] |= bit_of(at);
    }
}

/// What the clip leaves of a box.
struct Clipped {
    bool has_any = true;
    std::vector<HalfSpace> crossing; ///< those whose planes cross it
};

Clipped clipped(const Box& box, const std::vector<HalfSpace>& half_spaces)
{
    Clipped found;
    for (const HalfSpace& half_space : half_spaces) {
        const DistanceRange distance(box, half_space);
        found.has_any &= distance.most > plane_margin;
        if (distance.least < -plane_margin)
            found.crossing.push_back(half_space);
    }
    return found;
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

/// The solid in a brick, given the half-spaces whose planes cross it.
template <int Degree>
BrickSolid solid_in(const Solid& solid, const Brick& brick, const std::vector<HalfSpace>& crossing)
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
            const glm::ivec3 at = first + child_position(std::countr_zero(left)), cell = brick.first + at;
            const Clipped clip = clipped(box_of(Brick{cell, glm::ivec3(1)}), crossing);
            if (!clip.has_any)
                continue;
            if (is_known && clip.crossing.empty())
                add_whole_cell(found, at);
            else
                add_cell<Degree>(found, VolumeCell(solid.volume, solid.threshold, cell), solid.sign, at, clip.crossing);
        }
    }
    return found;
}

} // namespace

BrickSolid solid_in(const Solid& solid, const Brick& brick)
{
    const Side side = side_of(solid, brick);
    const Clipped clip = clipped(box_of(brick), solid.planes.clip());
    if (side == Side::outside || !clip.has_any)
        return {};
    if (side == Side::unknown || !clip.crossing.empty())
        return dispatch_degree(solid.volume.degree(),
                               [&](auto degree) { return solid_in<degree>(solid, brick, clip.crossing); });
    BrickSolid found;
    found.cells = found.certain = found.inside = solid.cells.cells(brick);
    found.links.fill(found.cells);
    return found;
}

} // namespace isospline
