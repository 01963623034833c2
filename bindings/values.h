// Classes of values, which Python defines: frozen dataclasses, whose constructors have checked their parameters.
#pragma once

#include <pybind11/pybind11.h>

namespace isospline {

/// Whether an object is an instance of the class of values with this name.
bool is_value(const pybind11::handle& object, const char* name);

/// The class of values with this name.
pybind11::object value_class(const char* name);

} // namespace isospline
