// Shadings and materials as values of Python.
#pragma once

#include "lights.h"
#include "values.h"

#include "isospline/shade/material.h"
#include "isospline/shade/shading.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <tuple>

namespace isospline {

template <>
struct ValueConversion<Phong> : ConversionByFields<Phong> {
    static constexpr char name[] = "Phong";
    static constexpr std::tuple fields{Field{"color", &Phong::color},
                                       Field{"ambient", &Phong::ambient},
                                       Field{"diffuse", &Phong::diffuse},
                                       Field{"specular", &Phong::specular},
                                       Field{"specular_exponent", &Phong::specular_exponent},
                                       Field{"ambient_light", &Phong::ambient_light},
                                       Field{"lights", &Phong::lights},
                                       Field{"two_sided", &Phong::two_sided},
                                       Field{"shadows", &Phong::shadows},
                                       Field{"shadow_samples", &Phong::shadow_samples},
                                       Field{"opacity", &Phong::opacity},
                                       Field{"silhouette_opacity", &Phong::silhouette_opacity},
                                       Field{"silhouette_exponent", &Phong::silhouette_exponent},
                                       Field{"cap_color", &Phong::cap_color}};
};

template <>
struct ValueConversion<Outline> : ConversionByFields<Outline> {
    static constexpr char name[] = "Outline";
    static constexpr std::tuple fields{Field{"exponent", &Outline::exponent},
                                       Field{"color", &Outline::color},
                                       Field{"surface_color", &Outline::surface_color},
                                       Field{"opacity", &Outline::opacity},
                                       Field{"silhouette_opacity", &Outline::silhouette_opacity},
                                       Field{"silhouette_exponent", &Outline::silhouette_exponent},
                                       Field{"cap_color", &Outline::cap_color}};
};

template <>
struct ValueConversion<AmbientOcclusion> : ConversionByFields<AmbientOcclusion> {
    static constexpr char name[] = "AmbientOcclusion";
    static constexpr std::tuple fields{Field{"samples", &AmbientOcclusion::samples},
                                       Field{"distance", &AmbientOcclusion::distance},
                                       Field{"color", &AmbientOcclusion::color},
                                       Field{"opacity", &AmbientOcclusion::opacity},
                                       Field{"silhouette_opacity", &AmbientOcclusion::silhouette_opacity},
                                       Field{"silhouette_exponent", &AmbientOcclusion::silhouette_exponent},
                                       Field{"cap_color", &AmbientOcclusion::cap_color}};
};

template <>
struct ValueConversion<Material> : ConversionByFields<Material> {
    static constexpr char name[] = "Material";
    static constexpr std::tuple fields{Field{"color", &Material::color},
                                       Field{"metallic", &Material::metallic},
                                       Field{"roughness", &Material::roughness},
                                       Field{"specular", &Material::specular},
                                       Field{"cap_color", &Material::cap_color},
                                       Field{"opacity", &Material::opacity},
                                       Field{"silhouette_opacity", &Material::silhouette_opacity},
                                       Field{"silhouette_exponent", &Material::silhouette_exponent},
                                       Field{"name", &Material::name}};
};

/// The material in Python, or None. Pictures ask for those of all objects, so the same one is given each time.
pybind11::object material_in_python(const std::shared_ptr<const Material>& material);

} // namespace isospline
