#include "isospline/trace/brick_trace.h"

#include "isospline/util/parallel.h"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace isospline {

namespace {

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

} // namespace

std::vector<ShellBox> shell_boxes(const Bricks& bricks)
{
    std::vector<ShellBox> boxes(bricks.octets().size());
    parallel_for(boxes.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            boxes[i] = box_of_octet(bricks, i);
    });
    std::erase_if(boxes, [](const ShellBox& box) { return box.upper[0] == 0; });
    return boxes;
}

Box bounds_of(const Bricks& bricks, const ShellBox& box)
{
    const Octet& octet = bricks.octets()[box.octet];
    const glm::dvec3 first(octet.first[0], octet.first[1], octet.first[2]);
    return {first + glm::dvec3(box.lower[0], box.lower[1], box.lower[2]),
            first + glm::dvec3(box.upper[0], box.upper[1], box.upper[2])};
}

} // namespace isospline
