// A view of somebody else's array of samples, of any real type and any strides.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace isospline {

enum class SampleType { uint8, int8, uint16, int16, uint32, int32, uint64, int64, float16, float32, float64 };

/// Samples f(k) at index k = (x, y, z); `strides` are in bytes, along x, y and z, and may be negative.
struct SampleView {
    const void* data = nullptr;
    SampleType type = SampleType::float32;
    glm::ivec3 shape{0};
    std::array<std::ptrdiff_t, 3> strides{};
};

} // namespace isospline
