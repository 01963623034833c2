#include "arrays.h"
#include "bind.h"
#include "gil.h"
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
    const auto mesh = object.cast<std::shared_ptr<Mesh>>();
    return without_gil([&] { return scene.add(mesh, placed, seen_by); });
}

void bind_scene_objects(py::module_& module)
{
    py::class_<Scene> scene(module.attr("Scene"));
    scene
        .def("add",
             [](Scene& self, const py::object& object, const py::object& transform, bool visible, bool casts_shadow) {
                 return add_object(self, object, transform, {visible, casts_shadow});
             })
        .def("remove",
             [](Scene& self, const py::object& geometry_id) {
                 const std::uint32_t id = as_geometry_id(geometry_id);
                 without_gil([&] { self.remove(id); });
             })
        .def("set_transform",
             [](Scene& self, const py::object& geometry_id, const py::object& transform) {
                 const std::uint32_t id = as_geometry_id(geometry_id);
                 const glm::dmat4 placed = as_transform(transform);
                 without_gil([&] { self.set_transform(id, placed); });
             })
        .def("transform",
             [](const Scene& self, const py::object& geometry_id) {
                 return self.object(as_geometry_id(geometry_id)).transform;
             })
        .def("set_visibility", &set_visibility)
        .def("visibility",
             [](const Scene& self, const py::object& geometry_id) {
                 return visibility_of(self.object(as_geometry_id(geometry_id)).seen_by);
             })
        .def("object",
             [](const Scene& self, const py::object& geometry_id) {
                 return python_object(self.object(as_geometry_id(geometry_id)));
             })
        .def("_placed_objects", &placed_objects)
        .def_property_readonly("ids", &Scene::ids)
        .def("__len__", &Scene::count)
        .def("__iter__", [](const Scene& self) { return py::iter(py::cast(self.ids())); })
        .def("__contains__", [](const Scene& self, const py::object& geometry_id) {
            return py::cast(self.ids()).contains(geometry_id);
        });
}

} // namespace isospline
