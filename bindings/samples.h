// Arrays of samples, and the Python names of boundaries and filters.
#pragma once

#include "arrays.h"

#include "isospline/spline/filter.h"
#include "isospline/spline/samples.h"
#include "isospline/spline/volume.h"

#include <pybind11/numpy.h>

#include <algorithm>
#include <bit>
#include <string>

namespace isospline {

inline const EnumWords<Boundary> boundary_words{{"mirror", Boundary::mirror}, {"periodic", Boundary::periodic}};
inline const EnumWords<Filter> filter_words{
    {"interpolate", Filter::interpolate}, {"none", Filter::none}, {"smoothing", Filter::smoothing}};
inline const EnumWords<Axes> axes_words{{"zyx", Axes::zyx}, {"xyz", Axes::xyz}};

inline SampleType sample_type(const pybind11::dtype& dtype)
{
    using enum SampleType;
    // By size: 1, 2, 4 and 8 bytes.
    static constexpr SampleType unsigned_types[]{uint8, uint16, uint32, uint64},
        signed_types[]{int8, int16, int32, int64}, float_types[]{float64, float16, float32, float64};
    const int item = std::min(std::countr_zero(static_cast<unsigned>(dtype.itemsize())), 3);
    const char kind = dtype.kind();
    return kind == 'b' || kind == 'u' ? unsigned_types[item] : kind == 'i' ? signed_types[item] : float_types[item];
}

/// The samples of a three-dimensional array, which owns them.
inline SampleView sample_view(const pybind11::array& array, Axes axes)
{
    const auto size = [&](int axis) {
        const pybind11::ssize_t samples = array.shape(axes == Axes::xyz ? axis : 2 - axis);
        if (samples > largest_sample_count)
            throw_invalid("data", "at most " + std::to_string(largest_sample_count) + " samples along an axis",
                          samples);
        return static_cast<int>(samples);
    };
    const bool native = array.dtype().attr("isnative").cast<bool>();
    return {array.data(), sample_type(array.dtype()), {size(0), size(1), size(2)}, grid_strides(array, axes), !native};
}

} // namespace isospline
