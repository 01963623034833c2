#include "bind.h"

void isospline::bind_hopper(pybind11::module_&) {}
