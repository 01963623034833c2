// The attributes of a volume without its coefficients, as a Python dictionary.
#pragma once

#include "isospline/spline/volume.h"

#include <pybind11/pybind11.h>

namespace isospline {

pybind11::dict dict_of(const VolumeOptions& options, const VolumeSummary& summary);
VolumeOptions options_in(const pybind11::dict& state);
VolumeSummary summary_in(const pybind11::dict& state);

} // namespace isospline
