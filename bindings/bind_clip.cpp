#include "arrays.h"
#include "bind.h"
#include "clip.h"

#include "isospline/util/check.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* half_space_doc = R"(The side of a plane that is kept: the points x with <normal, x - point> >= 0.

Parameters
----------
point : (3,) array_like, world units
    Any point of the plane.
normal : (3,) array_like
    Points to the side that is kept; any length except zero.

Raises
------
ValueError
    For a normal of zero, and numbers that are not finite.

Examples
--------
>>> import isospline
>>> isospline.HalfSpace((0, 0, 5), (0, 0, 1))
HalfSpace(point=(0, 0, 5), normal=(0, 0, 1))
)";

constexpr const char* box_doc = R"(An axis-aligned box.

Parameters
----------
minimum, maximum : (3,) array_like, world units
    Its corners; the minimum is below the maximum along each axis. Sides may be at infinity.

Raises
------
ValueError
    For a maximum that is not above the minimum, and for NaN.

Examples
--------
>>> import isospline
>>> isospline.Box((0, 0, 0), (10, 20, 30))
Box(minimum=(0, 0, 0), maximum=(10, 20, 30))
)";

/// A half-space given from Python.
struct Plane {
    glm::dvec3 point;
    glm::dvec3 normal;
};

std::string tuple_text(const glm::dvec3& vector)
{
    std::ostringstream text;
    text.precision(12);
    text << "(" << vector.x << ", " << vector.y << ", " << vector.z << ")";
    return text.str();
}

Plane make_half_space(const py::object& point, const py::object& normal)
{
    const Plane plane{as_vector(point, "point"), as_vector(normal, "normal")};
    check_finite("point", plane.point);
    check_direction("normal", plane.normal);
    return plane;
}

Box make_box(const py::object& minimum, const py::object& maximum)
{
    const Box box{as_vector(minimum, "minimum"), as_vector(maximum, "maximum")};
    for (int axis = 0; axis < 3; ++axis)
        if (!(box.lower[axis] < box.upper[axis]))
            throw_invalid("maximum", "numbers above those of the minimum, " + tuple_text(box.lower),
                          tuple_text(box.upper));
    return box;
}

void add_clip(std::vector<HalfSpace>& clip, const py::handle& part)
{
    if (py::isinstance<Plane>(part)) {
        const auto& [point, normal] = part.cast<const Plane&>();
        const glm::dvec3 scaled = normal / std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
        clip.push_back({scaled, glm::dot(scaled, point)});
    } else if (py::isinstance<Box>(part)) {
        const auto sides = half_spaces(part.cast<const Box&>());
        clip.insert(clip.end(), sides.begin(), sides.end());
    } else {
        throw_wrong_type("clip", "a HalfSpace, a Box or a sequence of them", part);
    }
}

} // namespace

std::vector<HalfSpace> as_clip(const py::object& value)
{
    std::vector<HalfSpace> clip;
    if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
        for (const py::handle part : value)
            add_clip(clip, part);
    } else if (!value.is_none()) {
        add_clip(clip, value);
    }
    return clip;
}

void bind_clip(py::module_& module)
{
    py::class_<Plane>(module, "HalfSpace", half_space_doc)
        .def(py::init(&make_half_space), py::arg("point"), py::arg("normal"))
        .def_readonly("point", &Plane::point, "(3,) float64 array, world units: a point of the plane.")
        .def_readonly("normal", &Plane::normal, "(3,) float64 array: points to the side that is kept.")
        .def("__repr__", [](const Plane& plane) {
            return "HalfSpace(point=" + tuple_text(plane.point) + ", normal=" + tuple_text(plane.normal) + ")";
        });
    py::class_<Box>(module, "Box", box_doc)
        .def(py::init(&make_box), py::arg("minimum"), py::arg("maximum"))
        .def_readonly("minimum", &Box::lower, "(3,) float64 array, world units: the lower corner.")
        .def_readonly("maximum", &Box::upper, "(3,) float64 array, world units: the upper corner.")
        .def("__repr__", [](const Box& box) {
            return "Box(minimum=" + tuple_text(box.lower) + ", maximum=" + tuple_text(box.upper) + ")";
        });
}

} // namespace isospline
