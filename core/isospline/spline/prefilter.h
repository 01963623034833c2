// From samples to B-spline coefficients, in parallel and in place.
#pragma once

#include "isospline/spline/filter.h"
#include "isospline/spline/filter_design.h"
#include "isospline/spline/samples.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstddef>

namespace isospline {

/// The layout of coefficients in memory: coefficient (x, y, z) is at origin[x + y * row_stride + z * slice_stride],
/// with `padding` more on each side of each axis.
struct CoefficientArray {
    float* origin = nullptr;
    glm::ivec3 shape{0};
    int padding = 0;
    std::ptrdiff_t row_stride = 0;
    std::ptrdiff_t slice_stride = 0;
};

/// Fills an array, including its padding, with the coefficients of samples - offset. The samples are read directly into
/// the array. Its strips are filtered in a buffer that stays in the processor's cache. Besides the array, memory is
/// needed only for a few lines a thread.
void compute_coefficients(const SampleView& samples, double offset, const RecursiveFilter& filter, Boundary boundary,
                          const CoefficientArray& coefficients, const Progress& progress = {});

} // namespace isospline
