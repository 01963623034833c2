// Clip half-spaces and boxes given from Python.
#pragma once

#include "isospline/brick/cutout.h"

#include <pybind11/pybind11.h>

#include <vector>

namespace isospline {

/// None, a HalfSpace, a Box or a sequence of them.
std::vector<HalfSpace> as_clip(const pybind11::object& value);

} // namespace isospline
