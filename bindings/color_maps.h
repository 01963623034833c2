// Colour maps between Python and C++: what colours by a number have in common.
#pragma once

#include "arrays.h"
#include "handed.h"

#include "isospline/shade/color.h"
#include "isospline/util/check.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

namespace isospline {

using Limits = std::pair<double, double>;

/// The parameter `cmap` in the docstrings of all colours by a number.
inline const std::string cmap_parameter = R"(cmap : str, matplotlib Colormap or (N, 3) array_like
    The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
    Between them, colours are interpolated in linear light.
)";

/// Python code looks up the names of colour maps.
inline ColorMap as_color_map(const pybind11::object& cmap, Limits limits)
{
    const pybind11::object table = handed("color_map")(cmap);
    const RowArray rows(table, "cmap", 3);
    ColorMap map{{}, {limits.first, limits.second}};
    for (std::size_t i = 0; i < rows.count(); ++i)
        map.colors.push_back(rows.vector(i));
    validate(map);
    return map;
}

inline pybind11::array_t<double> colors_of(const ColorMap& map)
{
    auto array = new_array<double>({static_cast<pybind11::ssize_t>(map.colors.size())}, {3});
    for (std::size_t i = 0; i < map.colors.size(); ++i)
        for (int channel = 0; channel < 3; ++channel)
            array.mutable_at(static_cast<pybind11::ssize_t>(i), channel) = map.colors[i][channel];
    return array;
}

inline std::string limits_text(const ColorMap& map)
{
    return "limits=(" + to_text(map.limits.x) + ", " + to_text(map.limits.y) + ")";
}

/// The common members of all colours by a number.
template <typename GivenColor>
void bind_map(pybind11::class_<GivenColor>& color_class)
{
    color_class
        .def_property_readonly(
            "cmap", [](const GivenColor& color) { return handed("encoded")(colors_of(color.map)); },
            "(N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.")
        .def("_cmap", [](const GivenColor& color) { return handed("linear")(colors_of(color.map)); })
        .def_property_readonly("limits", [](const GivenColor& color) -> std::optional<Limits> {
            if constexpr (requires { color.fit_limits; })
                if (color.fit_limits)
                    return std::nullopt;
            return Limits{color.map.limits.x, color.map.limits.y};
        });
}

} // namespace isospline
