#include "arrays.h"
#include "bind.h"

#include "isospline/render/camera.h"
#include "isospline/render/projection.h"
#include "isospline/util/check.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <array>
#include <sstream>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

const EnumWords<FieldOfViewAxis> axis_words{{"vertical", FieldOfViewAxis::vertical},
                                            {"horizontal", FieldOfViewAxis::horizontal},
                                            {"diagonal", FieldOfViewAxis::diagonal}};

/// The camera itself, once it is known to make an image.
template <typename GivenCamera>
GivenCamera checked(const GivenCamera& camera)
{
    Projection(camera, glm::ivec2(1));
    return camera;
}

py::array_t<double> rays_of(const Camera& camera, std::array<int, 2> size)
{
    const Projection projection(camera, {size[0], size[1]});
    auto rays = new_array<double>({size[1], size[0]}, {6});
    auto values = rays.mutable_unchecked<3>();
    const py::gil_scoped_release no_gil;
    for (int y = 0; y < size[1]; ++y) {
        for (int x = 0; x < size[0]; ++x) {
            const Ray ray = projection.ray({x + 0.5, y + 0.5});
            for (int axis = 0; axis < 3; ++axis) {
                values(y, x, axis) = ray.origin[axis];
                values(y, x, axis + 3) = ray.direction[axis];
            }
        }
    }
    return rays;
}

template <typename GivenCamera>
py::class_<GivenCamera> bind_camera_class(py::module_& module, const char* name, const char* documentation)
{
    return py::class_<GivenCamera>(module, name, documentation)
        .def(
            "rays", [](const GivenCamera& camera, std::array<int, 2> size) { return rays_of(camera, size); },
            py::arg("size"), R"(The rays through the centres of all pixels.

Parameters
----------
size : (int, int)
    Width and height of the image in pixels.

Returns
-------
(height, width, 6) float64 array
    Origins and directions, world units, of the pixels from the top left one. A perspective camera's directions
    are as long as a step of one along the viewing direction takes, so that t is the depth; those of a projection
    plane end on the plane; those of an orthographic camera are of unit length.
)")
        .def_property_readonly(
            "world_to_camera",
            [](const GivenCamera& camera) { return to_array(Projection(camera, glm::ivec2(1)).world_to_camera()); },
            R"((4, 4) float64 array: maps column vectors of world space to camera space.

Camera space is that of OpenEXR and RenderMan: x to the right, y up, z forward from the eye; it is left-handed.)")
        .def(
            "world_to_ndc",
            [](const GivenCamera& camera, std::array<int, 2> size) {
                return to_array(Projection(camera, {size[0], size[1]}).world_to_ndc());
            },
            py::arg("size"), R"(Maps column vectors of world space to the image; divide by the fourth part.

(0, 0) is the top left corner of the image and (1, 1) the bottom right one, as in OpenEXR and RenderMan.

Parameters
----------
size : (int, int)
    Width and height of the image in pixels.

Returns
-------
(4, 4) float64 array
)");
}

void bind_perspective(py::module_& module)
{
    bind_camera_class<PerspectiveCamera>(module, "PerspectiveCamera", R"(A pinhole at an eye that looks at a target.

Parameters
----------
eye, target : (3,) float
    Points, world units.
up : (3,) float
    Any vector that the image shows pointing upwards; not parallel to the viewing direction.
field_of_view : float
    Whole angle in degrees, above 0 and below 180.
field_of_view_axis : {"vertical", "horizontal", "diagonal"}
    The side, or diagonal, of the image that the angle is measured along.

Raises
------
ValueError
    For an eye on its target, an up vector along the viewing direction, an angle out of range, numbers that are
    not finite.

Examples
--------
>>> import isospline
>>> camera = isospline.PerspectiveCamera(eye=(0, -10, 0), target=(0, 0, 0), field_of_view=30)
>>> camera.rays((640, 360)).shape
(360, 640, 6)
)")
        .def(py::init([](const py::object& eye, const py::object& target, const py::object& up, double field_of_view,
                         const std::string& field_of_view_axis) {
                 const FieldOfViewAxis axis = as_enum(axis_words, field_of_view_axis, "field_of_view_axis");
                 return checked(PerspectiveCamera{as_vector(eye, "eye"), as_vector(target, "target"),
                                                  as_vector(up, "up"), field_of_view, axis});
             }),
             py::arg("eye"), py::arg("target"), py::arg("up") = py::make_tuple(0.0, 0.0, 1.0),
             py::arg("field_of_view") = 30.0, py::kw_only(), py::arg("field_of_view_axis") = "vertical")
        .def_property_readonly("eye", [](const PerspectiveCamera& camera) { return to_array(camera.eye); })
        .def_property_readonly("target", [](const PerspectiveCamera& camera) { return to_array(camera.target); })
        .def_property_readonly("up", [](const PerspectiveCamera& camera) { return to_array(camera.up); })
        .def_readonly("field_of_view", &PerspectiveCamera::field_of_view, "Degrees.")
        .def_property_readonly(
            "field_of_view_axis",
            [](const PerspectiveCamera& camera) { return to_word(axis_words, camera.field_of_view_axis); })
        .def("__repr__", [](const PerspectiveCamera& camera) {
            std::ostringstream representation;
            representation << "PerspectiveCamera(eye=" << to_text(camera.eye) << ", target=" << to_text(camera.target)
                           << ", up=" << to_text(camera.up) << ", field_of_view=" << camera.field_of_view
                           << ", field_of_view_axis=\"" << to_word(axis_words, camera.field_of_view_axis) << "\")";
            return representation.str();
        });
}

