// The bricks of one level of a volume together with all that they refer to, for tests.
#pragma once

#include "isospline/brick/bricks.h"

#include <memory>
#include <utility>
#include <vector>

namespace isospline {

/// `clip_lattice` is in lattice space, its normals have length one; `source` is the volume where there is none.
struct LevelBricks {
    LevelBricks(std::shared_ptr<const Volume> of, double threshold, Mask cut = {}, std::vector<HalfSpace> clip = {},
                std::shared_ptr<const CoefficientSource> source = nullptr)
        : volume(std::move(of)), mask(std::move(cut)), clip_lattice(std::move(clip)), ranges(*volume),
          bricks(*volume, source ? std::move(source) : std::make_shared<const VolumeSource>(volume), ranges, threshold,
                 mask, clip_lattice)
    {
    }

    const std::shared_ptr<const Volume> volume;
    const Mask mask;
    const std::vector<HalfSpace> clip_lattice;
    const BrickRanges ranges;
    const Bricks bricks;
};

} // namespace isospline
