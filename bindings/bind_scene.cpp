#include "bind.h"

#include "arrays.h"
#include "certificates.h"
#include "handed.h"
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

constexpr const char* scene_doc = R"(Isosurfaces and triangle meshes in Embree, for ray queries and pictures.

Ray queries have the same names and meaning as in Open3D's RaycastingScene. A change of an object, such as a new level
of an isosurface, takes effect at the next query.

Parameters
----------
objects : Isosurface, Mesh, or iterable of them
    Also meshes of other libraries, and pairs (object, (4, 4) transform). Added in this order; geometry ids count up
    from 0 and are never reused.
*more
    Further objects: ``Scene(bone, skin)`` is ``Scene([bone, skin])``.
build_quality : {"medium", "low", "high"}
    Quality of Embree's acceleration structures. "low" takes half the memory and builds a little faster, but rays take
    up to a fifth longer (measured on CT volumes). "high" splits long triangles; it has no effect on isosurfaces.

Notes
-----
Any number of threads may query a scene while others change it and set the levels of its isosurfaces. A query sees the
scene as it is when the query begins. Changes and queries do not wait for each other. After a change, the first query
builds the changed objects, and other queries of this scene wait for them.

Each isosurface and mesh is built once, however often it is added; moving, hiding and removing builds nothing.

An isosurface has two indexes, with the same hits. The draft is ready some milliseconds after a change of the level.
The settled one takes longer to build, and rays are faster: see `settle`.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
>>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
>>> scene = isospline.Scene([isospline.Isosurface(volume, 5.0, inside="below")])
>>> hits = scene.cast_rays([(-20, 0, 0, 1, 0, 0)])
>>> bool(abs(hits["t_hit"][0] - 15.0) < 0.01)
True
>>> np.round(hits["primitive_normals"][0]) + 0.0
array([-1.,  0.,  0.])
)";

constexpr const char* cast_rays_doc = R"(First crossing of each ray with the scene.

Parameters
----------
rays : (..., 6) array_like, float32 or float64
    Origin and direction, ox oy oz dx dy dz, in world units. Directions need not have length one.
    Tensors of other libraries are taken as they are; a warning tells if one requires a gradient, which is lost.
directions : (..., 3) array_like, optional
    Directions of the rays, if `rays` has their origins alone, of shape (..., 3).
t_near, t_far : float
    Only crossings with t in [t_near, t_far] count. t is in units of the direction's length.
coherent : bool, optional
    Whether consecutive rays are close together, as the primary rays of a picture. Coherent rays are traced in SIMD
    packets, others one by one. By default, this is found out from the rays themselves; if they are far from each
    other, they are traced in another order. The hits are the same, bit for bit. Rays at volumes of stores are
    sorted unless they are coherent, so that most chunks are read once.
certify : bool
    Adds what is proven of each ray's first crossing with the model of the stored float32 coefficients, by arithmetic
    that is rounded outwards and independent of the other outputs. The scene's visible objects must be isosurfaces
    without clip, mask and largest=, and none may be closed. `certificate` gives the proof itself, of one ray.
outputs : sequence of str
    Names of the arrays to return. Only these are computed: ``outputs=("t_hit",)`` is the fastest.
dtype : dtype, optional
    Type of arrays of real numbers, float64 or float32; by default that of the rays. Hits are computed in float64 and
    then rounded.
out : dict of arrays, optional
    Arrays to write the outputs to, such as the result of an earlier call: C-contiguous, of the right shape and type.
    Missing ones are created.

