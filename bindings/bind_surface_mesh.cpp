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

constexpr const char* to_mesh_doc = R"(A triangle mesh of the surface, with its clip and caps.

.. math:: |f(\mathbf{v}) - f_0| \approx 0 \text{ for every vertex } \mathbf{v} \text{ that is not on a cap}

The mesh is a manifold. An edge has two faces, or one where the surface ends: at the border of the volume if it is not
closed, at cuts by `mask`, and at a `clip` that is not capped. If the surface is closed, the mesh is
watertight for all samples. Faces are counter-clockwise as seen from outside. Normals are exact. On caps they are
those of the planes; at vertices that a cap shares with the surface, those of the surface.

Parameters
----------
tolerance : float, optional
    The largest distance between the surface and the mesh, in both directions, in world units. Edges are collapsed as
    long as it holds, and the result is proven. At least 2^-14 of a voxel's shortest edge: the finest lattice follows
    sharper bends no better. Without a tolerance, the vertices are where the surface crosses the edges of cells.
faces : int, optional
    In place of a tolerance, the largest number of triangles. The smallest tolerance for it is searched, down to 1/32
    of a voxel's shortest edge. At least 85% of the triangles are used, unless this smallest tolerance needs fewer, or a
    tolerance that is 5% smaller needs too many. Takes a few times as long as the mesh with that tolerance.
return_distance : bool
    Whether to return the proven distance as well. Needs a tolerance or a number of faces.
return_report : bool
    Whether to return all that is proven as well. Needs a tolerance or a number of faces.
progress : callable, optional
    Called with the finished fraction; cancels if it returns a false value other than None.

Returns
-------
Mesh
    In the volume's world space; without faces if there is no surface.
float
    With `return_distance`: a proven bound, in world units. No point of the mesh is farther from the surface and its
    caps, and none of their points, but for parts that are left out, is farther from the mesh.
MeshReport
    With `return_report`:

    - ``distance``: as above.
    - ``left_out``: parts of the surface that may be farther than the tolerance from the mesh, in boxes. All numbers are
      float64 in world units. ``positions``, (N, 3): centres of the boxes. ``sizes``, (N, 3): sizes of the boxes along
      the volume's axes. ``distances``, (N,): bounds on the distances of the parts from the mesh.
    - ``self_intersections``: the number of pairs of faces that meet elsewhere than at common vertices and edges, by
      exact arithmetic.

Raises
------
ValueError
    For a tolerance that is not positive or too small, a tolerance and `faces` together, `return_distance` or
    `return_report` without either, and both of them together. For fewer `faces` than any mesh of the surface has; the
    error names the fewest that were found, and the distance of that mesh.

Warns
-----
UserWarning
    If the distance exceeds the tolerance, for example where sheets of the surface meet in a point; if parts of the
    surface are left out; if faces cross.

Notes
-----
Without a tolerance, the topology follows from the signs at the corners of cells: parts of the surface that cross no
edge of the lattice an odd number of times are missed. With a tolerance, cells are subdivided where Bernstein
coefficients do not prove that mesh and surface are near to each other. Only parts between the nodes of the finest
lattice, 1/32 of a cell apart, can be left out, and then they are listed.

References
----------
.. [1] W. Lorensen, H. Cline, "Marching cubes: a high resolution 3D surface construction algorithm", SIGGRAPH 1987.
.. [2] M. Garland, P. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = field.volume(32)
>>> ball = isospline.Isosurface(volume, field.level)
>>> mesh = ball.to_mesh()
>>> coarse, distance = ball.to_mesh(0.02, return_distance=True)
>>> len(coarse.faces) < len(mesh.faces), distance <= 0.02
(True, True)
>>> small, distance = ball.to_mesh(faces=500, return_distance=True)
>>> 425 <= len(small.faces) <= 500, distance < 0.02
(True, True)
)";

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
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    surface.def("to_mesh", &mesh_of, py::arg("tolerance") = py::none(), py::kw_only(), py::arg("faces") = py::none(),
                py::arg("return_distance") = false, py::arg("return_report") = false, py::arg("progress") = py::none(),
                to_mesh_doc);
}

} // namespace isospline
