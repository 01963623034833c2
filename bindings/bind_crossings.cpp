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
#include <numeric>
#include <span>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

/// All crossings of the rays of one chunk.
struct CrossingChunk {
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts;
};

/// The chunks of all rays, in the order of `given`.
std::vector<CrossingChunk> crossings_of(Scene& scene, GivenRays& given, const py::object& progress)
{
    std::vector<CrossingChunk> chunks((given.count() + ray_chunk_size - 1) / ray_chunk_size);
    long_call("to list the crossings of " + std::to_string(given.count()) + " rays", progress,
              [&](const Progress& report) {
                  const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
                  const auto kind = given.arrange(*snapshot, &SeenBy::camera, std::nullopt, part_of(report, 0.05, 0.1));
                  given.for_each_chunk(part_of(report, 0.1, 1.0), [&](std::size_t begin, std::size_t end) {
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
                              double t_far, const py::object& progress)
{
    GivenRays given(rays, directions, t_near, t_far);
    const std::vector<CrossingChunk> chunks = crossings_of(scene, given, progress);
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
                              double t_far, bool certify, const py::object& progress)
{
    GivenRays given(rays, directions, t_near, t_far);
    if (certify)
        return certified_codes(
            scene, given, &SeenBy::camera, progress,
            [](const SceneCertifier& certifier, const Ray& ray) { return certifier.crosses_oddly(ray); });
    auto result = new_array<std::int32_t>(given.rows.leading_shape());
    std::int32_t* const counts = result.mutable_data();
    for_each_ray(given, crossings_of(scene, given, progress),
                 [&](std::size_t ray, std::span<const Crossing> crossings) {
                     counts[ray] = static_cast<std::int32_t>(crossings.size());
                 });
    return result;
}

} // namespace

void bind_crossings(py::module_& module)
{
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene"))
        .def("list_intersections", &list_intersections)
        .def("count_intersections", &count_intersections);
}

} // namespace isospline
