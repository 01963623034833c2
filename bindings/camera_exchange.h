// Conversion of cameras from and to other libraries: PyVista's camera position, OpenCV's matrices.
#pragma once

#include "isospline/render/camera.h"

#include <pybind11/pybind11.h>

namespace isospline {

/// Coefficients in OpenCV's order, or None for none.
LensDistortion as_distortion(const pybind11::object& value);

void bind_exchange(pybind11::class_<PerspectiveCamera>& camera_class);
void bind_exchange(pybind11::class_<ProjectionPlaneCamera>& camera_class);
void bind_exchange(pybind11::class_<OrthographicCamera>& camera_class);

} // namespace isospline
