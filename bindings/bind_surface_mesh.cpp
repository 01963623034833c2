#include "bind.h"
#include "long_call.h"

#include "isospline/polygonize/surface_mesh.h"
#include "isospline/scene/mesh.h"

#include <memory>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

std::shared_ptr<Mesh> mesh_of(const Isosurface& surface, const py::object& progress)
{
    const auto snapshot = surface.snapshot();
    std::shared_ptr<Mesh> mesh;
    long_call("to make a mesh", progress, [&](const Progress& report) {
        SurfaceMesh made = to_mesh(*snapshot, report);
        mesh = std::make_shared<Mesh>(std::move(made.vertices), std::move(made.faces), std::move(made.normals));
    });
    return mesh;
}

} // namespace

void bind_surface_mesh(py::module_& module)
{
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    surface.def("to_mesh", &mesh_of, py::kw_only(), py::arg("progress") = py::none());
}

} // namespace isospline
