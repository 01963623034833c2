#include "arrays.h"
#include "camera_class.h"
#include "camera_exchange.h"

#include "isospline/render/opencv_camera.h"

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/trigonometric.hpp>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <tuple>

namespace py = pybind11;

namespace isospline {

namespace {

// PyVista and VTK.

struct CameraPosition {
    glm::dvec3 position, focal_point, view_up;
};

CameraPosition as_camera_position(const py::object& value)
{
    const char* const expected = "three points: position, focal point and view up";
    if (!py::isinstance<py::sequence>(value) && !py::hasattr(value, "__getitem__"))
        throw_wrong_type("camera_position", expected, value);
    if (py::isinstance<py::str>(value))
        throw_invalid("camera_position", expected, "\"" + value.cast<std::string>() + "\"");
    const py::list points(value);
    if (points.size() != 3)
        throw_invalid("camera_position", expected, std::to_string(points.size()) + " of them");
    return {as_vector(points[0], "camera_position"), as_vector(points[1], "camera_position"),
            as_vector(points[2], "camera_position")};
}

py::tuple to_camera_position(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up)
{
    const auto point = [](const glm::dvec3& v) { return py::make_tuple(v.x, v.y, v.z); };
    return py::make_tuple(point(eye), point(target), point(up));
}

py::tuple perspective_to_pyvista(const PerspectiveCamera& camera, std::optional<std::array<int, 2>> size)
{
    double view_angle = camera.field_of_view;
    if (camera.field_of_view_axis != FieldOfViewAxis::vertical) {
        if (!size)
            throw_invalid("size", "width and height of the image, since the field of view is not vertical", "None");
        const Projection projection(camera, {(*size)[0], (*size)[1]});
        const glm::dvec3 height = projection.ray({0.0, (*size)[1]}).direction - projection.ray({0.0, 0.0}).direction;
        view_angle = 2.0 * glm::degrees(std::atan(0.5 * glm::length(height)));
    }
    return py::make_tuple(to_camera_position(camera.eye, camera.target, camera.up), view_angle);
}

constexpr const char* perspective_from_pyvista_doc = R"(The camera of a PyVista plotter, or of VTK.

Parameters
----------
camera_position : three of (3,) float
    Position, focal point and view up, as `Plotter.camera_position` has them.
view_angle : float
    Vertical, degrees, as `Plotter.camera.view_angle`.

Returns
-------
PerspectiveCamera

Examples
--------
>>> import isospline
>>> camera = isospline.PerspectiveCamera.from_pyvista([(0, -9, 3), (0, 0, 0), (0, 0, 1)], 25)
>>> camera.to_pyvista()
(((0.0, -9.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), 25.0)
)";

constexpr const char* perspective_to_pyvista_doc = R"(The camera for a PyVista plotter.

Parameters
----------
size : (int, int), optional
    Width and height of the image; needed if the field of view is not vertical.

Returns
-------
camera_position : three tuples
    Position, focal point and view up, for `Plotter.camera_position`.
view_angle : float
    Vertical, degrees, for `Plotter.camera.view_angle`.

Raises
------
ValueError
    If the field of view is not vertical and `size` is None.
)";

constexpr const char* orthographic_from_pyvista_doc = R"(The camera of a PyVista plotter in parallel projection.

Parameters
----------
camera_position : three of (3,) float
    Position, focal point and view up, as `Plotter.camera_position` has them.
parallel_scale : float
    Half of the height of the image, world units, as `Plotter.camera.parallel_scale`.

Returns
-------
OrthographicCamera
)";

constexpr const char* orthographic_to_pyvista_doc = R"(The camera for a PyVista plotter in parallel projection.

Returns
-------
camera_position : three tuples
    Position, focal point and view up, for `Plotter.camera_position`.
parallel_scale : float
    Half of the height of the image, world units, for `Plotter.camera.parallel_scale`.
)";

// OpenCV.

