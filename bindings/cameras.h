// Cameras as values of Python.
#pragma once

#include "values.h"

#include "isospline/render/camera.h"

#include <pybind11/pybind11.h>

namespace isospline {

/// Coefficients in OpenCV's order, or None for none.
LensDistortion as_distortion(const pybind11::object& value);

void read(const pybind11::object& part, const char* name, FieldOfViewAxis& member);
void read(const pybind11::object& part, const char* name, LensDistortion& member);
pybind11::object written(const FieldOfViewAxis& member);
pybind11::object written(const LensDistortion& member);

} // namespace isospline
