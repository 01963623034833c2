// The bricks of one level of a volume together with all that they refer to, for tests.
#pragma once

#include "isospline/brick/bricks.h"

#include <memory>
#include <utility>
#include <vector>

namespace isospline {

/// `clip_lattice` is in lattice space, its normals have length one.
struct LevelBricks {
    LevelBricks(std::shared_ptr<const Volume> of, double threshold, const Mask& cut = {},
                std::vector<HalfSpace> clip = {})
        : volume(std::move(of)), kept(cut, *volume), clip_lattice(std::move(clip)), ranges(*volume),
          bricks(*volume, ranges, threshold, kept, clip_lattice)
    {
    }

    const std::shared_ptr<const Volume> volume;
    const CellSet kept;
    const std::vector<HalfSpace> clip_lattice;
    const BrickRanges ranges;
    const Bricks bricks;
};

} // namespace isospline
