// Warnings.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace isospline {

/// Gives a UserWarning at the line of the user's code that called the package. The caller holds the GIL.
inline void warn(const std::string& text)
{
    pybind11::module_::import("isospline.base.system").attr("warn")(text);
}

} // namespace isospline
