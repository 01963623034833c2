#include "arrays.h"
#include "bind.h"
#include "cameras.h"
#include "long_call.h"

#include "isospline/render/opencv_camera.h"
#include "isospline/render/projection.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

using Size = std::array<int, 2>;

const EnumWords<FieldOfViewAxis> axis_words{{"vertical", FieldOfViewAxis::vertical},
                                            {"horizontal", FieldOfViewAxis::horizontal},
                                            {"diagonal", FieldOfViewAxis::diagonal}};

py::array_t<double> rays_of(const Camera& camera, Size size)
{
    const Projection projection(camera, {size[0], size[1]});
    auto rays = new_array<double>({size[1], size[0]}, {6});
    auto values = rays.mutable_unchecked<3>();
    long_call("to make the rays of " + size_text(size[0], size[1]), py::none(), [&](const Progress& progress) {
        const auto fill = [&](std::size_t begin, std::size_t end) {
            for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
                for (int x = 0; x < size[0]; ++x) {
                    const Ray ray = projection.ray({x + 0.5, y + 0.5});
                    for (int axis = 0; axis < 3; ++axis) {
                        values(y, x, axis) = ray.origin[axis];
                        values(y, x, axis + 3) = ray.direction[axis];
                    }
                }
        };
        parallel_for(static_cast<std::size_t>(size[1]), 4, fill, progress);
    });
    return rays;
}

glm::dmat4 world_to_ndc(const Camera& camera, Size size)
{
    const auto matrix = Projection(camera, {size[0], size[1]}).world_to_ndc();
    if (!matrix)
        throw_invalid("camera", "one whose lens has no distortion, which no matrix describes", "one that has");
    return *matrix;
}

/// The depths of a box (2, 3) between which ColorByDepth has its colours by default.
py::tuple depth_range(const Camera& camera, const py::object& bounds)
{
    const RowArray corners(bounds, "bounds", 3);
    const glm::dvec2 range = Projection(camera, glm::ivec2(1)).depth_range({corners.vector(0), corners.vector(1)});
    return py::make_tuple(range.x, range.y);
}

/// The directions of the rays through the upper and the lower left corner of the image.
py::tuple left_corners(const Camera& camera, Size size)
{
    const Projection projection(camera, {size[0], size[1]});
    return py::make_tuple(projection.ray({0.0, 0.0}).direction, projection.ray({0.0, size[1]}).direction);
}

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

py::tuple camera_to_opencv(const Camera& camera, Size size, double pixel_center)
{
    const OpenCvCamera converted = to_opencv(camera, {size[0], size[1]}, pixel_center);
    return py::make_tuple(converted.intrinsics, converted.rotation, converted.translation);
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

void read(const py::object& part, const char* name, FieldOfViewAxis& member)
{
    member = as_enum(axis_words, part.cast<std::string>(), name);
}

void read(const py::object& part, const char*, LensDistortion& member)
{
    member = as_distortion(part);
}

py::object written(const FieldOfViewAxis& member)
{
    return py::cast(to_word(axis_words, member));
}

py::object written(const LensDistortion& member)
{
    if (member.is_none())
        return py::none();
    const auto& coefficients = member.coefficients;
    return py::array_t<double>(static_cast<py::ssize_t>(coefficients.size()), coefficients.data());
}

void bind_camera(py::module_& module)
{
    const auto camera = py::arg("camera");
    const auto size = py::arg("size");
    // A projection checks that its camera gives an image.
    module.def(
        "_check_camera", [](const Camera& given) { Projection(given, glm::ivec2(1)); }, camera);
    module.def("_camera_rays", &rays_of, camera, size);
    module.def(
        "_world_to_camera", [](const Camera& given) { return Projection(given, glm::ivec2(1)).world_to_camera(); },
        camera);
    module.def("_world_to_ndc", &world_to_ndc, camera, size);
    module.def("_depth_range", &depth_range, camera, py::arg("bounds"));
    module.def("_left_corners", &left_corners, camera, size);
    module.def(
        "_distortion", [](const py::object& given) { return written(as_distortion(given)); }, py::arg("given"));
    module.def("_camera_from_opencv", &camera_from_opencv, py::arg("intrinsics"), py::arg("rotation"),
               py::arg("translation") = py::none(), py::arg("size") = py::none(), py::arg("pixel_center") = 0.0,
               py::arg("distortion") = py::none());
    module.def("_camera_to_opencv", &camera_to_opencv, camera, size, py::arg("pixel_center"));
}

} // namespace isospline
