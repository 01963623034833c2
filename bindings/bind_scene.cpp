#include "bind.h"

#include "arrays.h"
#include "certificates.h"
#include "hits.h"
#include "long_call.h"
#include "rays.h"
#include "results.h"
#include "scene_objects.h"

#include "isospline/scene/mesh.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene.h"
#include "isospline/scene/scene_certifier.h"
#include "isospline/util/parallel.h"

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

const EnumWords<BuildQuality> quality_words{
    {"low", BuildQuality::low}, {"medium", BuildQuality::medium}, {"high", BuildQuality::high}};

/// From pairs of an object and its transform or None.
std::unique_ptr<Scene> make_scene(const py::list& placed, const std::string& build_quality)
{
    auto scene = std::make_unique<Scene>(BuildOptions{as_enum(quality_words, build_quality, "build_quality")});
    for (const auto& each : placed) {
        const auto pair = each.cast<py::tuple>();
        add_object(*scene, pair[0], pair[1], {});
    }
    return scene;
}

template <RayCaster::Contact contact>
py::object cast_rays(Scene& scene, const py::object& rays, const py::object& directions, double t_near, double t_far,
                     std::optional<bool> coherent, bool certify, const py::object& outputs, const py::object& dtype,
                     const py::object& out, const py::object& progress)
{
    GivenRays given(rays, directions, t_near, t_far);
    HitArrays arrays(given.rows, outputs, dtype, out);
    std::optional<CertificateArrays> certificates;
    if (certify)
        certificates.emplace(given.rows.leading_shape());
    const auto parts = arrays.outputs.only_t_and_ids() ? RayCaster::Parts::t_and_ids : RayCaster::Parts::all;
    long_call("to cast " + std::to_string(given.count()) + " rays", progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
        std::optional<SceneCertifier> certifier;
        if (certify)
            certifier.emplace(*snapshot, &SeenBy::camera);
        if (arrays.outputs.of_coefficients()) {
            std::size_t coefficients = 0;
            for (const std::uint32_t id : snapshot->ids())
                coefficients = std::max(coefficients, coefficient_count(snapshot->object(id)));
            const py::gil_scoped_acquire locked;
            arrays.make_coefficients(coefficients);
        }
        const auto kind = given.arrange(*snapshot, &SeenBy::camera, coherent, part_of(report, 0.05, 0.1));
        given.for_each_chunk(part_of(report, 0.1, 1.0), [&](std::size_t begin, std::size_t end) {
            RayCaster caster(*snapshot, kind, parts, contact);
            const auto width = static_cast<std::size_t>(caster.width());
            std::vector<Hit> hits(caster.batch_size() * width);
            std::array<LaneMask, RayCaster::largest_batch> hit_lanes;
            HitArrays::LastObject last;
            std::array<double, ray_chunk_size> t_hits;
            std::array<std::uint32_t, ray_chunk_size> geometry_ids;
            if (certify) { // lanes beyond the last ray are read, too
                t_hits.fill(0.0);
                geometry_ids.fill(invalid_id);
            }
            const auto keep = [&](const RayPacket& packet, std::size_t first, const auto& places, LaneMask of_packet,
                                  std::span<const Hit> packet_hits) {
                const auto count = static_cast<std::size_t>(packet.count);
                arrays.set(places, count, of_packet, packet_hits);
                if (arrays.outputs.derivatives())
                    arrays.set_derivatives(
                        places, count, of_packet, packet_hits,
                        [&](std::size_t lane) {
                            const auto& along = packet.direction;
                            return glm::dvec3(along[0][lane], along[1][lane], along[2][lane]);
                        },
                        [&](std::uint32_t id) -> const SnapshotObject& { return snapshot->object(id); }, last);
                for (std::size_t i = 0; certify && i < count; ++i) {
                    const bool is_hit = (of_packet >> i & 1u) != 0;
                    t_hits[first - begin + i] = is_hit ? packet_hits[i].t : std::numeric_limits<double>::infinity();
                    geometry_ids[first - begin + i] = packet_hits[i].geometry_id;
                }
            };
            given.for_each_batch(begin, end, caster.width(), caster.batch_size(),
                                 [&](std::span<const RayPacket> packets, std::size_t first, const auto& places) {
                                     caster.cast(packets, first, hits, hit_lanes);
                                     for (std::size_t i = 0; i < packets.size(); ++i) {
                                         keep(packets[i], first, places[i], hit_lanes[i],
                                              std::span(hits).subspan(i * width, width));
                                         first += static_cast<std::size_t>(packets[i].count);
                                     }
                                 });
            if (!certify)
                return;
            // After all rays of the chunk were cast, so that the code of one of both stays in the cache.
            std::array<RayCertificate, packet_capacity> proven;
            const auto of_packet = [&](const auto& numbers, std::size_t first) {
                return std::span(numbers).subspan(first - begin).template first<packet_capacity>();
            };
            given.for_each_packet(
                begin, end, packet_capacity, [&](const RayPacket& packet, std::size_t first, const auto& places) {
                    certifier->certify(packet, of_packet(t_hits, first), of_packet(geometry_ids, first), proven);
                    for (std::size_t i = 0; i < static_cast<std::size_t>(packet.count); ++i)
                        certificates->set(places[i], proven[i]);
                });
        });
    });
    return as_result("Hits", certify ? certificates->added_to(arrays.to_dict()) : arrays.to_dict());
}

