// Results of queries: mappings from names to arrays whose items are also attributes.
#pragma once

#include "gil.h"
#include "handed.h"

#include <pybind11/pybind11.h>

namespace isospline {

/// A result, of the class with this name in isospline/base/results.py.
inline pybind11::object as_result(const char* type, const pybind11::dict& arrays)
{
    return call_python(handed(type), arrays);
}

} // namespace isospline
