#include "bind.h"
#include "long_call.h"

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

constexpr const char* to_mesh_doc = R"(A triangle mesh of the surface, clipped and capped as it is.

.. math:: |f(\mathbf{v}) - f_0| \approx 0 \text{ for every vertex } \mathbf{v} \text{ that is not on a cap}

The mesh is a manifold: an edge has two faces, or one where the surface ends, at the border of the volume, at what
`mask` cuts away and at a `clip` that is not capped. It is watertight where the surface is closed, whatever the samples
are. Faces are counter-clockwise as seen from outside; normals are the exact ones, of caps those of their planes, of
vertices that a cap shares with the surface those of the surface.

Parameters
----------
tolerance : float, optional
    The largest distance between the surface and the mesh, either way, world units: there are as few triangles as that
    takes, up to what collapsing edges finds. Without it, the vertices are where the surface crosses the edges of cells.
return_distance : bool
    Whether to return the distance that was measured, too. Takes a tolerance.
progress : callable, optional
    Called with the finished fraction; cancels where it returns a false value other than None.

Returns
-------
Mesh
    In the volume's world space; without faces where there is no surface.
float
    With `return_distance`: the largest distance found, world units, of points of the mesh at most a quarter of a cell
    apart from the surface, and of the vertices of the mesh before its edges were collapsed from the mesh.

Raises
------
ValueError
    For a tolerance that is not positive.

Warns
-----
UserWarning
    Where the distance is above the tolerance, as where sheets of the surface meet in a point.

Notes
-----
Without a tolerance the lattice of the cells' corners is what the topology follows: parts of the surface that no edge
of it crosses an odd number of times are not seen. With one, cells are cut smaller, down to a 32nd, until in each part
the surface is proven, by the Bernstein coefficients of the model, to be absent or within 0.7 times the tolerance of a
plane.

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
        throw_invalid("return_distance", "a tolerance beside it", "none");
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
             << " that were asked for";
        if (PyErr_WarnEx(PyExc_UserWarning, text.str().c_str(), 1) != 0)
            throw py::error_already_set();
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
