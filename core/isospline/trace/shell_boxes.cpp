#include "isospline/trace/brick_trace.h"

#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>

namespace isospline {

namespace {

/// Appends the cubes of a brick, an eighth of it or less, that contain any of its cells.
void append(const BrickCells& cells, ShellBox box, int halvings, std::vector<ShellBox>& boxes)
{
    std::uint64_t blocks = 0;
    for (int block = 0; block < blocks_per_brick; ++block)
        blocks |= static_cast<std::uint64_t>(cells_of_block(cells, block) != 0) << block;
    box.halvings = static_cast<std::uint8_t>(halvings);
    for (int block = 0; block < blocks_per_brick; ++block) {
        const bool begins_cube = (block & 0b010101) == 0;
        if ((blocks >> block & (halvings == 2 ? cube_of_blocks : 1)) == 0 || (halvings == 2 && !begins_cube))
            continue;
        box.block = static_cast<std::uint8_t>(block);
        if (halvings < 4) {
            boxes.push_back(box);
            continue;
        }
        for (unsigned rest = cells_of_block(cells, block); rest != 0; rest &= rest - 1u) {
            box.cell = static_cast<std::uint8_t>(std::countr_zero(rest));
            boxes.push_back(box);
        }
    }
}

/// Extends [lower, upper) of a box along one axis to the slabs of a brick whose bits are set.
void extend(ShellBox& box, std::size_t axis, unsigned slabs, int first_of_brick)
{
    const int lower = first_of_brick + 2 * std::countr_zero(slabs), upper = first_of_brick + 2 * std::bit_width(slabs);
    box.lower[axis] = static_cast<std::uint8_t>(std::min<int>(box.lower[axis], lower));
    box.upper[axis] = static_cast<std::uint8_t>(std::max<int>(box.upper[axis], upper));
}

/// The box of the blocks in question of an octet; empty if there are none.
ShellBox box_of_octet(const Bricks& bricks, std::size_t index)
{
    const Octet& octet = bricks.octets()[index];
    ShellBox box{{2 * brick_size, 2 * brick_size, 2 * brick_size}, {0, 0, 0}, static_cast<std::uint32_t>(index)};
    for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u) {
        const int child = std::countr_zero(rest);
        const unsigned slabs = bricks.slabs_in_question(octet, child);
        const unsigned along[3] = {slabs & 0xfu, slabs >> 4 & 0xfu, slabs >> 8};
        if (along[0] == 0 || along[1] == 0 || along[2] == 0)
            continue;
        const glm::ivec3 first = brick_size * child_position(child);
        for (int axis = 0; axis < 3; ++axis)
            extend(box, static_cast<std::size_t>(axis), along[axis], first[axis]);
    }
    const glm::ivec3 size = bricks.size(octet);
    for (int axis = 0; axis < 3; ++axis)
        box.upper[axis] = static_cast<std::uint8_t>(std::min<int>(box.upper[axis], size[axis]));
    return box;
}

std::vector<ShellBox> octet_boxes(const Bricks& bricks)
{
    std::vector<ShellBox> boxes(bricks.octets().size());
    parallel_for(boxes.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            boxes[i] = box_of_octet(bricks, i);
    });
    std::erase_if(boxes, [](const ShellBox& box) { return box.upper[0] == 0; });
    return boxes;
}

} // namespace

std::vector<ShellBox> shell_boxes(const Bricks& bricks, int halvings)
{
    const std::vector<Octet>& octets = bricks.octets();
    if (halvings == 0)
        return octet_boxes(bricks);
    std::vector<BrickCells> cells(halvings >= 2 ? bricks.count() : 0);
    if (!cells.empty())
        parallel_for(octets.size(), 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                for (unsigned rest = octets[i].bricks; rest != 0; rest &= rest - 1u) {
                    const int child = std::countr_zero(rest);
                    cells[Bricks::number(octets[i], child)] = bricks.cells(bricks.place(octets[i], child));
                }
        });
    std::vector<ShellBox> boxes;
    boxes.reserve(bricks.count());
    for (std::size_t i = 0; i < octets.size(); ++i) {
        ShellBox box{{}, {}, static_cast<std::uint32_t>(i)};
        for (unsigned rest = octets[i].bricks; rest != 0; rest &= rest - 1u) {
            const int child = std::countr_zero(rest);
            box.brick = static_cast<std::uint8_t>(child);
            box.halvings = 1;
            if (halvings == 1)
                boxes.push_back(box);
            else
                append(cells[Bricks::number(octets[i], child)], box, halvings, boxes);
        }
    }
    return boxes;
}

Box bounds_of(const Bricks& bricks, const ShellBox& box)
{
    const Octet& octet = bricks.octets()[box.octet];
    if (box.halvings == 0) {
        const glm::dvec3 first(octet.first[0], octet.first[1], octet.first[2]);
        return {first + glm::dvec3(box.lower[0], box.lower[1], box.lower[2]),
                first + glm::dvec3(box.upper[0], box.upper[1], box.upper[2])};
    }
    const Brick brick = bricks.place(octet, box.brick);
    glm::ivec3 first = brick.first;
    if (box.halvings >= 2)
        first += block_position(box.block);
    if (box.halvings == 4)
        first += child_position(box.cell);
    return {glm::dvec3(first), glm::dvec3(glm::min(first + (16 >> box.halvings), brick.first + brick.size))};
}

} // namespace isospline
