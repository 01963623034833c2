// Shadings and materials as values of Python.
#pragma once

#include "lights.h"
#include "values.h"

#include "isospline/shade/material.h"
#include "isospline/shade/shading.h"

#include <pybind11/pybind11.h>

#include <memory>

namespace isospline {

/// The material in Python, or None. Pictures ask for those of all objects, so the same one is given each time.
pybind11::object material_in_python(const std::shared_ptr<const Material>& material);

} // namespace isospline
