// The Python module isospline._core: one bind_ function a concept.
#include "bind.h"

PYBIND11_MODULE(_core, module)
{
    module.doc() = "Isosurfaces of B-spline volume models, ray traced exactly in Embree.";
    isospline::bind_volume(module);
    isospline::bind_isosurface(module);
    isospline::bind_scene(module);
    isospline::bind_hopper(module);
    isospline::bind_render(module);
}
