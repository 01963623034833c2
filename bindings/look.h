// The look of an object from the keyword arguments of its constructor.
#pragma once

#include "colors.h"
#include "looks.h"
#include "mistakes.h"

#include "isospline/shade/material.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace isospline {

/// The material of an object: the given one, or one of a colour, an opacity and a name; null if none is given.
inline std::shared_ptr<Material> look_of(const std::optional<Material>& material, const pybind11::object& color,
                                         const pybind11::object& opacity, const pybind11::object& name)
{
    namespace py = pybind11;
    for (const auto& [parameter, value] : {std::pair{"color", &color}, {"opacity", &opacity}, {"name", &name}})
        if (material && !value->is_none())
            throw py::type_error(std::string(parameter) + ": cannot be combined with material; did you mean Material(" +
                                 parameter + "=...)?");
    if (color.is_none() && opacity.is_none() && name.is_none())
        return material ? std::make_shared<Material>(*material) : nullptr;
    auto look = std::make_shared<Material>();
    if (!color.is_none())
        look->color = as_surface_color(color, "color");
    if (!opacity.is_none()) {
        if (!PyNumber_Check(opacity.ptr()) || py::isinstance<py::str>(opacity))
            throw_wrong_type("opacity", "a number", opacity);
        look->opacity = py::float_(opacity);
    }
    if (!name.is_none()) {
        if (!py::isinstance<py::str>(name))
            throw_wrong_type("name", "a str", name);
        look->name = name.cast<std::string>();
    }
    validate(*look);
    return look;
}

} // namespace isospline
