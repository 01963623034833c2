// Objects of scenes, given from Python.
#pragma once

#include "isospline/scene/scene.h"

#include <pybind11/pybind11.h>

#include <cstdint>

namespace isospline {

/// Adds an Isosurface or a Mesh; `transform` may be None. Returns its geometry id.
std::uint32_t add_object(Scene& scene, const pybind11::object& object, const pybind11::object& transform,
                         SeenBy seen_by);

} // namespace isospline
