// Results of queries: mappings from names to arrays whose items are also attributes.
#pragma once

#include "gil.h"

#include <pybind11/pybind11.h>

namespace isospline {

/// A result, of the class with this name in isospline/results.py.
inline pybind11::object as_result(const char* type, const pybind11::dict& arrays)
{
    return call_python(pybind11::module_::import("isospline.base.results").attr(type), arrays);
}

} // namespace isospline
