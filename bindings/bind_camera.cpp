#include "arrays.h"
#include "bind.h"
#include "camera_class.h"
#include "camera_exchange.h"

#include "isospline/render/camera.h"
#include "isospline/render/projection.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>
#include <pybind11/numpy.h>

#include <optional>
#include <sstream>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

const EnumWords<FieldOfViewAxis> axis_words{{"vertical", FieldOfViewAxis::vertical},
                                            {"horizontal", FieldOfViewAxis::horizontal},
                                            {"diagonal", FieldOfViewAxis::diagonal}};

std::string representation(const PerspectiveCamera& camera)
{
    std::ostringstream text;
    text << "PerspectiveCamera(eye=" << to_text(camera.eye) << ", target=" << to_text(camera.target)
         << ", up=" << to_text(camera.up) << ", field_of_view=" << camera.field_of_view << ", field_of_view_axis=\""
         << to_word(axis_words, camera.field_of_view_axis) << "\"";
    if (camera.aperture_radius > 0.0)
        text << ", aperture_radius=" << camera.aperture_radius;
    if (camera.focus_distance)
        text << ", focus_distance=" << *camera.focus_distance;
    return text.str() + ")";
}

PerspectiveCamera with_lens(const PerspectiveCamera& camera, std::optional<double> aperture_radius,
                            std::optional<double> f_number, std::optional<double> focal_length,
                            std::optional<double> focus_distance)
{
    PerspectiveCamera changed = camera;
    changed.focus_distance = focus_distance;
    if (aperture_radius.has_value() == f_number.has_value())
        throw_invalid("aperture_radius, f_number", "one of them", f_number ? "both" : "none");
    if (f_number.has_value() != focal_length.has_value())
        throw_invalid("f_number, focal_length", "both of them or none", f_number ? "f_number" : "focal_length");
    if (f_number) {
        check_positive("f_number", *f_number);
        check_positive("focal_length", *focal_length);
        changed.aperture_radius = *focal_length / (2.0 * *f_number);
    } else {
        changed.aperture_radius = *aperture_radius;
    }
    return checked(changed);
}

void bind_perspective(py::module_& module)
{
    auto camera_class = bind_camera_class<PerspectiveCamera>(
        module, "PerspectiveCamera", R"(An eye that looks at a target: a pinhole, or a thin lens.

With a lens, only objects in the plane in focus are sharp. Every sample of a pixel goes through another point of the
lens, so pictures need many samples: `render(..., samples=64)`. Depth, position and all other layers come from the ray
through the centre.

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
aperture_radius : float
    Of the lens, world units; 0 is a pinhole. See `with_lens` for f-numbers.
focus_distance : float, optional
    From the eye to the plane in focus, along the viewing direction, world units; by default to the target.

Raises
------
ValueError
    For an eye on its target, an up vector along the viewing direction, an angle out of range, a negative aperture, a
    focus distance that is not positive, numbers that are not finite.

Examples
--------
>>> import isospline
>>> camera = isospline.PerspectiveCamera(eye=(0, -10, 0), target=(0, 0, 0), field_of_view=30)
>>> camera.rays((640, 360)).shape
(360, 640, 6)
)");
    bind_world_to_ndc(camera_class);
    bind_exchange(camera_class);
    camera_class
        .def(py::init([](const py::object& eye, const py::object& target, const py::object& up, double field_of_view,
                         const std::string& field_of_view_axis, double aperture_radius,
                         std::optional<double> focus_distance) {
                 const FieldOfViewAxis axis = as_enum(axis_words, field_of_view_axis, "field_of_view_axis");
                 return checked(PerspectiveCamera{as_vector(eye, "eye"), as_vector(target, "target"),
                                                  as_vector(up, "up"), field_of_view, axis, aperture_radius,
                                                  focus_distance});
             }),
             py::arg("eye"), py::arg("target"), py::arg("up") = py::make_tuple(0.0, 0.0, 1.0),
             py::arg("field_of_view") = 30.0, py::kw_only(), py::arg("field_of_view_axis") = "vertical",
             py::arg("aperture_radius") = 0.0, py::arg("focus_distance") = py::none())
        .def("with_lens", &with_lens, py::arg("aperture_radius") = py::none(), py::kw_only(),
             py::arg("f_number") = py::none(), py::arg("focal_length") = py::none(),
             py::arg("focus_distance") = py::none(), R"(The same camera with another lens.

Parameters
----------
aperture_radius : float, optional
    Of the lens, world units.
f_number, focal_length : float, optional
    Instead of the radius: N and f of a lens whose aperture has the diameter f / N; f in world units.
focus_distance : float, optional
    From the eye to the plane in focus, along the viewing direction, world units; by default to the target.

Returns
-------
PerspectiveCamera

Raises
------
ValueError
    Unless either the radius or both the f-number and the focal length are given, and for numbers that the camera does
    not accept.

Examples
--------
>>> import isospline
>>> camera = isospline.PerspectiveCamera(eye=(0, -10, 0), target=(0, 0, 0))
>>> camera.with_lens(f_number=2, focal_length=0.5, focus_distance=9).aperture_radius
0.125
)")
        .def_readonly("eye", &PerspectiveCamera::eye)
        .def_readonly("target", &PerspectiveCamera::target)
        .def_readonly("up", &PerspectiveCamera::up)
        .def_readonly("field_of_view", &PerspectiveCamera::field_of_view, "float, degrees: the whole angle.")
        .def_property_readonly(
            "field_of_view_axis",
            [](const PerspectiveCamera& camera) { return to_word(axis_words, camera.field_of_view_axis); })
        .def_readonly("aperture_radius", &PerspectiveCamera::aperture_radius, "float, world units; 0 is a pinhole.")
        .def_property_readonly(
            "focus_distance",
            [](const PerspectiveCamera& camera) {
                return camera.focus_distance.value_or(glm::distance(camera.eye, camera.target));
            },
            "float, world units: from the eye to the plane in focus, along the viewing direction.")
        .def("_focus_distance", [](const PerspectiveCamera& camera) { return camera.focus_distance; })
        .def("__repr__", [](const PerspectiveCamera& camera) { return representation(camera); });
}

