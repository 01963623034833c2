// Lights as values of Python.
#pragma once

#include "values.h"

#include "isospline/shade/area_light.h"
#include "isospline/shade/light.h"

#include <pybind11/pybind11.h>

#include <tuple>

namespace isospline {

template <>
struct ValueConversion<PositionalLight> : ConversionByFields<PositionalLight> {
    static constexpr char name[] = "PositionalLight";
    static constexpr std::tuple fields{Field{"position", &PositionalLight::position},
                                       Field{"intensity", &PositionalLight::intensity}};
};

template <>
struct ValueConversion<DirectionalLight> : ConversionByFields<DirectionalLight> {
    static constexpr char name[] = "DirectionalLight";
    static constexpr std::tuple fields{Field{"direction", &DirectionalLight::direction},
                                       Field{"intensity", &DirectionalLight::intensity},
                                       Field{"angle", &DirectionalLight::angle}};
    static DirectionalLight from_python(pybind11::handle value)
    {
        const auto light = ConversionByFields::from_python(value);
        return DirectionalLight(light.direction, light.intensity, light.angle);
    }
};

template <>
struct ValueConversion<RectangleLight> : ConversionByFields<RectangleLight> {
    static constexpr char name[] = "RectangleLight";
    static constexpr std::tuple fields{
        Field{"corner", &RectangleLight::corner}, Field{"edge_u", &RectangleLight::edge_u},
        Field{"edge_v", &RectangleLight::edge_v}, Field{"radiance", &RectangleLight::radiance}};
};

template <>
struct ValueConversion<SphereLight> : ConversionByFields<SphereLight> {
    static constexpr char name[] = "SphereLight";
    static constexpr std::tuple fields{Field{"center", &SphereLight::center}, Field{"radius", &SphereLight::radius},
                                       Field{"radiance", &SphereLight::radiance}};
};

} // namespace isospline
