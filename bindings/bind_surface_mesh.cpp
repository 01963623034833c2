#include "bind.h"
#include "long_call.h"
#include "warn.h"

#include "isospline/polygonize/surface_mesh.h"
#include "isospline/scene/mesh.h"
#include "isospline/util/error.h"

#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <sstream>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* to_mesh_doc = R"(A triangle mesh of the surface, with its clip and caps.

.. math:: |f(\mathbf{v}) - f_0| \approx 0 \text{ for every vertex } \mathbf{v} \text{ that is not on a cap}

The mesh is a manifold: an edge has two faces, or one where the surface ends, which is at the border of the volume if
it is not closed, at cuts by `mask`, and at a `clip` that is not capped. If the surface is closed, the mesh is
watertight for all samples. Faces are counter-clockwise as seen from outside. Normals are exact. On caps they are
those of the planes; at vertices that a cap shares with the surface, those of the surface.

Parameters
----------
tolerance : float, optional
    The largest distance between the surface and the mesh, in both directions, in world units. Edges are collapsed as
    long as it holds. Without a tolerance, the vertices are where the surface crosses the edges of cells.
return_distance : bool
    Whether to return the measured distance as well. Needs a tolerance.
progress : callable, optional
    Called with the finished fraction; cancels if it returns a false value other than None.

Returns
-------
Mesh
    In the volume's world space; without faces if there is no surface.
float
    With `return_distance`: the largest measured distance, in world units. It is measured from points of the mesh, at
    most a quarter of a cell apart, to the surface; and from the vertices before simplification to the mesh.

Raises
------
ValueError
    For a tolerance that is not positive.

Warns
-----
UserWarning
    If the distance exceeds the tolerance, for example where sheets of the surface meet in a point.

Notes
-----
Without a tolerance, the topology follows from the signs at the corners of cells: parts of the surface that cross no
edge of the lattice an odd number of times are missed. With a tolerance, cells are subdivided, down to 1/32, until the
Bernstein coefficients of the model prove for each part that the surface is absent or within 0.7 times the tolerance of
a plane.

References
----------
.. [1] W. Lorensen, H. Cline, "Marching cubes: a high resolution 3D surface construction algorithm", SIGGRAPH 1987.
.. [2] M. Garland, P. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = isospline.Volume(field.samples(32), **field.grid(32))
>>> ball = isospline.Isosurface(volume, field.level)
>>> mesh = ball.to_mesh()
>>> coarse, distance = ball.to_mesh(0.02, return_distance=True)
>>> len(coarse.faces) < len(mesh.faces), distance <= 0.02
(True, True)
)";

py::object mesh_of(const Isosurface& surface, const std::optional<double>& tolerance, bool return_distance,
                   const py::object& progress)
{
    if (return_distance && !tolerance)
        throw_invalid("return_distance", "a tolerance as well", "none");
    const auto snapshot = surface.snapshot();
    std::shared_ptr<Mesh> mesh;
    double distance = 0.0;
    long_call("to make a mesh", progress, [&](const Progress& report) {
        SurfaceMesh made = to_mesh(*snapshot, tolerance, report);
        distance = made.distance;
        mesh = std::make_shared<Mesh>(std::move(made.vertices), std::move(made.faces), std::move(made.normals));
    });
    if (tolerance && distance > *tolerance) {
        std::ostringstream text;
        text << "tolerance: the mesh is up to " << distance << " from the surface, more than the " << *tolerance
             << " that was requested";
        warn(text.str());
    }
    if (return_distance)
        return py::make_tuple(mesh, distance);
    return py::cast(mesh);
}

} // namespace

void bind_surface_mesh(py::module_& module)
{
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    surface.def("to_mesh", &mesh_of, py::arg("tolerance") = py::none(), py::kw_only(),
                py::arg("return_distance") = false, py::arg("progress") = py::none(), to_mesh_doc);
}

} // namespace isospline
