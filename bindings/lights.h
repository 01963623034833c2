// Lights as values of Python.
#pragma once

#include "values.h"

#include "isospline/shade/light.h"

#include <pybind11/pybind11.h>

namespace isospline {

/// With the direction to the light, which is computed once.
template <>
struct ValueConversion<DirectionalLight> : ConversionByParameters<DirectionalLight> {
    static DirectionalLight from_python(pybind11::handle value)
    {
        const auto light = ConversionByParameters::from_python(value);
        return DirectionalLight(light.direction, light.intensity, light.angle);
    }
};

} // namespace isospline
