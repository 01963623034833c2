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
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

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
    options.progress = only_cancelling(progress);
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
                          const std::optional<double>& tolerance, const py::object& progress)
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
    long_call("to find " + std::to_string(rows.count()) + " nearest points", progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
        for_each_closest_point(*snapshot, rows, closest_point_options(max_distance, tolerance),
                               part_of(report, 0.05, 1.0), [&](std::size_t row, const SceneClosestPoint& closest) {
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
                                    const std::optional<double>& tolerance, const py::object& progress)
{
    const RowArray rows(points, "points", 3);
    auto result = new_array<double>(rows.leading_shape());
    double* const to = result.mutable_data();
    long_call("to find " + std::to_string(rows.count()) + " distances", progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
        std::vector<std::uint8_t> occupied(rows.count());
        find_occupancies(*snapshot, rows, occupied.data(), part_of(report, 0.05, 0.2));
        for_each_closest_point(*snapshot, rows, closest_point_options(max_distance, tolerance),
                               part_of(report, 0.2, 1.0), [&](std::size_t row, const SceneClosestPoint& closest) {
                                   to[row] = occupied[row] != 0 ? -closest.distance : closest.distance;
                               });
    });
    return result;
}

py::array_t<bool> occupancy(Scene& scene, const py::object& points, const py::object& progress)
{
    const RowArray rows(points, "points", 3);
    auto result = new_array<bool>(rows.leading_shape());
    auto* const to = reinterpret_cast<std::uint8_t*>(result.mutable_data());
    long_call("to test " + std::to_string(rows.count()) + " points", progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
        find_occupancies(*snapshot, rows, to, part_of(report, 0.05, 1.0));
    });
    return result;
}

} // namespace

void bind_scene_points(py::module_& module)
{
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("closest_points", &closest_points)
        .def("signed_distance", &signed_distance)
        .def("occupancy", &occupancy);
}

} // namespace isospline