Returns
-------
Hits
    A mapping whose items are also attributes: ``hits.t_hit`` is ``hits["t_hit"]``. By default it has these items:

    ``t_hit``: (...) dtype; inf if the ray misses.
    ``geometry_ids``: (...) uint32, of the object; `INVALID_ID` if the ray misses.
    ``primitive_ids``: (...) uint64; `INVALID_PRIMITIVE_ID` if the ray misses. For a mesh, the face. For an isosurface,
    the place of the cell in the volume, which is the same for every level: see `Volume.cell_at`. Caps have ids from
    ``volume.cell_count`` on, in the order of the half-spaces of `clip`.
    ``primitive_normals``: (..., 3) dtype, unit and outward, in world space. For an isosurface, along the exact gradient
    and away from its `inside`; for a cap, that of its plane; zero if the ray misses.

    Others, if `outputs` names them:

    ``positions``: (..., 3) dtype, in world space; NaN if the ray misses.
    ``primitive_uvs``: (..., 2) float32, weights of a triangle's second and third corner; 0 for isosurfaces.
    ``gradient_magnitudes``: (...) dtype, of an isosurface's model, also on caps, in values per world unit; 0 for
    meshes.

    Derivatives of hits, if `outputs` names them. All are zero for rays that miss, and for rays that graze, which
    ``grazing`` tells: (...) bool, the sine of the angle between ray and surface is below 2^-20, and derivatives have no
    bound. The derivatives of normals, and those by the level and by coefficients, are zero on caps and meshes.

    ``dt_dlevel``: (...) dtype, 1 / <gradient of f, direction>.
    ``dt_dorigin``, ``dt_ddirection``: (..., 3) dtype, -n / <n, direction> with the normal n, and t times that.
    ``dnormal_dlevel``: (..., 3) dtype, ``dnormal_dorigin``, ``dnormal_ddirection``: (..., 3, 3) dtype, of the unit
    normal along the surface; the last axis is that of the origin's or direction's coordinates.
    ``coefficient_indices``: (..., (n+1)^3) int64, ``coefficient_weights``: (..., (n+1)^3) dtype, of the coefficients in
    f at the hit. The derivative of t by a coefficient is -weight ``dt_dlevel``. Indices are places in
    ``volume.coefficients.ravel("K")``; `Volume.adjoint` takes gradients by coefficients to those by samples. In a scene
    of several degrees there are as many as for the highest one; weights of the others are zero.
    ``coefficient_gradients``: (..., (n+1)^3, 3) dtype, the gradients of these weights by the position in the world.

    With `certify`:

    ``statuses``: (...) uint8, what is proven of the ray: 0 for a miss, 1 for a hit, 2 if it is undecided, because the
    ray begins, ends or touches the surface closer to it than the bound of all rounding.
    ``t_bounds``: (..., 2) float64, a lower and an upper bound of the first crossing's t. There is no point of the
    surface between t_near and the lower bound. The ray of a hit crosses the surface at or before the upper bound. For a
    miss, both are inf; for an undecided ray, the upper bound is inf.
    ``level_bounds``: (...) float64. An undecided ray is at most this far from the level, in values, at its lower bound
    of t; 0 for other rays.
    ``normal_axes``: (..., 3) float64, unit vectors, and ``normal_angles``: (...) float64, in radians. The outward
    normal at the first crossing is within the angle of the axis. The axis is zero and the angle NaN if the ray does
    not hit; they are zero and pi if nothing is proven of the normal.
    ``model_distances``: (...) float64, in world units. The surface of the coefficients in exact arithmetic, before they
    were rounded to float32, comes this near to the first crossing; inf if that is not proven within a voxel, NaN if
    the ray does not hit.

Raises
------
ValueError
    If `rays` has another shape, an origin or direction is not finite, a direction is zero, the limits are NaN, an
    output name is unknown, `dtype` is another type, or an array of `out` has another shape, cannot be written to, or is
    not among `outputs`. With `certify`, if the scene has a visible object for which nothing can be proven.
TypeError
    If `rays` does not hold real numbers, or an array of `out` has another type.
)";

constexpr const char* test_occlusions_doc = R"(Whether each ray crosses anything; stops at the first crossing found.

It sees the objects that cast shadows; the other queries see those that are visible, see `set_visibility`.

