#include "arrays.h"
#include "bind.h"
#include "long_call.h"
#include "points.h"
#include "results.h"
#include "visiting_order.h"

#include "isospline/scene/scene.h"
#include "isospline/scene/scene_points.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* closest_points_doc = R"(The points of the scene's objects that are nearest to given points.

Parameters
----------
points : (..., 3) array_like, world units
max_distance : float, world units
    Parts that are farther away are not searched.
tolerance : float, world units, optional
    As in `Isosurface.closest_points`.

Returns
-------
ClosestPoints
    As in `Isosurface.closest_points`: `points`, `distances`, `error_bounds` (0 on meshes), `primitive_ids`,
    `primitive_normals`. Also `geometry_ids`, (...) uint32: INVALID_ID if nothing is within `max_distance`; and
    `primitive_uvs`, (..., 2) float64: weights of a triangle's second and third corner; 0 on isosurfaces.

Raises
------
ValueError
    As in `Isosurface.closest_points`.

Notes
-----
Objects are those that `cast_rays` sees, with their transforms, including shear and mirroring, and with the caps of
isosurfaces. If several objects are equally near, the one with the smallest id is returned.

Examples
--------
>>> import isospline
>>> tetrahedron = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
...                              [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
>>> scene = isospline.Scene([tetrahedron])
>>> nearest = scene.closest_points([(0.2, 0.3, -2)])
>>> nearest["points"].round(6), nearest["distances"], nearest["primitive_ids"]
(array([[0.2, 0.3, 0. ]]), array([2.]), array([0], dtype=uint64))
)";

constexpr const char* signed_distance_doc =
    R"(Distances of points from the scene's objects; negative inside of any object.

Parameters
----------
points : (..., 3) array_like, world units
max_distance, tolerance : float, world units
    As in `closest_points`.

Returns
-------
(...) float64 array
    The distance from `closest_points`, world units, with a sign from `occupancy`; plus or minus infinity if nothing is
    within `max_distance`.

Raises
------
ValueError
    As in `closest_points`.

Examples
--------
>>> import isospline
>>> tetrahedron = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
...                              [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
>>> isospline.Scene([tetrahedron]).signed_distance([(0.1, 0.2, 0.3), (-1, 0, 0)])
array([-0.1,  1. ])
)";

constexpr const char* occupancy_doc = R"(Whether points are inside of any object of the scene.

Parameters
----------
points : (..., 3) array_like, world units

Returns
-------
(...) bool array
    For an isosurface, the result of `Isosurface.contains`. A point is inside of a mesh, which must be closed, if a ray
    from it meets the mesh's triangles an odd number of times. Only objects that `cast_rays` sees count.

Raises
------
ValueError
    For a point that is not finite.

Examples
--------
>>> import isospline
>>> tetrahedron = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
...                              [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
>>> isospline.Scene([tetrahedron]).occupancy([(0.1, 0.2, 0.3), (-1, 0, 0)])
array([ True, False])
)";

ClosestPointOptions closest_point_options(double max_distance, const std::optional<double>& tolerance)
{
    ClosestPointOptions options;
    options.max_distance = max_distance;
    if (tolerance) {
        check_positive("tolerance", *tolerance);
        options.tolerance = *tolerance;
    }
    return options;
}

/// Calls `visit(row, closest point)` in parallel for all points.
template <typename Visit>
void for_each_closest_point(const SceneSnapshot& scene, const RowArray& points, ClosestPointOptions options,
                            const Progress& progress, const Visit& visit)
{
    check_points(points);
    check_reach(points);
    options.progress = progress;
    SceneClosestPointFinder check(scene, options); // checks the options even if there are no points
    const VisitingOrder order(scene, points);
    parallel_for(
        points.count(), 64,
        [&](std::size_t begin, std::size_t end) {
            SceneClosestPointFinder find(scene, options);
            for (std::size_t time = begin; time < end; ++time)
                visit(order[time], find(points.vector(order[time])));
        },
        progress);
}

void find_occupancies(const SceneSnapshot& scene, const RowArray& points, std::uint8_t* to, const Progress& progress)
{
    check_points(points);
    const VisitingOrder order(scene, points);
    parallel_for(
        points.count(), 4096,
        [&](std::size_t begin, std::size_t end) {
            std::vector<glm::dvec3> chunk;
            for (std::size_t time = begin; time < end; ++time)
                chunk.push_back(points.vector(order[time]));
            std::vector<std::uint8_t> occupied(chunk.size());
            find_occupancy(scene, chunk, occupied);
            for (std::size_t time = begin; time < end; ++time)
                to[order[time]] = occupied[time - begin];
        },
        progress);
}

