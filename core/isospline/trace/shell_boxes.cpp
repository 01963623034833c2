#include "isospline/trace/brick_trace.h"

#include "isospline/util/parallel.h"

#include <glm/common.hpp>

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

} // namespace

std::vector<ShellBox> shell_boxes(const Bricks& bricks, int halvings)
{
    const std::vector<Octet>& octets = bricks.octets();
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
    boxes.reserve(halvings == 0 ? octets.size() : bricks.count());
    for (std::size_t i = 0; i < octets.size(); ++i) {
        ShellBox box{static_cast<std::uint32_t>(i)};
        if (halvings == 0) {
            boxes.push_back(box);
            continue;
        }
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
        Box bounds;
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u) {
            const Brick brick = bricks.place(octet, std::countr_zero(rest));
            bounds.extend(Box{glm::dvec3(brick.first), glm::dvec3(brick.first + brick.size)});
        }
        return bounds;
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
