// Lists and numbers of the crossings of rays with a scene.
#include "arrays.h"
#include "bind.h"
#include "certificates.h"
#include "long_call.h"
#include "rays.h"
#include "results.h"

#include "isospline/scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* list_intersections_doc = R"(All crossings of each ray with the scene, in the order of t.

Each crossing is listed once, even on a face between cells, or on an edge or a corner of triangles. The crossings of a
closed isosurface, for example one with ``closed=True``, alternately enter and leave.

Parameters
----------
rays : (..., 6) array_like, float32 or float64
    As in `cast_rays`; ray i is the i-th in C order.
directions : (..., 3) array_like, optional
    As in `cast_rays`.
t_near, t_far : float
    Only crossings with t in [t_near, t_far] count.

Returns
-------
Crossings
    For N rays and M crossings. The crossings of ray i are the items from ``ray_splits[i]`` to ``ray_splits[i + 1]``.

    ``ray_splits``: (N + 1,) int64. ``ray_ids``: (M,) int64. ``t_hit``: (M,) float64. ``geometry_ids``:
    (M,) uint32. ``primitive_ids``: (M,) uint64, as in `cast_rays`. ``primitive_uvs``: (M, 2) float32, weights of a
    triangle's second and third corner, 0 for isosurfaces. ``primitive_normals``: (M, 3) float64, as in `cast_rays`.
    ``positions``: (M, 3) float64, world space. ``entering``: (M,) bool, whether the ray goes to the inner side,
    <normal, direction> < 0.

Raises
------
ValueError, TypeError
    As in `cast_rays`.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
>>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
>>> scene = isospline.Scene([isospline.Isosurface(volume, 5.0, inside="below")])
>>> crossings = scene.list_intersections([(-20, 0, 0, 1, 0, 0)])
>>> np.round(crossings["t_hit"]).tolist(), crossings["entering"].tolist()
([15.0, 25.0], [True, False])
)";

constexpr const char* count_intersections_doc = R"(The number of crossings of each ray with the scene.

Parameters
----------
rays, directions, t_near, t_far
    As in `list_intersections`.
certify : bool
    Returns instead whether the number is proven to be odd; for the scenes of `cast_rays` with `certify`.

Returns
-------
(...) int32 array, or uint8 array
    The number of crossings. With `certify`, 0 for a number that is proven to be even, 1 for one that is proven to be
    odd, and 2 for one that is undecided, because an end of the ray, or of its part in the volume, is on a surface to
    within rounding.

Raises
------
ValueError, TypeError
    As in `cast_rays`.
)";

/// All crossings of the rays of one chunk.
struct CrossingChunk {
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts;
};

/// The chunks of all rays, in the order of `given`.
std::vector<CrossingChunk> crossings_of(Scene& scene, GivenRays& given)
{
    std::vector<CrossingChunk> chunks((given.count() + ray_chunk_size - 1) / ray_chunk_size);
    long_call("to list the crossings of " + std::to_string(given.count()) + " rays", py::none(),
              [&](const Progress& progress) {
                  const auto snapshot = scene.snapshot(progress);
                  const auto kind = given.arrange(*snapshot, &SeenBy::camera, std::nullopt, progress);
                  given.for_each_chunk(progress, [&](std::size_t begin, std::size_t end) {
                      CrossingChunk& chunk = chunks[begin / ray_chunk_size];
                      chunk.counts.resize(end - begin);
                      snapshot->list_intersections(given.chunk(begin, end), chunk.crossings, chunk.counts,
                                                   kind == RayCaster::Rays::coherent);
                  });
              });
    return chunks;
}

/// Calls `visit(ray, its crossings)` for all rays, in the order of `given`.
template <typename Visit>
void for_each_ray(const GivenRays& given, const std::vector<CrossingChunk>& chunks, const Visit& visit)
{
    std::size_t i = 0;
    for (const CrossingChunk& chunk : chunks) {
        std::span<const Crossing> rest(chunk.crossings);
        for (const std::uint32_t count : chunk.counts) {
            visit(given.order(i++), rest.first(count));
            rest = rest.subspan(count);
        }
    }
}