/// A rotation matrix, or OpenCV's rotation vector: axis times angle.
glm::dmat3 as_rotation(const py::object& value)
{
    const py::array numbers = as_array(value, "rotation", "iuf", "a (3, 3) matrix or a (3,) rotation vector");
    if (numbers.size() != 3)
        return as_matrix3(value, "rotation");
    const glm::dvec3 vector = as_vector(numbers.attr("reshape")(3), "rotation");
    const double angle = glm::length(vector);
    if (!(angle > 0.0))
        return glm::dmat3(1.0);
    return glm::dmat3(glm::rotate(glm::dmat4(1.0), angle, vector));
}

/// R and t, or both in one (3, 4) or (4, 4) matrix.
void set_extrinsics(OpenCvCamera& camera, const py::object& rotation, const py::object& translation)
{
    if (translation.is_none()) {
        const py::array both = as_array(rotation, "rotation", "iuf", "a (4, 4) matrix if translation is None");
        const Shape shape = shape_of(both);
        if (shape != Shape{4, 4} && shape != Shape{3, 4})
            throw_invalid("rotation", "shape (4, 4) or (3, 4) if translation is None", to_text(shape));
        if (shape[0] == 4) {
            const glm::dmat4 matrix = as_matrix4(both, "rotation");
            if (glm::row(matrix, 3) != glm::dvec4(0.0, 0.0, 0.0, 1.0))
                throw_invalid("rotation", "the last row (0, 0, 0, 1)", "another");
        }
        camera.rotation = as_matrix3(both[py::make_tuple(py::slice(0, 3, 1), py::slice(0, 3, 1))], "rotation");
        camera.translation = as_vector(both[py::make_tuple(py::slice(0, 3, 1), 3)], "rotation");
        return;
    }
    py::array t = as_array(translation, "translation", "iuf");
    if (t.size() == 3) // also a column, as from cv2.solvePnP
        t = t.attr("reshape")(3);
    camera.rotation = as_rotation(rotation);
    camera.translation = as_vector(t, "translation");
}

ProjectionPlaneCamera camera_from_opencv(const py::object& intrinsics, const py::object& rotation,
                                         const py::object& translation, std::optional<std::array<int, 2>> size,
                                         double pixel_center, const py::object& distortion)
{
    OpenCvCamera camera;
    camera.intrinsics = as_matrix3(intrinsics, "intrinsics");
    set_extrinsics(camera, rotation, translation);
    camera.pixel_center = pixel_center;
    camera.distortion = as_distortion(distortion);
    if (!size)
        throw_invalid("size", "width and height of the calibrated image in pixels", "None");
    return from_opencv(camera, {(*size)[0], (*size)[1]});
}

template <typename GivenCamera>
py::tuple camera_to_opencv(const GivenCamera& camera, std::array<int, 2> size, double pixel_center)
{
    const OpenCvCamera converted = to_opencv(camera, {size[0], size[1]}, pixel_center);
    return py::make_tuple(converted.intrinsics, converted.rotation, converted.translation);
}

constexpr const char* from_opencv_doc = R"(The camera of a calibration by OpenCV.

.. math:: w (u, v, 1)^T = K (R X + t), \quad w > 0

Parameters
----------
intrinsics : (3, 3) float
    K: rows (fx, skew, cx), (0, fy, cy) and (0, 0, 1), pixels.
rotation : (3, 3), (3,), (4, 4) or (3, 4) float
    R, world to camera; or the rotation vector of `cv2.solvePnP`, axis times angle; or, without a translation, the
    extrinsic matrix (R t), as in Open3D's `create_rays_pinhole`.
translation : (3,) or (3, 1) float, optional
    t.
size : (int, int)
    Width and height of the calibrated image in pixels. Pictures of another size show the same scene, in more or fewer
    pixels.
pixel_center : float
    u and v in the centre of the top left pixel: 0 in OpenCV, 0.5 in Open3D, COLMAP and others.
distortion : (4,), (5,), (8,) or (12,) float, optional
    OpenCV's distCoeffs: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4. Rays are those of the distorted photograph, so
    that a picture matches it pixel by pixel, without `cv2.undistort`.

Returns
-------
ProjectionPlaneCamera

Raises
------
ValueError
    For a K of another form, an R that is not a rotation, a `size` of None, numbers that are not finite, a tilted sensor
    (the last two of 14 coefficients), and a distortion that folds the image, because its polynomial is not monotonic
    there.

