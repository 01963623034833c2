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
#include "isospline/query/contains.h"
#include "isospline/query/lattice_metric.h"
#include "isospline/query/solid.h"
#include "isospline/trace/certified_ray.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* contains_doc = R"(Whether points are in the solid that the surface bounds.

.. math:: f(\mathbf{x}) \ge f_0, \text{ or } f(\mathbf{x}) < f_0 \text{ for } \texttt{inside="below"}

Parameters
----------
points : (..., 3) array_like, world units
certify : bool
    Returns what is proven of the model of the stored float32 coefficients, by arithmetic that accounts for all
    rounding. For surfaces without `clip`, `mask` and `largest`, and not `closed`.

Returns
-------
(...) bool array, or uint8 array
    By the sign of :math:`f - f_0`, evaluated in float64; where f equals the level, it counts as above. Parts that
    `clip` or `mask` cut away are outside. So is everything outside of `volume.bounds`, for each boundary rule.

    With `certify`, 1 for a point that is proven to be in the solid, 0 for one that is proven not to be, and 2 for one
    that is undecided, because it is on the surface or on the border of the volume to within rounding.

Raises
------
ValueError
    For a point that is not finite. With `certify`, for a surface with `clip`, `mask` or `largest`, and a closed one.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = field.volume(32)
>>> isospline.Isosurface(volume, field.level).contains([(0, 0, 0), (0.6, 0, 0), (0.8, 0, 0), (5, 0, 0)])
array([ True,  True, False, False])
)";

constexpr const char* closest_points_doc = R"(The points of the surface that are nearest to given points.

Branch and bound over the cells of the shell and parts of them [1]_: a part is excluded only if its Bernstein
coefficients prove that the surface is not in it, or that it is not nearer there. The result is the global minimum, up
to the error bound that is returned with it.

Parameters
----------
points : (..., 3) array_like, world units
max_distance : float, world units
    Farther parts of the surface are not searched. A small distance saves most of the time.
tolerance : float, world units, optional
    The error bound that the search aims at; by default a millionth of the shortest edge of a voxel.

Returns
-------
ClosestPoints
    `points`, (..., 3) float64: on the surface, to about 1e-11 of a voxel; NaN if there is none within `max_distance`.
    `distances`, (...) float64: to these points; infinite if there is none. `error_bounds`, (...) float64: no part of
    the surface is nearer than ``minimum(distances, max_distance) - error_bounds``, up to rounding. `primitive_ids`,
    (...) uint64: of the cells and caps, as in `Scene.cast_rays`, or INVALID_PRIMITIVE_ID. `primitive_normals`, (..., 3)
    float64: unit, outward; zero if there is no point, or the gradient vanishes.

Raises
------
ValueError
    For a point that is not finite or has a coordinate above 1e100, a `max_distance` below 0, and a tolerance that is
    not above 0.

Notes
-----
Parts that `mask` and `clip` cut away are ignored. Caps count as surface: the nearest point may be
on a cap. If the surface is open, the nearest point may be on the rim of the cut or of the volume. The search ends after
16384 parts. So the error bound exceeds the tolerance only if too many parts of the surface are almost equally near, as
at the centre of a sphere.

The bound is on the distance. If the nearest point is at distance d, a point of the surface whose distance is larger by
e may be about sqrt(2 e d) away from it. Most results are nevertheless exact up to rounding, because Newton's method
finds them.

The first call at a level builds a tree of the shell.

References
----------
.. [1] A. H. Land, A. G. Doig, "An automatic method of solving discrete programming problems", Econometrica 28, 1960.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = field.volume(32)
>>> surface = isospline.Isosurface(volume, field.level)
>>> nearest = surface.closest_points([(0.2, 0, 0), (0, 0, 3)])
>>> nearest["distances"].round(4)
array([0.5, 2.3])
>>> nearest["points"].round(4) + 0.0
array([[0.7, 0. , 0. ],
       [0. , 0. , 0.7]])
>>> bool((nearest["error_bounds"] < 1e-7).all())
True
)";

constexpr const char* signed_distance_doc = R"(Distances of points from the surface, negative inside.

Parameters
----------
points : (..., 3) array_like, world units
max_distance, tolerance : float, world units
    As in `closest_points`.

Returns
-------
(...) float64 array
    The distance from `closest_points`, world units, with a sign from `contains`; plus or minus infinity if the surface
    is farther away than `max_distance`.

Raises
------
ValueError
    As in `closest_points`.

Warns
-----
UserWarning
    If distances may be too large by more than the tolerance. `closest_points` returns an error bound for each.

Notes
-----
Distances are those to the surface f = level and to its caps. Other ends of the solid, at a cut that is not capped or at
the border of a volume that is not closed, do not count.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.torus(0.6, 0.25)
>>> volume = field.volume(64)
>>> surface = isospline.Isosurface(volume, field.level)
>>> surface.signed_distance([(0.6, 0, 0.1), (0.6, 0, 0.5), (0.2, 0, 0)]).round(3)
array([-0.15,  0.25,  0.15])
)";

/// What is proven of the sides of points.
py::array certified_sides(const Isosurface& surface, const RowArray& rows)
{
    auto result = new_array<std::uint8_t>(rows.leading_shape());
    std::uint8_t* const to = result.mutable_data();
    const RayCertifier certifier(surface.snapshot(), glm::dmat4(1.0));
    long_call("to certify " + std::to_string(rows.count()) + " points", py::none(), [&](const Progress& progress) {
        check_points(rows);
        parallel_for(
            rows.count(), 4096,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t row = begin; row < end; ++row)
                    to[row] = code_of(certifier.contains(rows.vector(row)));
            },
            progress);
    });
    return result;
}

