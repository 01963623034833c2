#include "bind.h"

void isospline::bind_volume(pybind11::module_&) {}
