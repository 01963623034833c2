#include "bind.h"

#include "arrays.h"
#include "hits.h"
#include "long_call.h"

#include "isospline/scene/mesh.h"
#include "isospline/scene/scene.h"
#include "isospline/util/parallel.h"

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* scene_doc = R"(Isosurfaces and triangle meshes that rays can be cast at, in Embree.

Ray queries have the names and the meaning of Open3D's RaycastingScene. A change of an object, such as another level of
an isosurface, takes effect at the next query.

Parameters
----------
objects : iterable of Isosurface and Mesh
    Added in this order, untransformed; geometry ids count up from 0.

Notes
-----
Any number of threads may query a scene at a time, as long as none changes it or one of its objects.

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
t_near, t_far : float
    Only crossings with t in [t_near, t_far] count, t being in units of the direction's length.
coherent : bool
    Trace rays that follow each other in SIMD packets: faster where they begin and run close together, as the primary
    rays of a picture do. The hits are the same, bit for bit.

Returns
-------
dict
    ``t_hit``: (...) float64, inf where the ray misses.
    ``geometry_ids``: (...) uint32, the object's; `INVALID_ID` where the ray misses.
    ``primitive_ids``: (...) uint32, row of `Isosurface.shell.cells` or face of the mesh; `INVALID_ID` where the ray
    misses.
    ``primitive_normals``: (..., 3) float64, unit and outward, in world space: along the exact gradient of an
    isosurface, away from its `inside`; zero where the ray misses.

Raises
------
ValueError
    Where `rays` has another shape, an origin or direction is not finite, a direction is zero, or the limits are NaN.
TypeError
    Where `rays` does not hold real numbers.
)";

constexpr const char* test_occlusions_doc = R"(Whether each ray crosses anything; stops at the first crossing found.

Parameters
----------
rays : (..., 6) array_like, float32 or float64
    As for `cast_rays`.
t_near, t_far : float
    Only crossings with t in [t_near, t_far] count.

Returns
-------
(...) bool array
)";

std::uint32_t add_object(Scene& scene, const py::object& object, const py::object& transform)
{
    const glm::dmat4 placed = transform.is_none() ? glm::dmat4(1.0) : as_matrix4(transform, "transform");
    if (py::isinstance<Isosurface>(object))
        return scene.add(object.cast<std::shared_ptr<Isosurface>>(), placed);
    if (py::isinstance<Mesh>(object))
        return scene.add(object.cast<std::shared_ptr<Mesh>>(), placed);
    throw_type_error("obj", "an Isosurface or a Mesh", type_name(object));
}

std::unique_ptr<Scene> make_scene(const py::iterable& objects)
{
    auto scene = std::make_unique<Scene>();
    for (const auto& object : objects)
        add_object(*scene, py::reinterpret_borrow<py::object>(object), py::none());
    return scene;
}

py::dict cast_rays(Scene& scene, const py::object& rays, double t_near, double t_far, bool coherent)
{
    const RowArray rows(rays, "rays", 6);
    check_limits(t_near, t_far);
    HitArrays arrays(rows.leading_shape());
    const RayOrder order(rows.leading_shape(), coherent);
    long_call(py::none(), [&](const Progress& progress) {
        scene.commit(progress);
        for_each_chunk(rows, order, t_near, t_far, progress, [&](std::span<const Ray> chunk, std::size_t first) {
            std::vector<Hit> hits(chunk.size());
            scene.cast_rays(chunk, hits, coherent);
            arrays.set(hits, order, first);
        });
    });
    return arrays.to_dict();
}

py::array_t<bool> test_occlusions(Scene& scene, const py::object& rays, double t_near, double t_far)
{
    const RowArray rows(rays, "rays", 6);
    check_limits(t_near, t_far);
    py::array_t<bool> result(rows.leading_shape());
    bool* const flags = result.mutable_data();
    const RayOrder order(rows.leading_shape(), false);
    long_call(py::none(), [&](const Progress& progress) {
        scene.commit(progress);
        for_each_chunk(rows, order, t_near, t_far, progress, [&](std::span<const Ray> chunk, std::size_t first) {
            std::vector<std::uint8_t> occluded(chunk.size());
            scene.test_occlusions(chunk, occluded);
            for (std::size_t i = 0; i < chunk.size(); ++i)
                flags[first + i] = occluded[i] != 0;
        });
    });
    return result;
}

void commit(Scene& scene)
{
    long_call(py::none(), [&](const Progress& progress) { scene.commit(progress); });
}

} // namespace

void bind_scene(py::module_& module)
{
    module.attr("INVALID_ID") = invalid_id;

    py::class_<Scene>(module, "Scene", scene_doc)
        .def(py::init(&make_scene), py::arg("objects") = py::tuple())
        .def("add", &add_object, py::arg("obj"), py::arg("transform") = py::none(),
             R"(Adds an object.

Parameters
----------
obj : Isosurface or Mesh
transform : (4, 4) array_like, optional
    The object's world space to the scene's: an affine map, as [row, column]; may rotate, scale and mirror.

Returns
-------
int
    The object's geometry id.

Raises
------
ValueError
    Where the transform is not finite, not affine or singular.
)")
        .def("cast_rays", &cast_rays, py::arg("rays"), py::kw_only(), py::arg("t_near") = 0.0,
             py::arg("t_far") = std::numeric_limits<double>::infinity(), py::arg("coherent") = false, cast_rays_doc)
        .def("test_occlusions", &test_occlusions, py::arg("rays"), py::kw_only(), py::arg("t_near") = 0.0,
             py::arg("t_far") = std::numeric_limits<double>::infinity(), test_occlusions_doc)
        .def_property_readonly(
            "bounds",
            [](Scene& scene) {
                commit(scene);
                return to_array(scene.bounds());
            },
            "(2, 3) float64 array, world units: lower and upper corner of the box of all meshes and all cells of "
            "shells; inf, -inf "
            "where there are none.")
        .def_property_readonly(
            "memory",
            [](Scene& scene) {
                commit(scene);
                return scene.memory();
            },
            "Bytes that Embree holds for the acceleration structures.")
        .def("__len__", &Scene::count)
        .def("__repr__", [](const Scene& scene) { return "Scene(" + std::to_string(scene.count()) + " objects)"; });

    module.def("set_thread_count", &set_thread_count, py::arg("count"),
               "Limits the threads of all long operations from now on; 0 stands for all that the machine has.");
    module.def("thread_count", &thread_count, "Threads that a long operation may use.");
}

} // namespace isospline
