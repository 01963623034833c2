// Masks of isosurfaces from NumPy arrays.
#pragma once

#include "arrays.h"
#include "long_call.h"

#include "isospline/brick/cutout.h"
#include "isospline/util/parallel.h"

#include <cstddef>
#include <cstdint>

namespace isospline {

/// A boolean array over the samples of a volume, in the axis order of the user's array.
inline Mask as_mask(const pybind11::handle& value, const char* parameter, const glm::ivec3& shape, Axes axes)
{
    const auto array = as_array(value, parameter, "b", "an array of bool");
    const Shape expected = array_shape(shape, axes);
    if (shape_of(array) != expected)
        throw_invalid(parameter, "shape " + to_text(expected), to_text(shape_of(array)));
    const auto strides = grid_strides(array, axes);
    const auto* const data = static_cast<const std::uint8_t*>(array.data());
    Mask mask;
    long_call("to copy a mask", pybind11::none(), [&](const Progress& progress) {
        mask.resize(static_cast<std::size_t>(array.size()));
        const auto copy = [&](std::size_t begin, std::size_t end) {
            for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
                for (int y = 0; y < shape.y; ++y) {
                    std::uint8_t* const row = mask.data() + shape.x * (y + static_cast<std::ptrdiff_t>(shape.y) * z);
                    for (int x = 0; x < shape.x; ++x)
                        row[x] = data[x * strides[0] + y * strides[1] + z * strides[2]] != 0;
                }
        };
        parallel_for(static_cast<std::size_t>(shape.z), 1, copy, progress);
    });
    return mask;
}

} // namespace isospline
