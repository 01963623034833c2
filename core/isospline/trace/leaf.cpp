#include "isospline/trace/brick_trace.h"

#include "isospline/shell/prune.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <span>

namespace isospline {

namespace {

/// Levels of subdivision. A third level removes few more cells and takes longer than it saves.
constexpr int prune_depth = 2;

/// Octets that one task takes together, so that the subdivision fills SIMD lanes.
constexpr std::size_t chunk_size = 4;

void append_leaves(const Volume& volume, const Bricks& bricks, std::span<const Octet> octets, std::vector<Leaf>& leaves)
{
    std::vector<Brick> places;
    std::vector<BrickCells> cells;
    for (const Octet& octet : octets)
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u) {
            places.push_back(bricks.place(octet, std::countr_zero(rest)));
            cells.push_back(bricks.cells(places.back()));
        }
    prune_beyond_rounding(volume, bricks.threshold(), prune_depth, places, cells);
    for (std::size_t i = 0; i < places.size(); ++i)
        for (int block = 0; block < blocks_per_brick; ++block) {
            const std::uint8_t of_block = cells_of_block(cells[i], block);
            if (of_block == 0)
                continue;
            const glm::ivec3 first = places[i].first + block_position(block);
            const float* const coefficients = volume.cell_coefficients(first.x, first.y, first.z);
            const Leaf leaf{make_block({coefficients, volume.row_stride(), volume.slice_stride()}, volume.degree(),
                                       bricks.threshold(), of_block),
                            {static_cast<std::uint16_t>(first.x), static_cast<std::uint16_t>(first.y),
                             static_cast<std::uint16_t>(first.z)},
                            coefficients};
            if (leaf.block.cells != 0)
                leaves.push_back(leaf);
        }
}

} // namespace

Leaves::Leaves(const Volume& volume, const Bricks& bricks, const Progress& progress)
    : degree_(volume.degree()), threshold_(bricks.threshold()), row_stride_(volume.row_stride()),
      slice_stride_(volume.slice_stride())
{
    const std::span<const Octet> octets = bricks.octets();
    std::vector<std::vector<Leaf>> chunks((octets.size() + chunk_size - 1) / chunk_size);
    parallel_for(
        chunks.size(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t chunk = begin; chunk < end; ++chunk)
                append_leaves(
                    volume, bricks,
                    octets.subspan(chunk * chunk_size, std::min(chunk_size, octets.size() - chunk * chunk_size)),
                    chunks[chunk]);
        },
        progress);
    std::size_t count = 0;
    for (const std::vector<Leaf>& chunk : chunks)
        count += chunk.size();
    leaves_.reserve(count);
    for (const std::vector<Leaf>& chunk : chunks)
        leaves_.insert(leaves_.end(), chunk.begin(), chunk.end());
}

Box bounds_of(const Leaf& leaf)
{
    Box bounds;
    for (unsigned rest = leaf.block.cells; rest != 0; rest &= rest - 1u) {
        const int cell = std::countr_zero(rest);
        const auto i = static_cast<std::size_t>(cell);
        const double slab_lower = leaf.block.slab_lower[i], slab_upper = leaf.block.slab_upper[i];
        const glm::dvec3 normal(leaf.block.slab_normal[0][i], leaf.block.slab_normal[1][i],
                                leaf.block.slab_normal[2][i]);
        // The other two axes add between the sum of their negative and that of their positive components.
        const glm::dvec3 least = glm::min(normal, 0.0), most = glm::max(normal, 0.0);
        const double sum_of_least = least.x + least.y + least.z, sum_of_most = most.x + most.y + most.z;
        glm::dvec3 lower(0.0), upper(1.0);
        for (int axis = 0; axis < 3; ++axis) {
            if (normal[axis] == 0.0)
                continue;
            const double from = (slab_lower - (sum_of_most - most[axis])) / normal[axis];
            const double to = (slab_upper - (sum_of_least - least[axis])) / normal[axis];
            lower[axis] = std::clamp(std::min(from, to), 0.0, 1.0);
            upper[axis] = std::clamp(std::max(from, to), 0.0, 1.0);
        }
        const glm::dvec3 corner(leaf.first_cell() + child_position(cell));
        bounds.extend(Box{corner + lower, corner + upper});
    }
    return bounds;
}

} // namespace isospline
