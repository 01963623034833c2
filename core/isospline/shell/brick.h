// Bricks of 8 x 8 x 8 cells, and sets of the cells of a brick.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace isospline {

/// Cells along an edge of a brick.
inline constexpr int brick_size = 8;

/// A brick's place in the grid of cells; `size` is less than 8 along an axis where the grid ends.
struct Brick {
    glm::ivec3 first;
    glm::ivec3 size;
};

/// Bricks along x, y, z of a grid of cells.
inline glm::ivec3 brick_shape(const glm::ivec3& cell_shape)
{
    return (cell_shape + (brick_size - 1)) / brick_size;
}

/// The brick at index x + shape.x * (y + shape.y * z) of a grid of cells.
inline Brick brick_at(const glm::ivec3& cell_shape, std::size_t index)
{
    const glm::ivec3 shape = brick_shape(cell_shape);
    const auto row = index / static_cast<std::size_t>(shape.x);
    const glm::ivec3 position(static_cast<int>(index % static_cast<std::size_t>(shape.x)),
                              static_cast<int>(row % static_cast<std::size_t>(shape.y)),
                              static_cast<int>(row / static_cast<std::size_t>(shape.y)));
    const glm::ivec3 first = position * brick_size;
    return {first, glm::min(cell_shape - first, glm::ivec3(brick_size))};
}

/// A set of the cells of a brick: cell (x, y, z) of the brick is bit x + 8 y of word z.
using BrickCells = std::array<std::uint64_t, brick_size>;

/// Calls `visit(x, y, z)`, counted from the brick's first cell, for each cell of a set, in the order of z, y, x.
template <typename Visit>
void for_each_cell(const BrickCells& cells, Visit visit)
{
    for (int z = 0; z < brick_size; ++z)
        for (std::uint64_t left = cells[static_cast<std::size_t>(z)]; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            visit(bit % brick_size, bit / brick_size, z);
        }
}

/// The same in the order of blocks of 2 x 2 x 2 cells, then z, y, x.
template <typename Visit>
void for_each_cell_by_blocks(const BrickCells& cells, Visit visit)
{
    constexpr std::uint64_t square = 0b11 | 0b11 << brick_size; // 2 x 2 cells
    for (int z = 0; z < brick_size; z += 2)
        for (int y = 0; y < brick_size; y += 2)
            for (int x = 0; x < brick_size; x += 2)
                for (int layer = z; layer < z + 2; ++layer) {
                    const int corner = x + brick_size * y;
                    for (std::uint64_t left = cells[static_cast<std::size_t>(layer)] & square << corner; left != 0;
                         left &= left - 1) {
                        const int bit = std::countr_zero(left);
                        visit(bit % brick_size, bit / brick_size, layer);
                    }
                }
}

/// Takes the cells out of a set for which `is_out(x, y, z)`.
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
