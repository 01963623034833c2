// Warnings.
#pragma once

#include "handed.h"

#include <pybind11/pybind11.h>

#include <string>

namespace isospline {

/// Gives a UserWarning at the line of the user's code that called the package. The caller holds the GIL.
inline void warn(const std::string& text)
{
    handed("warn")(text);
}

} // namespace isospline
