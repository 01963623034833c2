// How samples become coefficients, and how they continue outside of the volume.
#pragma once

namespace isospline {

/// How samples continue outside of the volume: whole-sample symmetric (scipy.ndimage "mirror"), or periodic
/// ("grid-wrap").
enum class Boundary { mirror, periodic };

/// How coefficients follow from samples.
enum class Filter {
    interpolate, ///< the model passes through the samples
    none,        ///< the samples are the coefficients: a smoothing model
    smoothing    ///< the smoothing spline with parameter `VolumeOptions::smoothing`
};

} // namespace isospline