Examples
--------
>>> import isospline
>>> K = [(800, 0, 319.5), (0, 800, 239.5), (0, 0, 1)]
>>> camera = isospline.ProjectionPlaneCamera.from_opencv(K, (0, 0, 0), (0, 0, 10), size=(640, 480))
>>> camera.eye + 0.0
array([  0.,   0., -10.])
)";

constexpr const char* to_opencv_doc = R"(The camera in OpenCV's form; see `ProjectionPlaneCamera.from_opencv`.

Parameters
----------
size : (int, int)
    Width and height of the image in pixels.
pixel_center : float
    u and v in the centre of the top left pixel: 0 in OpenCV, 0.5 in Open3D, COLMAP and others.

Returns
-------
intrinsics, rotation, translation : (3, 3), (3, 3) and (3,) float64 array
    K, R and t. The coefficients of a lens with distortion are `distortion`.

Raises
------
ValueError
    If the image is mirrored.
)";

template <typename GivenCamera>
void bind_to_opencv(py::class_<GivenCamera>& camera_class)
{
    camera_class.def("to_opencv", &camera_to_opencv<GivenCamera>, py::arg("size"), py::kw_only(),
                     py::arg("pixel_center") = 0.0, to_opencv_doc);
}

} // namespace

LensDistortion as_distortion(const py::object& value)
{
    LensDistortion distortion;
    if (value.is_none())
        return distortion;
    const py::array given = as_array(value, "distortion", "iuf", "4, 5, 8 or 12 coefficients");
    const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>(given.attr("ravel")());
    const auto count = static_cast<std::size_t>(numbers.size());
    const std::size_t known = distortion.coefficients.size();
    if (count != 4 && count != 5 && count != 8 && count != known && count != known + 2)
        throw_invalid("distortion", "4, 5, 8 or 12 coefficients", count);
    for (std::size_t i = known; i < count; ++i)
        if (numbers.data()[i] != 0.0)
            throw_invalid("distortion", "a sensor that is not tilted: zeros as the last two of 14 coefficients",
                          numbers.data()[i]);
    std::copy_n(numbers.data(), std::min(count, known), distortion.coefficients.begin());
    return distortion;
}

void bind_exchange(py::class_<PerspectiveCamera>& camera_class)
{
    const auto from_pyvista = [](const py::object& camera_position, double view_angle) {
        const auto [position, focal_point, view_up] = as_camera_position(camera_position);
        return checked(PerspectiveCamera{position, focal_point, view_up, view_angle});
    };
    camera_class
        .def_static("from_pyvista", from_pyvista, py::arg("camera_position"), py::arg("view_angle") = 30.0,
                    perspective_from_pyvista_doc)
        .def("to_pyvista", &perspective_to_pyvista, py::arg("size") = py::none(), perspective_to_pyvista_doc);
    bind_to_opencv(camera_class);
}

void bind_exchange(py::class_<ProjectionPlaneCamera>& camera_class)
{
    camera_class.def_static("from_opencv", &camera_from_opencv, py::arg("intrinsics"), py::arg("rotation"),
                            py::arg("translation") = py::none(), py::arg("size") = py::none(), py::kw_only(),
                            py::arg("pixel_center") = 0.0, py::arg("distortion") = py::none(), from_opencv_doc);
    bind_to_opencv(camera_class);
}

void bind_exchange(py::class_<OrthographicCamera>& camera_class)
{
    const auto from_pyvista = [](const py::object& camera_position, double parallel_scale) {
        const auto [position, focal_point, view_up] = as_camera_position(camera_position);
        return checked(OrthographicCamera{position, focal_point, view_up, 2.0 * parallel_scale});
    };
    const auto to_pyvista = [](const OrthographicCamera& camera) {
        return py::make_tuple(to_camera_position(camera.eye, camera.target, camera.up), 0.5 * camera.height);
    };
    camera_class
        .def_static("from_pyvista", from_pyvista, py::arg("camera_position"), py::arg("parallel_scale"),
                    orthographic_from_pyvista_doc)
        .def("to_pyvista", to_pyvista, orthographic_to_pyvista_doc);
}

} // namespace isospline