py::object list_intersections(Scene& scene, const py::object& rays, const py::object& directions, double t_near,
                              double t_far)
{
    GivenRays given(rays, directions, t_near, t_far);
    const std::vector<CrossingChunk> chunks = crossings_of(scene, given);
    auto splits = new_array<std::int64_t>(Shape{static_cast<py::ssize_t>(given.count()) + 1});
    std::int64_t* const to_split = splits.mutable_data();
    to_split[0] = 0;
    for_each_ray(given, chunks, [&](std::size_t ray, std::span<const Crossing> crossings) {
        to_split[ray + 1] = static_cast<std::int64_t>(crossings.size());
    });
    std::partial_sum(to_split, to_split + given.count() + 1, to_split);

    const Shape all{static_cast<py::ssize_t>(to_split[given.count()])};
    auto ray_ids = new_array<std::int64_t>(all);
    auto t_hit = new_array<double>(all);
    auto geometry_ids = new_array<std::uint32_t>(all);
    auto primitive_ids = new_array<std::uint64_t>(all);
    auto uvs = new_array<float>(all, {2});
    auto positions = new_array<double>(all, {3}), normals = new_array<double>(all, {3});
    auto entering = new_array<bool>(all);
    for_each_ray(given, chunks, [&](std::size_t ray, std::span<const Crossing> crossings) {
        py::ssize_t at = to_split[ray];
        for (const Crossing& crossing : crossings) {
            const Hit& hit = crossing.hit;
            ray_ids.mutable_at(at) = static_cast<std::int64_t>(ray);
            t_hit.mutable_at(at) = hit.t;
            geometry_ids.mutable_at(at) = hit.geometry_id;
            primitive_ids.mutable_at(at) = hit.primitive_id;
            uvs.mutable_at(at, 0) = hit.uv.x;
            uvs.mutable_at(at, 1) = hit.uv.y;
            for (int axis = 0; axis < 3; ++axis) {
                positions.mutable_at(at, axis) = hit.position[axis];
                normals.mutable_at(at, axis) = hit.normal[axis];
            }
            entering.mutable_at(at++) = crossing.entering;
        }
    });
    py::dict result;
    result["ray_splits"] = splits;
    result["ray_ids"] = ray_ids;
    result["t_hit"] = t_hit;
    result["geometry_ids"] = geometry_ids;
    result["primitive_ids"] = primitive_ids;
    result["primitive_uvs"] = uvs;
    result["primitive_normals"] = normals;
    result["positions"] = positions;
    result["entering"] = entering;
    return as_result("Crossings", result);
}

py::array count_intersections(Scene& scene, const py::object& rays, const py::object& directions, double t_near,
                              double t_far, bool certify)
{
    GivenRays given(rays, directions, t_near, t_far);
    if (certify)
        return certified_codes(scene, given, &SeenBy::camera, [](const SceneCertifier& certifier, const Ray& ray) {
            return certifier.crosses_oddly(ray);
        });
    auto result = new_array<std::int32_t>(given.rows.leading_shape());
    std::int32_t* const counts = result.mutable_data();
    for_each_ray(given, crossings_of(scene, given), [&](std::size_t ray, std::span<const Crossing> crossings) {
        counts[ray] = static_cast<std::int32_t>(crossings.size());
    });
    return result;
}

} // namespace

void bind_crossings(py::module_& module)
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("list_intersections", &list_intersections, py::arg("rays"), py::arg("directions") = py::none(),
             py::kw_only(), py::arg("t_near") = 0.0, py::arg("t_far") = infinity, list_intersections_doc)
        .def("count_intersections", &count_intersections, py::arg("rays"), py::arg("directions") = py::none(),
             py::kw_only(), py::arg("t_near") = 0.0, py::arg("t_far") = infinity, py::arg("certify") = false,
             count_intersections_doc);
}

} // namespace isospline
