// Bricks of 8 x 8 x 8 cells, and sets of the cells of a brick.
#pragma once

#include "isospline/math/box.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace isospline {

/// The indices of a cell; a volume has at most 65535 cells along an axis.
struct Cell {
    std::uint16_t x, y, z;
    bool operator==(const Cell&) const = default;
    operator glm::ivec3() const { return {x, y, z}; }
};

/// Cells along an edge of a brick.
inline constexpr int brick_size = 8;

/// A brick's place in the grid of cells; `size` is less than 8 along an axis where the grid ends.
struct Brick {
    glm::ivec3 first;
    glm::ivec3 size;
};

/// The box of a brick's cells, in lattice space.
inline Box box_of(const Brick& brick)
{
    return {glm::dvec3(brick.first), glm::dvec3(brick.first + brick.size)};
}

/// Bricks along x, y, z of a grid of cells.
inline glm::ivec3 brick_shape(const glm::ivec3& cell_shape)
{
    return (cell_shape + (brick_size - 1)) / brick_size;
}

/// The brick at a place in the grid of bricks.
inline Brick brick_at(const glm::ivec3& cell_shape, const glm::ivec3& position)
{
    const glm::ivec3 first = position * brick_size;
    return {first, glm::min(cell_shape - first, glm::ivec3(brick_size))};
}

/// The position of child i among the 2 x 2 x 2 children of a cube: bits 0, 1, 2 of i are its place along x, y, z.
inline glm::ivec3 child_position(int i)
{
    return {i & 1, i >> 1 & 1, i >> 2 & 1};
}

/// Octets along x, y, z: an octet is a cube of 2 x 2 x 2 bricks.
inline glm::ivec3 octet_shape(const glm::ivec3& cell_shape)
{
    return (brick_shape(cell_shape) + 1) / 2;
}

/// A set of the cells of a brick: cell (x, y, z) of the brick is bit x + 8 y of word z.
using BrickCells = std::array<std::uint64_t, brick_size>;

/// All cells of a brick of this size.
inline BrickCells all_cells(const glm::ivec3& size)
{
    const std::uint64_t of_row = (std::uint64_t{1} << size.x) - 1u;
    const std::uint64_t of_slice = ~std::uint64_t{0} >> brick_size * (brick_size - size.y);
    BrickCells cells{};
    for (int z = 0; z < size.z; ++z)
        cells[static_cast<std::size_t>(z)] = of_row * 0x0101010101010101u & of_slice;
    return cells;
}

/// Calls `visit(x, y, z)`, counted from the brick's first cell, for each cell of a set; x varies fastest.
template <typename Visit>
void for_each_cell(const BrickCells& cells, Visit visit)
{
    for (int z = 0; z < brick_size; ++z)
        for (std::uint64_t left = cells[static_cast<std::size_t>(z)]; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            visit(bit % brick_size, bit / brick_size, z);
        }
}

/// Blocks of 2 x 2 x 2 cells in a brick: four along an edge, x fastest.
inline constexpr int blocks_per_brick = 64;

/// The first cell of a block, counted from the brick's.
inline glm::ivec3 block_position(int block)
{
    return 2 * glm::ivec3(block & 3, block >> 2 & 3, block >> 4);
}

/// The cells of a set that are in a block: bit i is the block's cell at child_position(i).
inline std::uint8_t cells_of_block(const BrickCells& cells, int block)
{
    const glm::ivec3 at = block_position(block);
    const auto square = [&](int z) {
        const std::uint64_t bits = cells[static_cast<std::size_t>(z)] >> (at.x + brick_size * at.y);
        return (bits & 0b11u) | (bits >> (brick_size - 2) & 0b1100u);
    };
    return static_cast<std::uint8_t>(square(at.z) | square(at.z + 1) << 4);
}

/// Calls `visit(x, y, z)` for each cell of a set, block by block.
template <typename Visit>
void for_each_cell_by_blocks(const BrickCells& cells, Visit visit)
{
    for (int block = 0; block < blocks_per_brick; ++block)
        for (unsigned left = cells_of_block(cells, block); left != 0; left &= left - 1u) {
            const glm::ivec3 cell = block_position(block) + child_position(std::countr_zero(left));
            visit(cell.x, cell.y, cell.z);
        }
}

/// Whether a set has a cell, counted from the brick's first.
inline bool has_cell(const BrickCells& cells, const glm::ivec3& cell)
{
    return (cells[static_cast<std::size_t>(cell.z)] >> (cell.x + brick_size * cell.y) & 1u) != 0;
}

/// Removes the cells for which `is_out(x, y, z)` is true from a set.
template <typename IsOut>
void remove_cells(BrickCells& cells, IsOut is_out)
{
    for_each_cell(BrickCells(cells), [&](int x, int y, int z) {
        if (is_out(x, y, z))
            cells[static_cast<std::size_t>(z)] &= ~(std::uint64_t(1) << (x + brick_size * y));
    });
}

inline std::size_t count_cells(const BrickCells& cells)
{
    std::size_t count = 0;
    for (const std::uint64_t word : cells)
        count += static_cast<std::size_t>(std::popcount(word));
    return count;
}

} // namespace isospline
