// The cells that may contain surface or caps.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/shell/isosurface.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

namespace isospline {

/// Selects cells: those of the brick with a first cell. An empty function selects all.
using CellFilter = std::function<BrickCells(const glm::ivec3&)>;

/// The cells that a filter selects in the brick with a first cell.
inline BrickCells chosen_cells(const CellFilter& filter, const glm::ivec3& first)
{
    return filter ? filter(first) : all_cells(glm::ivec3(brick_size));
}

inline bool is_chosen(const CellFilter& filter, const glm::ivec3& cell)
{
    const glm::ivec3 first = cell / brick_size * brick_size;
    return !filter || has_cell(filter(first), cell - first);
}

/// Cells of the grid.
class ChosenCells {
public:
    /// The cells within a margin of boxes, in a grid of this shape and one cell beyond its end.
    ChosenCells(const std::vector<Box>& boxes, double margin, const glm::ivec3& cell_shape);

    /// Those of the brick with this first cell.
    BrickCells of_brick(const glm::ivec3& first) const
    {
        const auto found = bricks_.find(crossing_key(first, 0));
        return found != bricks_.end() ? found->second : BrickCells{};
    }
    CellFilter filter() const
    {
        return [this](const glm::ivec3& first) { return of_brick(first); };
    }

private:
    std::unordered_map<CrossingKey, BrickCells> bricks_; ///< by their first cells
};

/// A brick that may contain surface or, if the surface is capped and a plane of the clip may cut the brick, solid.
struct BrickInQuestion {
    Brick brick;
    bool is_mixed; ///< coefficients are on both sides of the level
    bool may_have_caps;
};

std::vector<BrickInQuestion> bricks_in_question(const IsosurfaceSnapshot& surface);

/// Calls `visit(cell, may_have_caps)` for the chosen cells of a brick that may contain surface or solid with a cap.
template <typename Visit>
void for_each_cell_in_question(const IsosurfaceSnapshot& surface, const BrickInQuestion& in_question,
                               const BrickCells& chosen, const Visit& visit)
{
    const Brick& brick = in_question.brick;
    BrickCells mixed = in_question.is_mixed ? surface.bricks().cells(brick) : BrickCells{};
    for (std::size_t z = 0; z < mixed.size(); ++z)
        mixed[z] &= chosen[z];
    if (!in_question.may_have_caps) {
        for_each_cell(mixed, [&](int x, int y, int z) { visit(brick.first + glm::ivec3(x, y, z), false); });
        return;
    }
    const bool above_is_solid = surface.options().inside == Inside::above;
    const CoefficientBox coefficients = surface.volume().box(brick.first, brick.size);
    glm::ivec3 at;
    for (at.z = 0; at.z < brick.size.z; ++at.z)
        for (at.y = 0; at.y < brick.size.y; ++at.y)
            for (at.x = 0; at.x < brick.size.x; ++at.x) {
                if (!has_cell(chosen, at))
                    continue;
                const glm::ivec3 cell = brick.first + at;
                const double any_coefficient = *coefficients.from(at.x, at.y, at.z).first;
                const bool may_be_solid =
                    (any_coefficient >= surface.threshold()) == above_is_solid && surface.kept_cells().contains(cell);
                if (may_be_solid || has_cell(mixed, at))
                    visit(cell, true);
            }
}

} // namespace isospline
