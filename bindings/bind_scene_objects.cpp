#include "arrays.h"
#include "bind.h"
#include "gil.h"
#include "handed.h"
#include "results.h"
#include "scene_objects.h"

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* add_doc = R"(Adds an object.

The same isosurface or mesh may be added many times. All instances share its acceleration structure; each adds less than
a kilobyte.

Parameters
----------
obj : Isosurface or Mesh
    Or a mesh of trimesh, PyVista, VTK or meshio.
transform : (4, 4) array_like, optional
    Maps the object's world space to the scene's: an affine map, as [row, column]; may rotate, scale and mirror.
visible : bool
    Whether `cast_rays`, `list_intersections`, `count_intersections` and pictures see it.
casts_shadow : bool
    Whether `test_occlusions` and shadow rays see it.

Returns
-------
int
    The object's geometry id; ids are never reused.

Raises
------
ValueError
    If the transform is not finite, not affine or singular.
TypeError
    For another type of object.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> triangle = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
>>> scene = isospline.Scene([triangle])
>>> lifted = np.eye(4)
>>> lifted[2, 3] = 5
>>> scene.add(triangle, lifted, casts_shadow=False)
1
>>> down = [(0.2, 0.2, 10, 0, 0, -1)]
>>> scene.cast_rays(down)["geometry_ids"], scene.test_occlusions(down, t_far=6)
(array([1], dtype=uint32), array([False]))
>>> scene.remove(1)
>>> scene.ids
[0]
)";

constexpr const char* remove_doc = R"(Removes an object; its geometry id is never reused.

Parameters
----------
geometry_id : int

Raises
------
ValueError
    For an id that is not in the scene.
)";

constexpr const char* set_transform_doc =
    R"(Moves an object. Only the scene's small tree over its objects is rebuilt.

Parameters
----------
geometry_id : int
transform : (4, 4) array_like or None
    As in `add`.

Raises
------
ValueError
    For an id that is not in the scene, and for a transform that is not finite, not affine or singular.
)";

constexpr const char* set_visibility_doc = R"(Shows or hides an object; None leaves a flag unchanged.

Parameters
----------
geometry_id : int
visible, casts_shadow : bool, optional
    As in `add`.

Raises
------
ValueError
    For an id that is not in the scene.
)";

constexpr const char* object_doc = R"(The object with a geometry id.

Parameters
----------
geometry_id : int

Returns
-------
Isosurface or Mesh
    The object that was added.

Raises
------
ValueError
    For an id that is not in the scene.
)";

/// A geometry id; an integer out of range becomes an id that no object has.
std::uint32_t as_geometry_id(const py::object& value)
{
    if (!PyIndex_Check(value.ptr()))
        throw_wrong_type("geometry_id", "an int", value);
    const auto integer = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
    if (!integer)
        throw py::error_already_set();
    int overflow = 0;
    const long long id = PyLong_AsLongLongAndOverflow(integer.ptr(), &overflow);
    if (overflow != 0 || id < 0 || id > static_cast<long long>(std::numeric_limits<std::uint32_t>::max()))
        throw_invalid("geometry_id", "the geometry id of an object in the scene", std::string(py::str(integer)));
    return static_cast<std::uint32_t>(id);
}

glm::dmat4 as_transform(const py::object& transform)
{
    return transform.is_none() ? glm::dmat4(1.0) : as_matrix4(transform, "transform");
}

/// The first addition of a surface may take long, because it looks at all of its cells.
template <typename Change>
auto without_gil(const Change& change)
{
    const GilReleased no_gil;
    return change();
}

void set_visibility(Scene& scene, const py::object& geometry_id, std::optional<bool> visible,
                    std::optional<bool> casts_shadow)
{
    const std::uint32_t id = as_geometry_id(geometry_id);
    SeenBy seen_by = scene.object(id).seen_by;
    seen_by.camera = visible.value_or(seen_by.camera);
    seen_by.shadow = casts_shadow.value_or(seen_by.shadow);
    without_gil([&] { scene.set_visibility(id, seen_by); });
}

