// Colours between Python and GLM.
#pragma once

#include "arrays.h"
#include "handed.h"

#include "isospline/shade/color.h"
#include "isospline/util/check.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace isospline {

/// The parts of a colour: one number, or a sequence of one of the lengths in `counts`. The name of a colour gives three
/// numbers, or four if it has an opacity and that is allowed.
inline std::vector<double> as_color_parts(const pybind11::handle& value, const char* parameter,
                                          std::initializer_list<pybind11::ssize_t> counts, const char* expected)
{
    namespace py = pybind11;
    const bool takes_opacity = std::find(counts.begin(), counts.end(), 4) != counts.end();
    const py::array array =
        as_array(py::isinstance<py::str>(value) ? handed("named_color")(value, parameter, takes_opacity)
                                                : py::reinterpret_borrow<py::object>(value),
                 parameter, "iuf", expected);
    if (array.ndim() > 1 || std::find(counts.begin(), counts.end(), array.size()) == counts.end())
        throw_invalid(parameter, expected, "shape " + to_text(shape_of(array)));
    const py::array_t<double, py::array::c_style | py::array::forcecast> numbers(array);
    return {numbers.data(), numbers.data() + numbers.size()};
}

/// Refuses parts above 1, which are most likely 8-bit colours; `value` is the original argument.
inline void check_not_above_one(const glm::dvec3& color, const pybind11::handle& value, const char* parameter)
{
    if (std::max({color.x, color.y, color.z}) > 1.0)
        throw pybind11::value_error(handed("above_one")(parameter, value).cast<std::string>());
}

/// A colour or an intensity, from three numbers or from one number for all three.
inline glm::dvec3 as_color(const pybind11::handle& value, const char* parameter)
{
    const auto parts = as_color_parts(value, parameter, {1, 3}, "one number, three (red, green, blue) or a name");
    return parts.size() == 1 ? glm::dvec3(parts[0]) : glm::dvec3(parts[0], parts[1], parts[2]);
}

/// What a colour is made of, with numbers in sRGB decoded; names and linear numbers as they are.
inline pybind11::object decoded(const pybind11::handle& value)
{
    return handed("decoded")(value);
}

/// A rule for colours; nothing for a value that is none.
std::optional<Color> color_rule(const pybind11::handle& value);

/// The colour of a surface: a colour or a rule.
inline Color as_surface_color(const pybind11::handle& value, const char* parameter)
{
    if (auto rule = color_rule(value))
        return *std::move(rule);
    const glm::dvec3 color = as_color(decoded(value), parameter);
    check_not_above_one(color, value, parameter);
    return color;
}

/// The same, or None.
inline CapColor as_cap_color(const pybind11::object& value, const char* parameter)
{
    return value.is_none() ? CapColor() : as_surface_color(value, parameter);
}

/// A colour in Python: linear numbers that are marked as such, or the rule.
pybind11::object to_python(const Color& color);

inline pybind11::object to_python(const CapColor& color)
{
    return color ? to_python(*color) : pybind11::none();
}

/// A colour and an opacity, which is 1 by default; None is transparent.
inline glm::vec4 as_background(const pybind11::handle& value, const char* parameter)
{
    const bool is_transparent =
        pybind11::isinstance<pybind11::str>(value) && value.cast<std::string>() == "transparent";
    if (value.is_none() || is_transparent)
        return glm::vec4(0.0f);
    const auto parts = as_color_parts(decoded(value), parameter, {1, 3, 4},
                                      "None, a name, or one, three (red, green, blue) or four (and opacity) numbers");
    const glm::dvec3 color = parts.size() == 1 ? glm::dvec3(parts[0]) : glm::dvec3(parts[0], parts[1], parts[2]);
    check_not_above_one(color, value, parameter);
    return glm::vec4(glm::dvec4(color, parts.size() == 4 ? parts[3] : 1.0));
}

} // namespace isospline
