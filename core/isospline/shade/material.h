// The look of a surface: its colour, its opacity, and how it scatters light, as a diffuse base below a rough dielectric
// coat or as a rough conductor.
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/surface_point.h"
#include "isospline/util/value_class.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>
#include <string>
#include <tuple>

namespace isospline {

/// f = (1 - metallic) color / pi (1 - Fd(i)) (1 - Fd(o)) + F(h) D(h) G(i, o) / (4 <n,i> <n,o>)
///
/// with the half vector h, Trowbridge and Reitz's distribution D of width roughness^2 (GGX), Smith's height-correlated
/// masking G, and Schlick's Fresnel term F(c) = F0 + (F90 - F0)(1 - c)^5. A dielectric has F0 = 0.08 specular, 0.04 by
/// default, and F90 = min(50 F0, 1): 1 for real materials, from water's F0 = 0.02 on (S. Lagarde, C. de Rousiers,
/// "Moving Frostbite to physically based rendering", SIGGRAPH 2014 course). A metal has F0 = color and F90 = 1;
/// both are interpolated between. Fd is F of the dielectric, at the cosine of its direction. The material is
/// energy-conserving and reciprocal: f(i, o) = f(o, i).
///
/// With specular = 0 and metallic = 0 it is Lambert's law, exactly.
///
/// Path tracers use all but the opacities: to them, surfaces are opaque. Shadings without colour and opacities of their
/// own take them from here.
struct Material {
    /// At most 1; larger values from a rule, or from a mesh's vertices, are clipped. Nothing leaves the choice to the
    /// light: path tracers use default_color.
    std::optional<Color> color = {};
    double metallic = 0.0;                      ///< 0 to 1
    double roughness = 0.5;                     ///< 0 to 1; values below 0.03 count as 0.03
    double specular = 0.5;                      ///< 0 to 1
    CapColor cap_color = {};                    ///< of capped cuts, instead of color
    double opacity = 1.0;                       ///< 0 to 1
    std::optional<double> silhouette_opacity{}; ///< the opacity at the silhouette; nothing: the same
    double silhouette_exponent = 3.0;           ///< the larger, the thinner the silhouette
    std::string name = {};                      ///< for legends
};

template <>
struct ValueClass<Material> {
    static constexpr char name[] = "Material";
    static constexpr std::tuple parameters{Parameter{"color", &Material::color},
                                           Parameter{"metallic", &Material::metallic},
                                           Parameter{"roughness", &Material::roughness},
                                           Parameter{"specular", &Material::specular},
                                           Parameter{"cap_color", &Material::cap_color},
                                           Parameter{"opacity", &Material::opacity},
                                           Parameter{"silhouette_opacity", &Material::silhouette_opacity},
                                           Parameter{"silhouette_exponent", &Material::silhouette_exponent},
                                           Parameter{"name", &Material::name}};
};

/// The colour of a material that has none.
inline const Color default_color = glm::dvec3(0.8);

/// The colour of a material in path tracing.
inline const Color& color_of(const Material& material)
{
    return material.color ? *material.color : default_color;
}

/// Throws std::invalid_argument for numbers outside of these ranges, and like the validation of the colour's rule.
void validate(const Material& material);

/// Whether the colour of a point follows from its curvature.
bool needs_curvature(const Material& material);

/// Sets the limits of colours by depth that fit the scene.
void fit_depth_limits(Material& material, const DepthRange& depths);

/// The colour at a point, times that of a mesh's vertices.
glm::dvec3 albedo(const Material& material, const SurfacePoint& point);

struct ScatterSample {
    glm::dvec3 direction{0.0}; ///< unit
    glm::dvec3 weight{0.0};    ///< f times cosine over density
    double density = 0.0;      ///< by solid angle
};

/// A material at a point. Directions are unit, in a frame whose z is the normal, and lead away from the surface.
class Scattering {
public:
    /// A constant colour needs no point.
    explicit Scattering(const Material& material, const SurfacePoint& point = {});

    /// f; zero if either direction is below the surface.
    glm::dvec3 evaluate(const glm::dvec3& to_viewer, const glm::dvec3& to_light) const;
    /// The density of sample(), by solid angle.
    double density(const glm::dvec3& to_viewer, const glm::dvec3& to_light) const;
    /// Draws the direction of light from three numbers in [0, 1): `choice` decides between diffuse and specular.
    /// Visible normals follow E. Heitz, "Sampling the GGX distribution of visible normals", Journal of Computer
    /// Graphics Techniques 7(4), 2018. Nothing if the direction is below the surface.
    std::optional<ScatterSample> sample(const glm::dvec3& to_viewer, double choice, const glm::dvec2& u) const;

private:
    Scattering(const Material& material, const glm::dvec3& color);

    glm::dvec3 fresnel(double cosine) const;
    /// The fraction of the light that the coat reflects, which does not reach the diffuse base.
    double coat(double cosine) const;
    double specular_share(double cosine) const;

    glm::dvec3 diffuse_, f0_;
    double alpha_, coat_f0_, coat_f90_, f90_;
};

} // namespace isospline
