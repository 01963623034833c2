// A view of an array of samples of any real type and any strides, which it does not own.
#pragma once

#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

namespace isospline {

enum class SampleType { uint8, int8, uint16, int16, uint32, int32, uint64, int64, float16, float32, float64 };

/// Samples f(k) at index k = (x, y, z); `strides` are in bytes, along x, y and z, and may be negative or zero.
struct SampleView {
    const void* data = nullptr;
    SampleType type = SampleType::float32;
    glm::ivec3 shape{0};
    std::array<std::ptrdiff_t, 3> strides{};
    bool byte_swapped = false; ///< whether the samples' byte order is not the machine's
};

/// Smallest and largest sample.
struct SampleRange {
    double minimum;
    double maximum;
};

/// Thrown if a sample is NaN or infinite. `index` is the first such sample in an order where z varies slowest.
struct NonFiniteSample : std::invalid_argument {
    NonFiniteSample(const glm::ivec3& at, double found);

    glm::ivec3 index;
    double value;
};

/// Reads all samples once, in memory order. Throws NonFiniteSample.
SampleRange sample_range(const SampleView& samples, const Progress& progress = {});

/// Writes (f - offset) scale for `count` samples along x, beginning at `first`. The arithmetic is float32 for types
/// whose numbers all fit into float32, and float64 for the others.
void read_row(const SampleView& samples, const glm::ivec3& first, int count, double offset, double scale, float* row);

} // namespace isospline
