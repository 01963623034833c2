// Cameras as values of Python.
#pragma once

#include "values.h"

#include "isospline/render/camera.h"

#include <pybind11/pybind11.h>

#include <tuple>

namespace isospline {

/// Coefficients in OpenCV's order, or None for none.
LensDistortion as_distortion(const pybind11::object& value);

void read(const pybind11::object& part, const char* name, FieldOfViewAxis& member);
void read(const pybind11::object& part, const char* name, LensDistortion& member);
pybind11::object written(const FieldOfViewAxis& member);
pybind11::object written(const LensDistortion& member);

template <>
struct ValueConversion<PerspectiveCamera> : ConversionByFields<PerspectiveCamera> {
    static constexpr char name[] = "PerspectiveCamera";
    static constexpr std::tuple fields{Field{"eye", &PerspectiveCamera::eye},
                                       Field{"target", &PerspectiveCamera::target},
                                       Field{"up", &PerspectiveCamera::up},
                                       Field{"field_of_view", &PerspectiveCamera::field_of_view},
                                       Field{"field_of_view_axis", &PerspectiveCamera::field_of_view_axis},
                                       Field{"aperture_radius", &PerspectiveCamera::aperture_radius},
                                       Field{"focus_distance", &PerspectiveCamera::focus_distance}};
};

template <>
struct ValueConversion<ProjectionPlaneCamera> : ConversionByFields<ProjectionPlaneCamera> {
    static constexpr char name[] = "ProjectionPlaneCamera";
    static constexpr std::tuple fields{
        Field{"eye", &ProjectionPlaneCamera::eye}, Field{"right", &ProjectionPlaneCamera::right},
        Field{"down", &ProjectionPlaneCamera::down}, Field{"corner", &ProjectionPlaneCamera::corner},
        Field{"distortion", &ProjectionPlaneCamera::distortion}};
};

template <>
struct ValueConversion<OrthographicCamera> : ConversionByFields<OrthographicCamera> {
    static constexpr char name[] = "OrthographicCamera";
    static constexpr std::tuple fields{
        Field{"eye", &OrthographicCamera::eye}, Field{"target", &OrthographicCamera::target},
        Field{"up", &OrthographicCamera::up}, Field{"height", &OrthographicCamera::height}};
};

template <>
struct ValueConversion<PanoramicCamera> : ConversionByFields<PanoramicCamera> {
    static constexpr char name[] = "PanoramicCamera";
    static constexpr std::tuple fields{Field{"eye", &PanoramicCamera::eye}, Field{"target", &PanoramicCamera::target},
                                       Field{"up", &PanoramicCamera::up}};
};

} // namespace isospline
