#include "arrays.h"
#include "bind.h"
#include "long_call.h"
#include "points.h"
#include "results.h"
#include "thickness_words.h"

#include "isospline/query/sample_surface.h"
#include "isospline/scene/scene.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* sample_points_doc = R"(Random points of the surface, uniform by area in world space.

Parameters
----------
count : int
    Number of points.
seed : int
    Seed of the random numbers, 0 to 2^32 - 1. The same seed gives the same points for any number of threads. A smaller
    count gives the first points of a larger one.

Returns
-------
SurfaceSamples
    `points`, (count, 3) float64: on the surface, world units, to about 1e-12 of a voxel. `primitive_ids`, (count,)
    uint64: of the cells and caps. `primitive_normals`, (count, 3) float64: unit, outward.

Raises
------
ValueError
    For a count below 0, a seed out of range, and, unless the count is 0, a surface without points.

Notes
-----
The surface is f = level, without the parts that `mask` and `clip` cut away, and with its caps.

The mean of a function over these points, times `area`, is an estimate of its integral.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = field.volume(32)
>>> points = isospline.Isosurface(volume, field.level).sample_points(1000)["points"]
>>> bool(abs(np.linalg.norm(points, axis=1) - 0.7).max() < 1e-3), bool(abs(points.mean(axis=0)).max() < 0.05)
(True, True)
)";

constexpr const char* thickness_doc = R"(The thickness of the solid at points of its surface.

Parameters
----------
points : (..., 3) array_like, world units
    On the surface, such as those of `sample_points`. For other points, the nearest points of the surface are used.
method : {"max_sphere", "ray"}
    "ray" is the length of the inward normal within the solid. "max_sphere" is the diameter of the largest ball in the
    solid whose distance from the point is at most `ripple`.
ripple : float, optional
    For "max_sphere", world units: the height of ripples of the surface, such as those of noise, that do not matter. By
    default half of the shortest edge of a voxel. With 0, the ball touches the surface at the point, and the thickness
    is never larger than that of "ray".

Returns
-------
(...) float64 array, world units
    Infinite if there is no opposite side because the solid is open, at the border of the volume if it is not closed or
    at a cut that is not capped. NaN if the gradient vanishes or there is no surface.

Raises
------
ValueError
    For a point that is not finite or has a coordinate above 1e100, another method, and a ripple below 0.

Notes
-----
The names are those of trimesh.proximity.thickness. "max_sphere" is the local thickness of [1]_, for which a ball may be
`ripple` away from the point: a ball that has to touch a noisy surface at the point is bounded by the ripples beside it.
The ball shrinks on the inward normal [2]_. Then it moves to where it can grow, until it is the largest one nearby. Its
precision is a fiftieth of `ripple`, but from a thousandth to a hundredth of a voxel's shortest edge. On a smooth
surface, `ripple` has an effect only near edges and where the thickness changes: there, a ball may fit that is larger
than the touching one.

References
----------
.. [1] T. Hildebrand, P. Rüegsegger, "A new method for the model-independent assessment of thickness in
   three-dimensional images", Journal of Microscopy 185, 1997.
.. [2] J. Ma, S. W. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the normal field",
   The Visual Computer 28, 2012.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.torus(0.6, 0.25)
>>> volume = field.volume(48)
>>> torus = isospline.Isosurface(volume, field.level)
>>> torus.thickness([(0.85, 0, 0), (0, 0.6, 0.25)]).round(2), torus.thickness((0.6, 0, 0.25), method="ray").round(3)
(array([0.5, 0.5]), np.float64(0.5))
)";

py::object sample_points(const Isosurface& surface, std::int64_t count, std::int64_t seed)
{
    if (count < 0)
        throw_invalid("count", "a number of at least 0", count);
    if (seed < 0 || seed > 0xffffffffll)
        throw_invalid("seed", "0 to 4294967295", seed);
    auto positions = new_array<double>({count, 3}), normals = new_array<double>({count, 3});
    auto ids = new_array<std::uint64_t>({count});
    double *const to_position = positions.mutable_data(), *const to_normal = normals.mutable_data();
    std::uint64_t* const to_id = ids.mutable_data();
    const auto snapshot = surface.snapshot();
    long_call("to sample " + std::to_string(count) + " points", py::none(), [&](const Progress& progress) {
        snapshot->shell(progress);
        parallel_for(
            static_cast<std::size_t>(count), 256,
            [&](std::size_t begin, std::size_t end) {
                std::vector<SurfaceSample> samples(end - begin);
                sample_surface(*snapshot, static_cast<std::uint32_t>(seed), begin, samples);
                for (std::size_t i = begin; i < end; ++i) {
                    std::copy_n(&samples[i - begin].position[0], 3, to_position + 3 * i);
                    std::copy_n(&samples[i - begin].normal[0], 3, to_normal + 3 * i);
                    to_id[i] = samples[i - begin].primitive_id;
                }
            },
            progress);
    });
    py::dict result;
    result["points"] = positions;
    result["primitive_ids"] = ids;
    result["primitive_normals"] = normals;
    return as_result("SurfaceSamples", result);
}

py::array_t<double> thickness(const std::shared_ptr<Isosurface>& surface, const py::object& points,
                              const std::string& word, std::optional<double> ripple_height)
{
    const RowArray rows(points, "points", 3);
    if (ripple_height)
        check_not_negative("ripple", *ripple_height);
    const double ripple = ripple_height.value_or(default_ripple(*surface));
    const ThicknessMethod method = as_enum(thickness_words, word, "method");
    auto result = new_array<double>(rows.leading_shape());
    double* const to = result.mutable_data();
    long_call("to measure the thickness at " + std::to_string(rows.count()) + " points", py::none(),
              [&](const Progress& progress) {
                  check_points(rows);
                  check_reach(rows);
                  Scene scene;
                  scene.add(std::make_shared<Isosurface>(*surface));
                  const auto shown = scene.snapshot(progress);
                  const auto& at_level = *std::get<std::shared_ptr<const IsosurfaceSnapshot>>(shown->object(0).object);
                  parallel_for(
                      rows.count(), 64,
                      [&](std::size_t begin, std::size_t end) {
                          std::vector<glm::dvec3> chunk;
                          for (std::size_t row = begin; row < end; ++row)
                              chunk.push_back(rows.vector(row));
                          find_thickness(*shown, at_level, method, ripple, chunk, {to + begin, end - begin});
                      },
                      progress);
              });
    return result;
}

} // namespace

void bind_surface_points(py::module_& module)
{
    py::class_<Isosurface, std::shared_ptr<Isosurface>>(module.attr("Isosurface"))
        .def("sample_points", &sample_points, py::arg("count"), py::kw_only(), py::arg("seed") = 0, sample_points_doc)
        .def("thickness", &thickness, py::arg("points"), py::kw_only(), py::arg("method") = "max_sphere",
             py::arg("ripple") = py::none(), thickness_doc);
}

} // namespace isospline
