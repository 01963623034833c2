#include "bind.h"

void isospline::bind_scene(pybind11::module_&) {}
