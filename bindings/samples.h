// Arrays of samples, and the Python names of boundaries and filters.
#pragma once

#include "arrays.h"

#include "isospline/spline/filter.h"
#include "isospline/spline/samples.h"
#include "isospline/spline/volume.h"

#include <pybind11/numpy.h>

#include <string>

namespace isospline {

inline const EnumWords<Boundary> boundary_words{{"mirror", Boundary::mirror}, {"periodic", Boundary::periodic}};
inline const EnumWords<Filter> filter_words{
    {"interpolate", Filter::interpolate}, {"none", Filter::none}, {"smoothing", Filter::smoothing}};
inline const EnumWords<Axes> axes_words{{"zyx", Axes::zyx}, {"xyz", Axes::xyz}};

inline SampleType sample_type(const pybind11::dtype& dtype)
{
    switch (dtype.kind()) {
    case 'b':
        return SampleType::uint8;
    case 'u':
        switch (dtype.itemsize()) {
        case 1:
            return SampleType::uint8;
        case 2:
            return SampleType::uint16;
        case 4:
            return SampleType::uint32;
        default:
            return SampleType::uint64;
        }
    case 'i':
        switch (dtype.itemsize()) {
        case 1:
            return SampleType::int8;
        case 2:
            return SampleType::int16;
        case 4:
            return SampleType::int32;
        default:
            return SampleType::int64;
        }
    default:
        switch (dtype.itemsize()) {
        case 2:
            return SampleType::float16;
        case 4:
            return SampleType::float32;
        default:
            return SampleType::float64;
        }
    }
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
