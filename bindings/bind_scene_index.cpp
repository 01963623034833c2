// The indexes of a scene: when rays get the faster one.
#include "bind.h"
#include "long_call.h"

#include "isospline/scene/scene.h"

#include <pybind11/pybind11.h>

namespace py = pybind11;

namespace isospline {

namespace {

void settle(Scene& scene, const py::object& progress)
{
    long_call("to settle the indexes of a scene", progress, [&](const Progress& report) { scene.settle(report); });
}

} // namespace

void bind_scene_index(py::module_& module)
{
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("_share_built_objects", &Scene::share_built_objects, py::arg("other"))
        .def("settle", &settle)
        .def_property_readonly("is_settled", &Scene::is_settled);
}

} // namespace isospline
