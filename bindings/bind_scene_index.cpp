// The indexes of a scene: when rays get the faster one.
#include "bind.h"
#include "long_call.h"

#include "isospline/scene/scene.h"

#include <pybind11/pybind11.h>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* settle_doc = R"(Builds the settled indexes of the isosurfaces now.

A settled index has a box of Embree around each 2 x 2 x 2 cells, as tight as the surface in them allows. It takes
about 0.1 s to build for a volume of 256^3 samples, and rays that are traced one by one are a third faster than in the
draft, which a new level begins with. Without this call, it is built in the background after about 500 rays at one level
for each 8 x 8 x 8 cells that the surface crosses, and the next queries use it. Hits are the same in both, bit for bit.
Surfaces of stores keep the draft.

Parameters
----------
progress : callable, optional
    Called with the finished fraction; cancels if it returns a false value other than None.

Raises
------
Cancelled
    If `progress` cancels. Nothing changes then.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
>>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
>>> scene = isospline.Scene([isospline.Isosurface(volume, 5.0, inside="below")])
>>> scene.is_settled
False
>>> scene.settle()
>>> scene.is_settled
True
)";

void settle(Scene& scene, const py::object& progress)
{
    long_call("to settle the indexes of a scene", progress, [&](const Progress& report) { scene.settle(report); });
}

} // namespace

void bind_scene_index(py::module_& module)
{
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("_share_built_objects", &Scene::share_built_objects, py::arg("other"),
             "Uses what another scene has built, wherever both have the same object.")
        .def("settle", &settle, py::kw_only(), py::arg("progress") = py::none(), settle_doc)
        .def_property_readonly(
            "is_settled", &Scene::is_settled,
            "Whether rays use settled indexes wherever there are any; see `settle`. False before the first\n"
            "query.");
}

} // namespace isospline
