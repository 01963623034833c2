// Environments as values of Python.
#pragma once

#include "values.h"

#include "isospline/shade/environment_light.h"

#include <pybind11/pybind11.h>

namespace isospline {

/// Its map stays in the compiled module, which has prepared it for sampling.
template <>
struct ValueConversion<EnvironmentLight> {
    static constexpr char name[] = "EnvironmentLight";
    static EnvironmentLight from_python(pybind11::handle light);
    static pybind11::object to_python(const EnvironmentLight& light);
};

} // namespace isospline