Parameters
----------
rays : (..., 6) array_like, float32 or float64
    As in `cast_rays`.
directions : (..., 3) array_like, optional
    As in `cast_rays`.
t_near, t_far : float
    Only crossings with t in [t_near, t_far] count.
coherent : bool, optional
    As in `cast_rays`. Rays from neighbouring points to one light are coherent. The result is the same.
certify : bool
    Returns instead what is proven. The conditions of `cast_rays` hold for the objects that cast shadows.

Returns
-------
(...) bool array, or uint8 array
    True if the ray crosses something. With `certify`, 1 for a ray that is proven to cross a surface, 0 for one that is
    proven to cross none, and 2 for one that is undecided.

Raises
------
ValueError, TypeError
    As in `cast_rays`.
)";

const EnumWords<BuildQuality> quality_words{
    {"low", BuildQuality::low}, {"medium", BuildQuality::medium}, {"high", BuildQuality::high}};

std::unique_ptr<Scene> make_scene(const py::object& objects, const py::args& more, const std::string& build_quality)
{
    auto scene = std::make_unique<Scene>(BuildOptions{as_enum(quality_words, build_quality, "build_quality")});
    const auto as_placed_objects = handed("as_placed_objects");
    const py::list placed = as_placed_objects(objects, *more);
    for (const auto& each : placed) {
        const auto pair = each.cast<py::tuple>();
        add_object(*scene, pair[0], pair[1], {});
    }
    return scene;
}

