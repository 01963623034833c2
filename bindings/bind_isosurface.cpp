#include "bind.h"

void isospline::bind_isosurface(pybind11::module_&) {}