void bind_projection_plane(py::module_& module)
{
    const auto make = [](const py::object& eye, const py::object& right, const py::object& down,
                         const py::object& corner, const py::object& center, const py::object& distortion) {
        if (corner.is_none() == center.is_none())
            throw_invalid("corner, center", "one of them", corner.is_none() ? "none" : "both");
        const glm::dvec3 e = as_vector(eye, "eye"), r = as_vector(right, "right"), d = as_vector(down, "down");
        auto camera = corner.is_none() ? ProjectionPlaneCamera::from_center(e, as_vector(center, "center"), r, d)
                                       : ProjectionPlaneCamera{e, as_vector(corner, "corner"), r, d};
        camera.distortion = as_distortion(distortion);
        return checked(camera);
    };
    auto camera_class = bind_camera_class<ProjectionPlaneCamera>(
        module, "ProjectionPlaneCamera",
        R"(A pinhole given by its eye and its projection plane, as in the paper.

The ray of the point P of the plane is x = E + t (P - E): t is 0 in the eye E and 1 on the plane. The edges need not
be perpendicular, and pixels need not be square.

Parameters
----------
eye : (3,) float
    E, world units.
right, down : (3,) float
    Edges of the image, world units: along its whole width, and along its whole height.
corner, center : (3,) float
    The top left corner of the image, or its centre, world units. Give one of them.
distortion : (4,), (5,), (8,) or (12,) float, optional
    Distortion of the lens, in OpenCV's order; see `from_opencv`. The ray of the image point P then goes through the
    point of the plane that the lens shows at P.

Raises
------
ValueError
    For edges that are zero or parallel, an eye in the plane, numbers that are not finite, a distortion that folds the
    image, and unless exactly one of `corner` and `center` is given.

References
----------
P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, section 3.

Examples
--------
>>> import isospline
>>> camera = isospline.ProjectionPlaneCamera((0, -5, 0), center=(0, 0, 0), right=(1.6, 0, 0), down=(0, 0, -0.9))
>>> camera.corner
array([-0.8 ,  0.  ,  0.45])
)");
    bind_world_to_ndc(camera_class);
    bind_exchange(camera_class);
    camera_class
        .def(py::init(make), py::arg("eye"), py::kw_only(), py::arg("right"), py::arg("down"),
             py::arg("corner") = py::none(), py::arg("center") = py::none(), py::arg("distortion") = py::none())
        .def_readonly("eye", &ProjectionPlaneCamera::eye)
        .def_readonly("corner", &ProjectionPlaneCamera::corner)
        .def_readonly("right", &ProjectionPlaneCamera::right)
        .def_readonly("down", &ProjectionPlaneCamera::down)
        .def_property_readonly(
            "distortion",
            [](const ProjectionPlaneCamera& camera) -> py::object {
                const auto& coefficients = camera.distortion.coefficients;
                if (camera.distortion.is_none())
                    return py::none();
                return py::array_t<double>(static_cast<py::ssize_t>(coefficients.size()), coefficients.data());
            },
            "(12,) float64 array: the lens's coefficients in OpenCV's order, or None.")
        .def("__repr__", [](const ProjectionPlaneCamera& camera) {
            return "ProjectionPlaneCamera(" + to_text(camera.eye) + ", corner=" + to_text(camera.corner) +
                   ", right=" + to_text(camera.right) + ", down=" + to_text(camera.down) +
                   (camera.distortion.is_none() ? ")" : ", distortion=...)");
        });
}