template <RayCaster::Contact contact>
py::object cast_rays(Scene& scene, const py::object& rays, const py::object& directions, double t_near, double t_far,
                     std::optional<bool> coherent, bool certify, const py::object& outputs, const py::object& dtype,
                     const py::object& out)
{
    GivenRays given(rays, directions, t_near, t_far);
    HitArrays arrays(given.rows, outputs, dtype, out);
    std::optional<CertificateArrays> certificates;
    if (certify)
        certificates.emplace(given.rows.leading_shape());
    const auto parts = arrays.outputs.only_t_and_ids() ? RayCaster::Parts::t_and_ids : RayCaster::Parts::all;
    long_call("to cast " + std::to_string(given.count()) + " rays", py::none(), [&](const Progress& progress) {
        const auto snapshot = scene.snapshot(progress);
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
        const auto kind = given.arrange(*snapshot, &SeenBy::camera, coherent, progress);
        given.for_each_chunk(progress, [&](std::size_t begin, std::size_t end) {
            RayCaster caster(*snapshot, kind, parts, contact);
            std::array<Hit, RayPacket::capacity> hits;
            HitArrays::LastObject last;
            std::array<double, ray_chunk_size> t_hits;
            std::array<std::uint32_t, ray_chunk_size> geometry_ids;
            if (certify) { // lanes beyond the last ray are read, too
                t_hits.fill(0.0);
                geometry_ids.fill(invalid_id);
            }
            given.for_each_packet(
                begin, end, caster.width(), [&](const RayPacket& packet, std::size_t first, const auto& places) {
                    const LaneMask hit_lanes = caster.cast(packet, first, hits);
                    arrays.set(places, static_cast<std::size_t>(packet.count), hit_lanes, hits);
                    if (arrays.outputs.derivatives())
                        arrays.set_derivatives(
                            places, static_cast<std::size_t>(packet.count), hit_lanes, hits,
                            [&](std::size_t lane) {
                                const auto& along = packet.direction;
                                return glm::dvec3(along[0][lane], along[1][lane], along[2][lane]);
                            },
                            [&](std::uint32_t id) -> const SnapshotObject& { return snapshot->object(id); }, last);
                    for (std::size_t i = 0; certify && i < static_cast<std::size_t>(packet.count); ++i) {
                        const bool is_hit = (hit_lanes >> i & 1u) != 0;
                        t_hits[first - begin + i] = is_hit ? hits[i].t : std::numeric_limits<double>::infinity();
                        geometry_ids[first - begin + i] = hits[i].geometry_id;
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
                                                py::none(), py::none());
}

py::array test_occlusions(Scene& scene, const py::object& rays, const py::object& directions, double t_near,
                          double t_far, std::optional<bool> coherent, bool certify)
{
    GivenRays given(rays, directions, t_near, t_far);
    if (certify)
        return certified_codes(scene, given, &SeenBy::shadow, [](const SceneCertifier& certifier, const Ray& ray) {
            return certifier.is_crossed(ray);
        });
    py::array_t<bool> result(given.rows.leading_shape());
    bool* const flags = result.mutable_data();
    long_call("to test " + std::to_string(given.count()) + " rays", py::none(), [&](const Progress& progress) {
        const auto snapshot = scene.snapshot(progress);
        const auto kind = given.arrange(*snapshot, &SeenBy::shadow, coherent, progress);
        given.for_each_chunk(progress, [&](std::size_t begin, std::size_t end) {
            RayCaster caster(*snapshot, kind);
            given.for_each_packet(begin, end, caster.width(),
                                  [&](const RayPacket& packet, std::size_t first, const auto& places) {
                                      const LaneMask occluded = caster.test_occlusions(packet, first);
                                      for (std::size_t i = 0; i < static_cast<std::size_t>(packet.count); ++i)
                                          flags[places[i]] = (occluded >> i & 1u) != 0;
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

    py::class_<Scene, std::shared_ptr<Scene>>(module, "Scene", scene_doc)
        .def(py::init(&make_scene), py::arg("objects") = py::tuple(), py::arg("build_quality") = "medium")
        .def("cast_rays", &cast_rays<RayCaster::Contact::crossing>, py::arg("rays"), py::arg("directions") = py::none(),
             py::kw_only(), py::arg("t_near") = 0.0, py::arg("t_far") = std::numeric_limits<double>::infinity(),
             py::arg("coherent") = py::none(), py::arg("certify") = false, py::arg("outputs") = default_hit_outputs(),
             py::arg("dtype") = py::none(), py::arg("out") = py::none(), cast_rays_doc)
        .def("_cast_touching_rays", &cast_touching_rays, py::arg("rays"))
        .def("test_occlusions", &test_occlusions, py::arg("rays"), py::arg("directions") = py::none(), py::kw_only(),
             py::arg("t_near") = 0.0, py::arg("t_far") = std::numeric_limits<double>::infinity(),
             py::arg("coherent") = py::none(), py::arg("certify") = false, test_occlusions_doc)
        .def_property_readonly(
            "bounds", &bounds_of,
            "(2, 3) float64 array, world units: lower and upper corner of the box of all meshes, cells of shells "
            "and caps, visible or not; inf, -inf if there are none.")
        .def_property_readonly(
            "memory", [](Scene& scene) { return snapshot_of(scene)->memory(); },
            "Bytes of Embree's acceleration structures and of the cells that are kept with them. Objects that were "
            "added several times count once.")
        .def_property_readonly(
            "build_count", [](Scene& scene) { return snapshot_of(scene)->build_count(); },
            "Number of acceleration structures of isosurfaces and meshes that have been built so far. Each new "
            "object and each new level adds one; other changes and settled indexes add none.")
        .def_property_readonly(
            "build_quality", [](const Scene& scene) { return to_word(quality_words, scene.build_options().quality); },
            "How Embree's acceleration structures are built: \"low\", \"medium\" or \"high\".")
        .def("__repr__", [](const Scene& scene) { return "Scene(" + std::to_string(scene.count()) + " objects)"; });

    module.def("set_thread_count", &set_thread_count, py::arg("count"),
               "Limits the number of threads of all long operations from now on. The default is 0: one thread for each "
               "processor that this process may use. A negative number raises a ValueError.");
    module.def("thread_count", &thread_count, "Number of threads that a long operation may use.");
}

} // namespace isospline
