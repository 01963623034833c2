#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/scene/scene.h"
#include "isospline/util/check.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* extent_doc = R"(The extent, along directions, of all objects that the camera sees.

.. math:: \min_x \langle n, x \rangle, \quad \max_x \langle n, x \rangle

over all points x of meshes, surfaces and caps, after all cuts. `camera_for` fits this extent into the image. Objects
that the camera does not see are left out.

Parameters
----------
directions : (..., 3) array_like of numbers
    The vectors n, of any length, in world space.

Returns
-------
(..., 2) float64 array
    The smallest and the largest product; world units if n has unit length. For isosurfaces, the interval may be wider
    than the exact one, by less than two cells at each end. inf and -inf if no object is visible.

Raises
------
ValueError
    For a direction that is not finite.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.torus()
>>> torus = field.volume(64)
>>> isospline.Scene([isospline.Isosurface(torus, field.level)]).extent([(0, 0, 1), (1, 1, 0)]).round(1)
array([[-0.3,  0.3],
       [-1.2,  1.2]])
)";

py::array_t<double> extent_of(Scene& scene, const py::object& directions)
{
    const RowArray rows(directions, "directions", 3);
    std::vector<glm::dvec3> both_ways;
    for (std::size_t i = 0; i < rows.count(); ++i) {
        check_finite("directions", rows.vector(i));
        both_ways.push_back(-rows.vector(i));
        both_ways.push_back(rows.vector(i));
    }
    auto result = new_array<double>(rows.leading_shape(), {2});
    double* next = result.mutable_data();
    long_call("to find the extent of a scene", py::none(), [&](const Progress& progress) {
        const std::vector<double> reach = scene.snapshot(progress)->reach(both_ways, progress);
        for (std::size_t i = 0; i < reach.size(); ++i)
            *next++ = i % 2 == 0 ? -reach[i] : reach[i];
    });
    return result;
}

} // namespace

void bind_extent(py::module_& module)
{
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("extent", &extent_of, py::arg("directions"), extent_doc);
}

} // namespace isospline
