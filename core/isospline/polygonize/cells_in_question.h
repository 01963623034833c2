// The cells that may contain surface or caps.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/polygonize/lattice_field.h"
#include "isospline/shell/isosurface.h"

#include <functional>
#include <unordered_set>
#include <vector>

namespace isospline {

/// Selects cells; an empty function stands for all.
using CellFilter = std::function<bool(const glm::ivec3&)>;

/// The keys, with direction 0, of the cubes of edge 1 / steps that are within a margin of boxes.
std::unordered_set<CrossingKey> cubes_of(const std::vector<Box>& boxes, double steps, double margin);

/// A brick that may contain surface or, if the surface is capped and a plane of the clip may cut the brick, solid.
struct BrickInQuestion {
    Brick brick;
    bool is_mixed; ///< coefficients are on both sides of the level
    bool may_have_caps;
};

std::vector<BrickInQuestion> bricks_in_question(const IsosurfaceSnapshot& surface);

/// Calls `visit(cell, may_have_caps)` for the cells of a brick that may contain surface or solid with a cap.
template <typename Visit>
void for_each_cell_in_question(const IsosurfaceSnapshot& surface, const BrickInQuestion& in_question,
                               const Visit& visit)
{
    const Brick& brick = in_question.brick;
    const BrickCells mixed = in_question.is_mixed ? surface.bricks().cells(brick) : BrickCells{};
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
                const glm::ivec3 cell = brick.first + at;
                const double any_coefficient = *coefficients.from(at.x, at.y, at.z).first;
                const bool may_be_solid =
                    (any_coefficient >= surface.threshold()) == above_is_solid && surface.kept_cells().contains(cell);
                if (may_be_solid || has_cell(mixed, at))
                    visit(cell, true);
            }
}

} // namespace isospline