py::object visibility_of(const SeenBy& seen_by)
{
    py::dict result;
    result["visible"] = seen_by.camera;
    result["casts_shadow"] = seen_by.shadow;
    return as_result("Visibility", result);
}

/// The Python object that was added if it still exists, otherwise a new one of the same object.
py::object python_object(const PlacedObject& placed)
{
    if (const auto* surface = std::get_if<std::shared_ptr<const Isosurface>>(&placed.object))
        return py::cast(std::const_pointer_cast<Isosurface>(*surface));
    return py::cast(std::const_pointer_cast<Mesh>(std::get<std::shared_ptr<const Mesh>>(placed.object)));
}

/// All objects at one moment: other threads may add and remove some.
py::list placed_objects(const Scene& scene)
{
    py::list objects;
    for (const auto& [id, placed] : scene.objects())
        objects.append(py::make_tuple(id, python_object(placed), placed.transform, visibility_of(placed.seen_by)));
    return objects;
}

} // namespace

std::uint32_t add_object(Scene& scene, const py::object& object, const py::object& transform, SeenBy seen_by)
{
    const glm::dmat4 placed = as_transform(transform);
    if (py::isinstance<Isosurface>(object)) {
        const auto surface = object.cast<std::shared_ptr<Isosurface>>();
        return without_gil([&] { return scene.add(surface, placed, seen_by); });
    }
    if (py::isinstance<Mesh>(object)) {
        const auto mesh = object.cast<std::shared_ptr<Mesh>>();
        return without_gil([&] { return scene.add(mesh, placed, seen_by); });
    }
    const py::object converted = handed("as_mesh")(object, "obj");
    return add_object(scene, converted, transform, seen_by);
}

void bind_scene_objects(py::module_& module)
{
    py::class_<Scene> scene(module.attr("Scene"));
    scene
        .def(
            "add",
            [](Scene& self, const py::object& object, const py::object& transform, bool visible, bool casts_shadow) {
                return add_object(self, object, transform, {visible, casts_shadow});
            },
            py::arg("obj"), py::arg("transform") = py::none(), py::kw_only(), py::arg("visible") = true,
            py::arg("casts_shadow") = true, add_doc)
        .def(
            "remove",
            [](Scene& self, const py::object& geometry_id) {
                const std::uint32_t id = as_geometry_id(geometry_id);
                without_gil([&] { self.remove(id); });
            },
            py::arg("geometry_id"), remove_doc)
        .def(
            "set_transform",
            [](Scene& self, const py::object& geometry_id, const py::object& transform) {
                const std::uint32_t id = as_geometry_id(geometry_id);
                const glm::dmat4 placed = as_transform(transform);
                without_gil([&] { self.set_transform(id, placed); });
            },
            py::arg("geometry_id"), py::arg("transform"), set_transform_doc)
        .def(
            "transform",
            [](const Scene& self, const py::object& geometry_id) {
                return self.object(as_geometry_id(geometry_id)).transform;
            },
            py::arg("geometry_id"), "(4, 4) float64 array: maps an object's world space to the scene's.")
        .def("set_visibility", &set_visibility, py::arg("geometry_id"), py::kw_only(), py::arg("visible") = py::none(),
             py::arg("casts_shadow") = py::none(), set_visibility_doc)
        .def(
            "visibility",
            [](const Scene& self, const py::object& geometry_id) {
                return visibility_of(self.object(as_geometry_id(geometry_id)).seen_by);
            },
            py::arg("geometry_id"), "Visibility: which rays see an object.")
        .def(
            "object",
            [](const Scene& self, const py::object& geometry_id) {
                return python_object(self.object(as_geometry_id(geometry_id)));
            },
            py::arg("geometry_id"), object_doc)
        .def("_placed_objects", &placed_objects)
        .def_property_readonly("ids", &Scene::ids, "List of int: the geometry ids of the objects, ascending.")
        .def("__len__", &Scene::count)
        .def("__iter__", [](const Scene& self) { return py::iter(py::cast(self.ids())); })
        .def("__contains__", [](const Scene& self, const py::object& geometry_id) {
            return py::cast(self.ids()).contains(geometry_id);
        });
}

} // namespace isospline
