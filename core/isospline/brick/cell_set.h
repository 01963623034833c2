// A set of the cells of a volume.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/brick/cutout.h"
#include "isospline/math/grid.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace isospline {

/// Stored by brick: most bricks have either all of their cells in the set or none.
class CellSet {
public:
    /// All cells of any volume.
    CellSet() = default;
    /// The cells that a mask keeps; an empty mask keeps all.
    CellSet(const Mask& mask, const Volume& volume, const Progress& progress = {});
    /// `cells_of(index, brick)` returns the cells of the brick at this index of the grid of bricks. Several threads
    /// call it at the same time.
    CellSet(const glm::ivec3& cell_shape, const std::function<BrickCells(std::size_t, const Brick&)>& cells_of,
            const Progress& progress = {});

    /// Whether the set was made as the set of all cells.
    bool is_all() const { return bricks_.empty(); }
    bool has_all_of(const Brick& brick) const { return is_all() || state_of(brick) == all; }
    bool has_none_of(const Brick& brick) const { return !is_all() && state_of(brick) == none; }
    BrickCells cells(const Brick& brick) const
    {
        if (has_all_of(brick))
            return all_cells(brick.size);
        const std::uint32_t state = state_of(brick);
        return state == none ? BrickCells{} : mixed_[state - first_mixed];
    }
    bool contains(const glm::ivec3& cell) const
    {
        if (is_all())
            return true;
        const glm::ivec3 brick = cell / brick_size, local = cell - brick_size * brick;
        const std::uint32_t state = bricks_[place_in(shape_, brick)];
        return state == all || (state != none && has_cell(mixed_[state - first_mixed], local));
    }
    /// Whether the set has any of the cells from `first` to `last`, both included.
    bool contains_any(const glm::ivec3& first, const glm::ivec3& last) const
    {
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    if (contains({x, y, z}))
                        return true;
        return false;
    }
    /// Whether it has all of them.
    bool contains_all(const glm::ivec3& first, const glm::ivec3& last) const
    {
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x)
                    if (!contains({x, y, z}))
                        return false;
        return true;
    }
    std::size_t memory() const
    {
        return bricks_.capacity() * sizeof(bricks_[0]) + mixed_.capacity() * sizeof(BrickCells);
    }

private:
    /// The entry of a brick; `first_mixed` + i refers to item i of the stored sets.
    static constexpr std::uint32_t none = 0, all = 1, first_mixed = 2;

    std::uint32_t state_of(const Brick& brick) const { return bricks_[place_in(shape_, brick.first / brick_size)]; }

    glm::ivec3 shape_{0}; ///< bricks along x, y, z
    std::vector<std::uint32_t> bricks_;
    std::vector<BrickCells> mixed_;
};

} // namespace isospline
