// The part of each voxel in which a B-spline of degree 2 is positive.
#pragma once

#include "isospline/label/brick_field.h"
#include "isospline/util/progress.h"

#include <cstddef>

namespace isospline {

/// What the parts sum to.
struct PartialVolume {
    double voxels = 0.0;     ///< the positive part of the volume
    std::size_t crossed = 0; ///< the number of voxels that the surface may cross
};

/// For each voxel of computed bricks the part of it that is positive, and its derivative with respect to a constant
/// that is added to the spline. Voxels are divided into `divisions`^3 boxes in which the spline counts as linear.
///
/// In a voxel, the spline is between the least and the largest of its 27 coefficients. So only voxels whose
/// coefficients have both signs are evaluated.
PartialVolume find_partial_volumes(const BrickField& coefficients, int divisions, BrickField& parts,
                                   BrickField& derivatives, const Progress& progress = {});

} // namespace isospline
