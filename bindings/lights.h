// Lights as values of Python.
#pragma once

#include "values.h"

#include "isospline/shade/area_light.h"
#include "isospline/shade/light.h"

#include <pybind11/pybind11.h>

namespace isospline {

template <>
struct ValueConversion<PositionalLight> {
    static constexpr char name[] = "PositionalLight";
    static PositionalLight from_python(pybind11::handle light);
    static pybind11::object to_python(const PositionalLight& light);
};

template <>
struct ValueConversion<DirectionalLight> {
    static constexpr char name[] = "DirectionalLight";
    static DirectionalLight from_python(pybind11::handle light);
    static pybind11::object to_python(const DirectionalLight& light);
};

template <>
struct ValueConversion<RectangleLight> {
    static constexpr char name[] = "RectangleLight";
    static RectangleLight from_python(pybind11::handle light);
    static pybind11::object to_python(const RectangleLight& light);
};

template <>
struct ValueConversion<SphereLight> {
    static constexpr char name[] = "SphereLight";
    static SphereLight from_python(pybind11::handle light);
    static pybind11::object to_python(const SphereLight& light);
};

} // namespace isospline

namespace pybind11::detail {

template <>
class type_caster<isospline::PositionalLight> : public isospline::ValueCaster<isospline::PositionalLight> {
};
template <>
class type_caster<isospline::DirectionalLight> : public isospline::ValueCaster<isospline::DirectionalLight> {
};
template <>
class type_caster<isospline::RectangleLight> : public isospline::ValueCaster<isospline::RectangleLight> {
};
template <>
class type_caster<isospline::SphereLight> : public isospline::ValueCaster<isospline::SphereLight> {
};

} // namespace pybind11::detail