py::object closest_points(Scene& scene, const py::object& points, double max_distance,
                          const std::optional<double>& tolerance)
{
    const RowArray rows(points, "points", 3);
    const Shape shape = rows.leading_shape();
    auto positions = new_array<double>(shape, {3}), normals = new_array<double>(shape, {3});
    auto uvs = new_array<double>(shape, {2});
    auto distances = new_array<double>(shape), errors = new_array<double>(shape);
    auto ids = new_array<std::uint64_t>(shape);
    auto geometries = new_array<std::uint32_t>(shape);
    double *const to_position = positions.mutable_data(), *const to_normal = normals.mutable_data(),
                  *const to_uv = uvs.mutable_data(), *const to_distance = distances.mutable_data(),
                  *const to_error = errors.mutable_data();
    std::uint64_t* const to_id = ids.mutable_data();
    std::uint32_t* const to_geometry = geometries.mutable_data();
    long_call("to find " + std::to_string(rows.count()) + " nearest points", py::none(), [&](const Progress& progress) {
        const auto snapshot = scene.snapshot(progress);
        for_each_closest_point(*snapshot, rows, closest_point_options(max_distance, tolerance), progress,
                               [&](std::size_t row, const SceneClosestPoint& closest) {
                                   std::copy_n(&closest.position[0], 3, to_position + 3 * row);
                                   std::copy_n(&closest.normal[0], 3, to_normal + 3 * row);
                                   std::copy_n(&closest.uv[0], 2, to_uv + 2 * row);
                                   to_distance[row] = closest.distance;
                                   to_error[row] = closest.error;
                                   to_id[row] = closest.primitive_id;
                                   to_geometry[row] = closest.geometry_id;
                               });
    });
    py::dict result;
    result["points"] = positions;
    result["distances"] = distances;
    result["error_bounds"] = errors;
    result["geometry_ids"] = geometries;
    result["primitive_ids"] = ids;
    result["primitive_uvs"] = uvs;
    result["primitive_normals"] = normals;
    return as_result("ClosestPoints", result);
}

py::array_t<double> signed_distance(Scene& scene, const py::object& points, double max_distance,
                                    const std::optional<double>& tolerance)
{
    const RowArray rows(points, "points", 3);
    auto result = new_array<double>(rows.leading_shape());
    double* const to = result.mutable_data();
    long_call("to find " + std::to_string(rows.count()) + " distances", py::none(), [&](const Progress& progress) {
        const auto snapshot = scene.snapshot(progress);
        std::vector<std::uint8_t> occupied(rows.count());
        find_occupancies(*snapshot, rows, occupied.data(), part_of(progress, 0.0, 0.2));
        for_each_closest_point(*snapshot, rows, closest_point_options(max_distance, tolerance),
                               part_of(progress, 0.2, 1.0), [&](std::size_t row, const SceneClosestPoint& closest) {
                                   to[row] = occupied[row] != 0 ? -closest.distance : closest.distance;
                               });
    });
    return result;
}

py::array_t<bool> occupancy(Scene& scene, const py::object& points)
{
    const RowArray rows(points, "points", 3);
    auto result = new_array<bool>(rows.leading_shape());
    auto* const to = reinterpret_cast<std::uint8_t*>(result.mutable_data());
    long_call("to test " + std::to_string(rows.count()) + " points", py::none(),
              [&](const Progress& progress) { find_occupancies(*scene.snapshot(progress), rows, to, progress); });
    return result;
}

/// Open3D casts several rays and takes a vote. Our rays are exact, so one is enough.
void check_sample_count(int nsamples)
{
    if (nsamples < 1 || nsamples % 2 == 0)
        throw_invalid("nsamples", "an odd number above 0", nsamples);
}

} // namespace

void bind_scene_points(py::module_& module)
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("closest_points", &closest_points, py::arg("points"), py::kw_only(), py::arg("max_distance") = infinity,
             py::arg("tolerance") = py::none(), closest_points_doc)
        .def("signed_distance", &signed_distance, py::arg("points"), py::kw_only(), py::arg("max_distance") = infinity,
             py::arg("tolerance") = py::none(), signed_distance_doc)
        .def("occupancy", &occupancy, py::arg("points"), occupancy_doc)
        .def(
            "compute_closest_points",
            [](Scene& scene, const py::object& query_points) {
                return closest_points(scene, query_points, infinity, std::nullopt);
            },
            py::arg("query_points"), "Open3D's name for `closest_points`.")
        .def(
            "compute_distance",
            [](Scene& scene, const py::object& query_points) -> py::object {
                return closest_points(scene, query_points, infinity, std::nullopt)[py::str("distances")];
            },
            py::arg("query_points"), "Open3D's name for the `distances` of `closest_points`.")
        .def(
            "compute_signed_distance",
            [](Scene& scene, const py::object& query_points, int nsamples) {
                check_sample_count(nsamples);
                return signed_distance(scene, query_points, infinity, std::nullopt);
            },
            py::arg("query_points"), py::arg("nsamples") = 1,
            "Open3D's name for `signed_distance`. `nsamples`, an odd number, has no effect, because rays are exact.")
        .def(
            "compute_occupancy",
            [](Scene& scene, const py::object& query_points, int nsamples) {
                check_sample_count(nsamples);
                return occupancy(scene, query_points).attr("astype")("float32");
            },
            py::arg("query_points"), py::arg("nsamples") = 1,
            "Open3D's name for `occupancy`, as float32: 1 inside, 0 outside. `nsamples`, an odd number, has no\n"
            "effect.");
}

} // namespace isospline
