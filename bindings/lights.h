// Lights as values of Python.
#pragma once

#include "isospline/shade/area_light.h"
#include "isospline/shade/light.h"

#include <pybind11/pybind11.h>

#include <optional>

namespace isospline {

/// The light in an object of Python; nothing if the object is of another class.
template <typename Light>
std::optional<Light> light_in(const pybind11::handle& object);

pybind11::object to_python(const PositionalLight& light);
pybind11::object to_python(const DirectionalLight& light);
pybind11::object to_python(const RectangleLight& light);
pybind11::object to_python(const SphereLight& light);

} // namespace isospline

namespace pybind11::detail {

/// Converts a light to its Python class and back.
template <typename Light>
struct light_caster {
    bool load(handle source, bool)
    {
        value_ = isospline::light_in<Light>(source);
        return value_.has_value();
    }
    static handle cast(const Light& light, return_value_policy, handle)
    {
        return isospline::to_python(light).release();
    }

    template <typename Wanted>
    using cast_op_type = movable_cast_op_type<Wanted>;
    explicit operator Light*() { return &*value_; }
    explicit operator Light&() { return *value_; }
    explicit operator Light&&() && { return std::move(*value_); }

private:
    std::optional<Light> value_;
};

template <>
struct type_caster<isospline::PositionalLight> : light_caster<isospline::PositionalLight> {
    static constexpr auto name = const_name("PositionalLight");
};
template <>
struct type_caster<isospline::DirectionalLight> : light_caster<isospline::DirectionalLight> {
    static constexpr auto name = const_name("DirectionalLight");
};
template <>
struct type_caster<isospline::RectangleLight> : light_caster<isospline::RectangleLight> {
    static constexpr auto name = const_name("RectangleLight");
};
template <>
struct type_caster<isospline::SphereLight> : light_caster<isospline::SphereLight> {
    static constexpr auto name = const_name("SphereLight");
};

} // namespace pybind11::detail