/// For RayMeshIntersector: first contacts of rays, with triangles that they touch as well.
py::object cast_touching_rays(Scene& scene, const py::object& rays)
{
    return cast_rays<RayCaster::Contact::touch>(scene, rays, py::none(), 0.0, std::numeric_limits<double>::infinity(),
                                                false, false, py::make_tuple("t_hit", "geometry_ids", "primitive_ids"),
                                                py::none(), py::none(), py::none());
}

py::array test_occlusions(Scene& scene, const py::object& rays, const py::object& directions, double t_near,
                          double t_far, std::optional<bool> coherent, bool certify, const py::object& progress)
{
    GivenRays given(rays, directions, t_near, t_far);
    if (certify)
        return certified_codes(
            scene, given, &SeenBy::shadow, progress,
            [](const SceneCertifier& certifier, const Ray& ray) { return certifier.is_crossed(ray); });
    py::array_t<bool> result(given.rows.leading_shape());
    bool* const flags = result.mutable_data();
    long_call("to test " + std::to_string(given.count()) + " rays", progress, [&](const Progress& report) {
        const auto snapshot = scene.snapshot(part_of(report, 0.0, 0.05));
        const auto kind = given.arrange(*snapshot, &SeenBy::shadow, coherent, part_of(report, 0.05, 0.1));
        given.for_each_chunk(part_of(report, 0.1, 1.0), [&](std::size_t begin, std::size_t end) {
            RayCaster caster(*snapshot, kind);
            std::array<LaneMask, RayCaster::largest_batch> occluded;
            given.for_each_batch(begin, end, caster.width(), caster.batch_size(),
                                 [&](std::span<const RayPacket> packets, std::size_t first, const auto& places) {
                                     caster.test_occlusions(packets, first, occluded);
                                     for (std::size_t i = 0; i < packets.size(); ++i)
                                         for (std::size_t lane = 0; lane < static_cast<std::size_t>(packets[i].count);
                                              ++lane)
                                             flags[places[i][lane]] = (occluded[i] >> lane & 1u) != 0;
                                 });
        });
    });
    return result;
}

/// A snapshot of the scene.
std::shared_ptr<const SceneSnapshot> snapshot_of(Scene& scene)
{
    std::shared_ptr<const SceneSnapshot> snapshot;
    long_call("to build a scene", py::none(), [&](const Progress& progress) { snapshot = scene.snapshot(progress); });
    return snapshot;
}

py::array_t<double> bounds_of(Scene& scene)
{
    const auto snapshot = snapshot_of(scene);
    Box bounds;
    long_call("to find the bounds of a scene", py::none(), [&](const Progress&) { bounds = snapshot->bounds(); });
    return to_array(bounds);
}

} // namespace

void bind_scene(py::module_& module)
{
    module.attr("INVALID_ID") = invalid_id;
    module.attr("INVALID_PRIMITIVE_ID") = invalid_primitive_id;

    py::class_<Scene, std::shared_ptr<Scene>>(module, "Scene")
        .def(py::init(&make_scene))
        .def("cast_rays", &cast_rays<RayCaster::Contact::crossing>)
        .def("_cast_touching_rays", &cast_touching_rays, py::arg("rays"))
        .def("test_occlusions", &test_occlusions)
        .def_property_readonly("bounds", &bounds_of)
        .def_property_readonly("memory", [](Scene& scene) { return snapshot_of(scene)->memory(); })
        .def_property_readonly("build_count", [](Scene& scene) { return snapshot_of(scene)->build_count(); })
        .def_property_readonly("build_quality",
                               [](const Scene& scene) { return to_word(quality_words, scene.build_options().quality); })
        .def("__repr__", [](const Scene& scene) { return "Scene(" + std::to_string(scene.count()) + " objects)"; });

    module.def("set_thread_count", &set_thread_count);
    module.def("thread_count", &thread_count);
}

} // namespace isospline
