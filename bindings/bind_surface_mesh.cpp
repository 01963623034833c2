#include "bind.h"
#include "long_call.h"
#include "results.h"
#include "warn.h"

#include "isospline/polygonize/surface_mesh.h"
#include "isospline/scene/mesh.h"
#include "isospline/util/error.h"

#include <pybind11/numpy.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

/// What is proven of a mesh.
py::object report_of(const SurfaceMesh& mesh)
{
    py::array_t<double> positions({mesh.left_out.size(), std::size_t{3}}),
        sizes({mesh.left_out.size(), std::size_t{3}}), distances(mesh.left_out.size());
    for (std::size_t i = 0; i < mesh.left_out.size(); ++i) {
        const auto at = static_cast<py::ssize_t>(i);
        for (int axis = 0; axis < 3; ++axis) {
            positions.mutable_at(at, axis) = mesh.left_out[i].position[axis];
            sizes.mutable_at(at, axis) = mesh.left_out[i].size[axis];
        }
        distances.mutable_at(at) = mesh.left_out[i].distance;
    }
    py::dict left_out, report;
    left_out["positions"] = positions;
    left_out["sizes"] = sizes;
    left_out["distances"] = distances;
    report["distance"] = mesh.distance;
    report["left_out"] = as_result("LeftOut", left_out);
    report["self_intersections"] = mesh.crossings;
    report["missing_volume"] = mesh.missing_volume;
    return as_result("MeshReport", report);
}

py::object mesh_of(const Isosurface& surface, const std::optional<double>& tolerance,
                   const std::optional<std::int64_t>& faces, bool return_distance, bool return_report,
                   const py::object& progress)
{
    if (faces && tolerance)
        throw_invalid("faces", "either a tolerance or faces", "both");
    if (faces && *faces < 1)
        throw_invalid("faces", "at least 1", *faces);
    for (const auto& [name, is_set] : {std::pair("return_distance", return_distance), {"return_report", return_report}})
        if (is_set && !tolerance && !faces)
            throw_invalid(name, "a tolerance or faces as well", "none");
    if (return_distance && return_report)
        throw_invalid("return_distance", "one of return_distance and return_report", "both");
    const auto snapshot = surface.snapshot();
    std::shared_ptr<Mesh> mesh;
    SurfaceMesh made;
    long_call("to make a mesh", progress, [&](const Progress& report) {
        made = faces ? to_mesh_of_faces(*snapshot, static_cast<std::size_t>(*faces), report)
                     : to_mesh(*snapshot, tolerance, report);
        mesh = std::make_shared<Mesh>(std::move(made.vertices), std::move(made.faces), std::move(made.normals));
    });
    if (tolerance && made.distance > *tolerance) {
        std::ostringstream text;
        text << "tolerance: the mesh may be up to " << made.distance << " from the surface, more than the "
             << *tolerance << " that was requested";
        warn(text.str());
    }
    if (!made.left_out.empty()) {
        std::ostringstream text;
        const auto farthest = std::max_element(
            made.left_out.begin(), made.left_out.end(),
            [](const LeftOut& first, const LeftOut& second) { return first.distance < second.distance; });
        text << (faces ? "faces: " : "tolerance: ") << made.left_out.size()
             << " parts of the surface are left out, up to " << farthest->distance
             << " from the mesh; return_report=True lists them";
        warn(text.str());
    }
    if (made.crossings > 0) {
        std::ostringstream text;
        text << "to_mesh: " << made.crossings << " pairs of faces of the mesh cross each other";
        warn(text.str());
    }
    if (return_report)
        return py::make_tuple(mesh, report_of(made));
    if (return_distance)
        return py::make_tuple(mesh, made.distance);
    return py::cast(mesh);
}

} // namespace

void bind_surface_mesh(py::module_& module)
{
    py::class_<MeshParts>(module, "MeshParts")
        .def(py::init([](const Isosurface& surface, std::int64_t cells) {
            if (cells < 1)
                throw_invalid("cells", "at least 1", cells);
            return MeshParts(surface.snapshot(), static_cast<std::size_t>(cells));
        }))
        .def("next", [](MeshParts& parts, const py::object& progress) {
            std::shared_ptr<Mesh> mesh;
            long_call("to make a mesh", progress, [&](const Progress& report) {
                if (std::optional<SurfaceMesh> part = parts.next(report))
                    mesh = std::make_shared<Mesh>(std::move(part->vertices), std::move(part->faces),
                                                  std::move(part->normals));
            });
            return mesh;
        });
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    surface.def("to_mesh", &mesh_of);
}

} // namespace isospline