void bind_orthographic(py::module_& module)
{
    auto camera_class =
        bind_camera_class<OrthographicCamera>(module, "OrthographicCamera",
                                              R"(Parallel rays from the plane through an eye, along target - eye.

Parameters
----------
eye, target : (3,) float
    Points, world units. Objects behind the plane through the eye are not visible.
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
)");
    bind_world_to_ndc(camera_class);
    bind_exchange(camera_class);
    camera_class
        .def(py::init([](const py::object& eye, const py::object& target, const py::object& up, double height) {
                 return checked(OrthographicCamera{as_vector(eye, "eye"), as_vector(target, "target"),
                                                   as_vector(up, "up"), height});
             }),
             py::arg("eye"), py::arg("target"), py::arg("up") = py::make_tuple(0.0, 0.0, 1.0), py::kw_only(),
             py::arg("height"))
        .def_readonly("eye", &OrthographicCamera::eye)
        .def_readonly("target", &OrthographicCamera::target)
        .def_readonly("up", &OrthographicCamera::up)
        .def_readonly("height", &OrthographicCamera::height, "float, world units: height of the image.")
        .def("__repr__", [](const OrthographicCamera& camera) {
            std::ostringstream representation;
            representation << "OrthographicCamera(eye=" << to_text(camera.eye) << ", target=" << to_text(camera.target)
                           << ", up=" << to_text(camera.up) << ", height=" << camera.height << ")";
            return representation.str();
        });
}

void bind_panoramic(py::module_& module)
{
    bind_camera_class<PanoramicCamera>(module, "PanoramicCamera", R"(All around an eye, in equirectangular projection.

Columns are longitudes, from -180 to 180 degrees, rows are latitudes, from 90 down to -90 degrees, and the middle of
the image shows the target. Pixels on the horizon are square if the image is twice as wide as high. The depth of a
panorama is the distance from the eye. The projection is not linear, so there is no `world_to_ndc`.

Parameters
----------
eye, target : (3,) float
    Points, world units.
up : (3,) float
    Any vector that the middle of the image shows pointing upwards; not parallel to the viewing direction.

Raises
------
ValueError
    For an eye on its target, an up vector along the viewing direction, numbers that are not finite.

Examples
--------
>>> import isospline
>>> camera = isospline.PanoramicCamera(eye=(0, 0, 0), target=(0, 1, 0))
>>> camera.rays((3, 1))[0, :, 3:].round(3) + 0.0
array([[-0.866, -0.5  ,  0.   ],
       [ 0.   ,  1.   ,  0.   ],
       [ 0.866, -0.5  ,  0.   ]])
)")
        .def(py::init([](const py::object& eye, const py::object& target, const py::object& up) {
                 return checked(
                     PanoramicCamera{as_vector(eye, "eye"), as_vector(target, "target"), as_vector(up, "up")});
             }),
             py::arg("eye"), py::arg("target"), py::arg("up") = py::make_tuple(0.0, 0.0, 1.0))
        .def_readonly("eye", &PanoramicCamera::eye)
        .def_readonly("target", &PanoramicCamera::target)
        .def_readonly("up", &PanoramicCamera::up)
        .def("__repr__", [](const PanoramicCamera& camera) {
            return "PanoramicCamera(eye=" + to_text(camera.eye) + ", target=" + to_text(camera.target) +
                   ", up=" + to_text(camera.up) + ")";
        });
}

} // namespace

void bind_camera(py::module_& module)
{
    bind_perspective(module);
    bind_projection_plane(module);
    bind_orthographic(module);
    bind_panoramic(module);
}

} // namespace isospline