py::array contains_points(const Isosurface& surface, const py::object& points, bool certify)
{
    const RowArray rows(points, "points", 3);
    if (certify)
        return certified_sides(surface, rows);
    auto result = new_array<bool>(rows.leading_shape());
    bool* const to = result.mutable_data();
    const auto snapshot = surface.snapshot();
    long_call("to test " + std::to_string(rows.count()) + " points", py::none(), [&](const Progress& progress) {
        check_points(rows);
        const VisitingOrder order(snapshot->volume(), rows);
        parallel_for(
            rows.count(), 4096,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t time = begin; time < end; ++time)
                    to[order[time]] = contains(*snapshot, rows.vector(order[time]));
            },
            progress);
    });
    return result;
}

/// Calls `visit(row, closest point)` in parallel for all points, without the GIL.
template <typename Visit>
void for_each_closest_point(const IsosurfaceSnapshot& surface, const RowArray& points, double max_distance,
                            const std::optional<double>& tolerance, const Visit& visit)
{
    ClosestPointOptions options;
    options.max_distance = max_distance;
    if (tolerance) {
        check_positive("tolerance", *tolerance);
        options.tolerance = *tolerance;
    }
    long_call("to find " + std::to_string(points.count()) + " nearest points", py::none(),
              [&](const Progress& progress) {
                  check_points(points);
                  check_reach(points);
                  options.progress = progress;
                  ClosestPointFinder check(surface, options); // checks the options even if there are no points
                  const VisitingOrder order(surface.volume(), points);
                  parallel_for(
                      points.count(), 64,
                      [&](std::size_t begin, std::size_t end) {
                          ClosestPointFinder find(surface, options);
                          for (std::size_t time = begin; time < end; ++time)
                              visit(order[time], find(points.vector(order[time])));
                      },
                      progress);
              });
}

py::object closest_points(const Isosurface& surface, const py::object& points, double max_distance,
                          const std::optional<double>& tolerance)
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
    for_each_closest_point(*snapshot, rows, max_distance, tolerance, [&](std::size_t row, const ClosestPoint& closest) {
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
                                    const std::optional<double>& tolerance)
{
    const RowArray rows(points, "points", 3);
    auto result = new_array<double>(rows.leading_shape());
    double* const to = result.mutable_data();
    std::atomic<std::size_t> uncertain = 0;
    const double aim =
        tolerance.value_or(1e-6 * LatticeMetric(surface.volume().lattice_to_world()).shortest_edge) * (1.0 + 1e-6);
    const auto snapshot = surface.snapshot();
    for_each_closest_point(*snapshot, rows, max_distance, tolerance, [&](std::size_t row, const ClosestPoint& closest) {
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

constexpr const char* to_mask_doc =
    R"(The samples that are in the solid, as bool array.

Sums and means of the mask, and of data in it, are those of the samples of the solid: ``to_mask().mean()`` of pores is
the porosity by counting. `enclosed_volume` is more precise.

Parameters
----------
whole_cells : bool
    Whether to return the samples of all cells that contain a part of the solid instead: their centres (degree 2) or
    their corners (odd degrees). As `mask` of another surface of the volume, this keeps all of the other one that is in
    this solid. These are more samples than those in the solid.
progress : callable, optional
    Called with the finished fraction; cancels if it returns a false value other than None.

Returns
-------
bool array of the volume's shape
    True where a sample's position is in the solid, as `mask`, `largest` and `clip` leave it. f is compared with the
    level there: a sample where it equals the level is in the solid if that is above. Samples on a plane of `clip` and
    at the border of the volume can be in the solid.

Examples
--------
The bones in a body, without the table on which it lies:

>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[0:32, 0:32, 0:32]
>>> samples = np.where(z > 9, 0.0, -1000.0)
>>> samples[z < 5] = 700  # the table
>>> samples[(x - 16) ** 2 + (y - 16) ** 2 + (z - 20) ** 2 < 36] = 700  # a bone
>>> volume = isospline.Volume(samples)
>>> body = isospline.Isosurface(volume, -500, largest=1)
>>> bones = isospline.Isosurface(volume, 300, mask=body.to_mask(whole_cells=True))
>>> len(isospline.Isosurface(volume, 300).components().bounds), len(bones.components().bounds)
(2, 1)

The samples of a body, counted:

>>> int(body.to_mask().sum()), int((samples[9:] > -500).sum())
(22528, 22528)
)";

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
    constexpr double infinity = std::numeric_limits<double>::infinity();
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    surface
        .def("contains", &contains_points, py::arg("points"), py::kw_only(), py::arg("certify") = false, contains_doc)
        .def("to_mask", &to_mask, py::kw_only(), py::arg("whole_cells") = false, py::arg("progress") = py::none(),
             to_mask_doc)
        .def("closest_points", &closest_points, py::arg("points"), py::kw_only(), py::arg("max_distance") = infinity,
             py::arg("tolerance") = py::none(), closest_points_doc)
        .def("signed_distance", &signed_distance, py::arg("points"), py::kw_only(), py::arg("max_distance") = infinity,
             py::arg("tolerance") = py::none(), signed_distance_doc);
}

} // namespace isospline
