#include "arrays.h"
#include "bind.h"
#include "certificates.h"
#include "long_call.h"
#include "points.h"
#include "results.h"
#include "visiting_order.h"
#include "warn.h"

#include "isospline/measure/components.h"
#include "isospline/query/closest_point.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/query/solid.h"
#include "isospline/trace/certified_ray.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

/// What is proven of the sides of points.
py::array certified_sides(const Isosurface& surface, const RowArray& rows, const py::object& progress)
{
    auto result = new_array<std::uint8_t>(rows.leading_shape());
    std::uint8_t* const to = result.mutable_data();
    const RayCertifier certifier(surface.snapshot(), glm::dmat4(1.0));
    long_call("to certify " + std::to_string(rows.count()) + " points", progress, [&](const Progress& report) {
        check_points(rows);
        parallel_for(
            rows.count(), 4096,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t row = begin; row < end; ++row)
                    to[row] = code_of(certifier.contains(rows.vector(row)));
            },
            report);
    });
    return result;
}

py::array contains_points(const Isosurface& surface, const py::object& points, bool certify, const py::object& progress)
{
    const RowArray rows(points, "points", 3);
    if (certify)
        return certified_sides(surface, rows, progress);
    auto result = new_array<bool>(rows.leading_shape());
    bool* const to = result.mutable_data();
    const auto snapshot = surface.snapshot();
    long_call("to test " + std::to_string(rows.count()) + " points", progress, [&](const Progress& report) {
        check_points(rows);
        const VisitingOrder order(snapshot->volume(), rows);
        parallel_for(
            rows.count(), 4096,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t time = begin; time < end; ++time)
                    to[order[time]] = contains(*snapshot, rows.vector(order[time]));
            },
            report);
    });
    return result;
}

/// Calls `visit(row, closest point)` in parallel for all points, without the GIL.
template <typename Visit>
void for_each_closest_point(const IsosurfaceSnapshot& surface, const RowArray& points, double max_distance,
                            const std::optional<double>& tolerance, const py::object& progress, const Visit& visit)
{
    ClosestPointOptions options;
    options.max_distance = max_distance;
    if (tolerance) {
        check_positive("tolerance", *tolerance);
        options.tolerance = *tolerance;
    }
    long_call("to find " + std::to_string(points.count()) + " nearest points", progress, [&](const Progress& report) {
        check_points(points);
        check_reach(points);
        options.progress = only_cancelling(report);
        ClosestPointFinder check(surface, options); // checks the options even if there are no points
        const VisitingOrder order(surface.volume(), points);
        parallel_for(
            points.count(), 64,
            [&](std::size_t begin, std::size_t end) {
                ClosestPointFinder find(surface, options);
                for (std::size_t time = begin; time < end; ++time)
                    visit(order[time], find(points.vector(order[time])));
            },
            report);
    });
}

py::object closest_points(const Isosurface& surface, const py::object& points, double max_distance,
                          const std::optional<double>& tolerance, const py::object& progress)
{
    const RowArray rows(points, "points", 3);
    const Shape shape = rows.leading_shape();
    auto positions = new_array<double>(shape, {3}), normals = new_array<double>(shape, {3});
    auto distances = new_array<double>(shape), errors = new_array<double>(shape);
    auto ids = new_array<std::uint64_t>(shape);
    double *const to_position = positions.mutable_data(), *const to_normal = normals.mutable_data(),
                  *const to_distance = distances.mutable_data(), *const to_error = errors.mutable_data();
    std::uint64_t* const to_id = ids.mutable_data();
    const auto snapshot = surface.snapshot();
    for_each_closest_point(*snapshot, rows, max_distance, tolerance, progress,
                           [&](std::size_t row, const ClosestPoint& closest) {
                               std::copy_n(&closest.position[0], 3, to_position + 3 * row);
                               std::copy_n(&closest.normal[0], 3, to_normal + 3 * row);
                               to_distance[row] = closest.distance;
                               to_error[row] = closest.error;
                               to_id[row] = closest.primitive_id;
                           });
    py::dict result;
    result["points"] = positions;
    result["distances"] = distances;
    result["error_bounds"] = errors;
    result["primitive_ids"] = ids;
    result["primitive_normals"] = normals;
    return as_result("ClosestPoints", result);
}

py::array_t<double> signed_distance(const Isosurface& surface, const py::object& points, double max_distance,
                                    const std::optional<double>& tolerance, const py::object& progress)
{
    const RowArray rows(points, "points", 3);
    auto result = new_array<double>(rows.leading_shape());
    double* const to = result.mutable_data();
    std::atomic<std::size_t> uncertain = 0;
    const double aim =
        tolerance.value_or(1e-6 * LatticeMetric(surface.volume().lattice_to_world()).shortest_edge) * (1.0 + 1e-6);
    const auto snapshot = surface.snapshot();
    for_each_closest_point(*snapshot, rows, max_distance, tolerance, progress,
                           [&](std::size_t row, const ClosestPoint& closest) {
                               to[row] = contains(*snapshot, rows.vector(row)) ? -closest.distance : closest.distance;
                               uncertain += closest.error > aim;
                           });
    if (uncertain > 0) {
        std::ostringstream text;
        text << uncertain << " of " << rows.count() << " distances may be too large by more than the tolerance, " << aim
             << ": see the error bounds of closest_points";
        warn(text.str());
    }
    return result;
}

py::array_t<bool> to_mask(const Isosurface& surface, bool whole_cells, const py::object& progress)
{
    const auto snapshot = surface.snapshot();
    Mask mask;
    long_call("to find the samples of a solid", progress, [&](const Progress& report) {
        mask = whole_cells ? mask_of_cells(solid_of(*snapshot), report) : samples_inside(*snapshot, report);
    });
    const Volume& volume = snapshot->volume();
    auto array = new_grid<bool>(volume.shape(), volume.options().axes);
    std::copy(mask.begin(), mask.end(), array.mutable_data());
    return array;
}

} // namespace

void bind_point_queries(py::module_& module)
{
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    surface.def("contains", &contains_points)
        .def("to_mask", &to_mask)
        .def("closest_points", &closest_points)
        .def("signed_distance", &signed_distance);
}

} // namespace isospline
