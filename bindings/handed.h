// What the package has handed to the compiled module: see isospline/base/handed.py.
#pragma once

#include <pybind11/pybind11.h>

namespace isospline {

/// The function or the class of the package with this name.
pybind11::object handed(const char* name);

} // namespace isospline
