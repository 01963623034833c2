#include "bind.h"

void isospline::bind_render(pybind11::module_&) {}