void bind_projection_plane(py::module_& module)
{
    const auto make = [](const py::object& eye, const py::object& right, const py::object& down,
                         const py::object& corner, const py::object& center) {
        if (corner.is_none() == center.is_none())
            throw_invalid("corner, center", "one of them", corner.is_none() ? "none" : "both");
        const glm::dvec3 e = as_vector(eye, "eye"), r = as_vector(right, "right"), d = as_vector(down, "down");
        return checked(corner.is_none()
                           ? ProjectionPlaneCamera::from_center(e, as_vector(center, "center"), r, d)
                           : ProjectionPlaneCamera{e, as_vector(corner, "corner"), r, d});
    };
    bind_camera_class<ProjectionPlaneCamera>(module, "ProjectionPlaneCamera",
                                             R"(A pinhole given by its eye and its projection plane, as in the paper.

The ray of the point P of the plane is x = E + t (P - E): t is 0 in the eye E and 1 on the plane. The edges need not
be perpendicular, and the pixels not be square.

Parameters
----------
eye : (3,) float
    E, world units.
right, down : (3,) float
    Edges of the image: along its whole width, and along its whole height.
corner, center : (3,) float
    The top left corner of the image, or its centre; one of them.

Raises
------
ValueError
    For edges that are zero or parallel, an eye in the plane, numbers that are not finite.

References
----------
P. Thevenaz, M. Unser, "High-quality isosurface rendering with exact gradient", section 3.

Examples
--------
>>> import isospline
>>> camera = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
>>> camera.corner
array([-0.8 ,  0.  ,  0.45])
)")
        .def(py::init(make), py::arg("eye"), py::kw_only(), py::arg("right"), py::arg("down"),
             py::arg("corner") = py::none(), py::arg("center") = py::none())
        .def_property_readonly("eye", [](const ProjectionPlaneCamera& camera) { return to_array(camera.eye); })
        .def_property_readonly("corner", [](const ProjectionPlaneCamera& camera) { return to_array(camera.corner); })
        .def_property_readonly("right", [](const ProjectionPlaneCamera& camera) { return to_array(camera.right); })
        .def_property_readonly("down", [](const ProjectionPlaneCamera& camera) { return to_array(camera.down); })
        .def("__repr__", [](const ProjectionPlaneCamera& camera) {
            return "ProjectionPlaneCamera(" + to_text(camera.eye) + ", corner=" + to_text(camera.corner) +
                   ", right=" + to_text(camera.right) + ", down=" + to_text(camera.down) + ")";
        });
}

void bind_orthographic(py::module_& module)
{
    bind_camera_class<OrthographicCamera>(module, "OrthographicCamera",
                                          R"(Parallel rays from the plane through an eye, along target - eye.

Parameters
----------
eye, target : (3,) float
    Points, world units. What lies behind the plane through the eye is not seen.
up : (3,) float
    Any vector that the image shows pointing upwards; not parallel to the viewing direction.
height : float
    Height of the image, world units; the width follows from the shape of the image.

Raises
------
ValueError
    For an eye on its target, an up vector along the viewing direction, a height that is not positive, numbers that
    are not finite.

Examples
--------
>>> import isospline
>>> camera = isospline.OrthographicCamera(eye=(0, -10, 0), target=(0, 0, 0), height=4)
>>> camera.rays((640, 360))[0, 0, 3:]
array([0., 1., 0.])
)")
        .def(py::init([](const py::object& eye, const py::object& target, const py::object& up, double height) {
                 return checked(OrthographicCamera{as_vector(eye, "eye"), as_vector(target, "target"),
                                                   as_vector(up, "up"), height});
             }),
             py::arg("eye"), py::arg("target"), py::arg("up") = py::make_tuple(0.0, 0.0, 1.0), py::kw_only(),
             py::arg("height"))
        .def_property_readonly("eye", [](const OrthographicCamera& camera) { return to_array(camera.eye); })
        .def_property_readonly("target", [](const OrthographicCamera& camera) { return to_array(camera.target); })
        .def_property_readonly("up", [](const OrthographicCamera& camera) { return to_array(camera.up); })
        .def_readonly("height", &OrthographicCamera::height, "World units.")
        .def("__repr__", [](const OrthographicCamera& camera) {
            std::ostringstream representation;
            representation << "OrthographicCamera(eye=" << to_text(camera.eye) << ", target=" << to_text(camera.target)
                           << ", up=" << to_text(camera.up) << ", height=" << camera.height << ")";
            return representation.str();
        });
}

} // namespace

void bind_camera(py::module_& module)
{
    bind_perspective(module);
    bind_projection_plane(module);
    bind_orthographic(module);
}

} // namespace isospline
