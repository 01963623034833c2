#include "isospline/shade/material.h"

#include "isospline/math/frame.h"
#include "isospline/shade/opacity.h"
#include "isospline/util/check.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <variant>

namespace isospline {

namespace {

void check_part(const char* parameter, double value)
{
    if (!(value >= 0.0 && value <= 1.0))
        throw_invalid(parameter, "a number from 0 to 1", value);
}

void check_color(const char* parameter, const Color& color)
{
    validate(parameter, color);
    if (const auto* constant = std::get_if<glm::dvec3>(&color))
        if (glm::any(glm::greaterThan(*constant, glm::dvec3(1.0))))
            throw_invalid(parameter, "numbers from 0 to 1", to_text(*constant));
}

double luminance(const glm::dvec3& color)
{
    return glm::dot(color, glm::dvec3(0.2126, 0.7152, 0.0722));
}

double schlick(double cosine)
{
    const double c = 1.0 - std::min(cosine, 1.0);
    return c * c * c * c * c;
}

/// GGX: density of half vectors.
double distribution(const glm::dvec3& h, double alpha)
{
    // (x^2 + y^2) / alpha^2 + z^2, times alpha^2; without cancellation about the peak.
    const double denominator = h.x * h.x + h.y * h.y + alpha * alpha * h.z * h.z;
    return alpha * alpha / (pi * denominator * denominator);
}

/// Smith's Lambda.
double masking(const glm::dvec3& w, double alpha)
{
    const double tangent_squared = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return 0.5 * (std::sqrt(1.0 + alpha * alpha * tangent_squared) - 1.0);
}

} // namespace

void validate(const Material& material)
{
    if (material.color)
        check_color("color", *material.color);
    if (material.cap_color)
        check_color("cap_color", *material.cap_color);
    check_part("metallic", material.metallic);
    check_part("roughness", material.roughness);
    check_part("specular", material.specular);
    validate_opacity(material);
}

bool needs_curvature(const Material& material)
{
    return needs_curvature(color_of(material)) || (material.cap_color && needs_curvature(*material.cap_color));
}

void fit_depth_limits(Material& material, const DepthRange& depths)
{
    if (material.color)
        fit_depth_limits(*material.color, depths);
    if (material.cap_color)
        fit_depth_limits(*material.cap_color, depths);
}

glm::dvec3 albedo(const Material& material, const SurfacePoint& point)
{
    return glm::min(color_at(color_of(material), material.cap_color, point) * point.vertex_color, 1.0);
}

Scattering::Scattering(const Material& material, const SurfacePoint& point)
    : Scattering(material, albedo(material, point))
{
}

Scattering::Scattering(const Material& material, const glm::dvec3& color)
    : diffuse_((1.0 - material.metallic) * color),
      f0_(glm::mix(glm::dvec3(0.08 * material.specular), color, material.metallic)),
      alpha_(std::pow(std::max(material.roughness, 0.03), 2.0)), coat_f0_(0.08 * material.specular),
      coat_f90_(std::min(50.0 * coat_f0_, 1.0)), f90_(glm::mix(coat_f90_, 1.0, material.metallic))
{
}

glm::dvec3 Scattering::fresnel(double cosine) const
{
    return glm::mix(f0_, glm::dvec3(f90_), schlick(cosine));
}

double Scattering::coat(double cosine) const
{
    return glm::mix(coat_f0_, coat_f90_, schlick(cosine));
}

double Scattering::specular_share(double cosine) const
{
    const double specular = luminance(fresnel(cosine)), diffuse = luminance(diffuse_) * (1.0 - coat(cosine));
    return specular > 0.0 ? specular / (specular + diffuse) : 0.0;
}

glm::dvec3 Scattering::evaluate(const glm::dvec3& to_viewer, const glm::dvec3& to_light) const
{
    const glm::dvec3 &o = to_viewer, &i = to_light;
    if (!(o.z > 0.0 && i.z > 0.0))
        return glm::dvec3(0.0);
    const glm::dvec3 h = glm::normalize(o + i);
    const double masked = 1.0 / (1.0 + masking(o, alpha_) + masking(i, alpha_));
    return diffuse_ / pi * (1.0 - coat(o.z)) * (1.0 - coat(i.z)) +
           fresnel(glm::dot(h, o)) * (distribution(h, alpha_) * masked / (4.0 * o.z * i.z));
}

double Scattering::density(const glm::dvec3& to_viewer, const glm::dvec3& to_light) const
{
    const glm::dvec3 &o = to_viewer, &i = to_light;
    if (!(o.z > 0.0 && i.z > 0.0))
        return 0.0;
    const double share = specular_share(o.z);
    const double of_visible = distribution(glm::normalize(o + i), alpha_) / (1.0 + masking(o, alpha_));
    return (1.0 - share) * i.z / pi + share * of_visible / (4.0 * o.z);
}

std::optional<ScatterSample> Scattering::sample(const glm::dvec3& to_viewer, double choice, const glm::dvec2& u) const
{
    const glm::dvec3& o = to_viewer;
    if (!(o.z > 0.0))
        return std::nullopt;
    glm::dvec3 i = cosine_direction(u);
    if (choice < specular_share(o.z)) {
        // Stretch to a hemisphere, draw on its projection, and back.
        const glm::dvec3 v = glm::normalize(glm::dvec3(alpha_ * o.x, alpha_ * o.y, o.z));
        const glm::dvec2 on_disc = to_disc(u);
        const double x = on_disc.x;
        const glm::dvec3 across =
            v.x != 0.0 || v.y != 0.0 ? glm::normalize(glm::dvec3(-v.y, v.x, 0.0)) : glm::dvec3(1.0, 0.0, 0.0);
        const glm::dvec3 along = glm::cross(v, across);
        const double s = 0.5 * (1.0 + v.z);
        const double y = (1.0 - s) * std::sqrt(std::max(1.0 - x * x, 0.0)) + s * on_disc.y;
        const glm::dvec3 n = x * across + y * along + std::sqrt(std::max(1.0 - x * x - y * y, 0.0)) * v;
        const glm::dvec3 h = glm::normalize(glm::dvec3(alpha_ * n.x, alpha_ * n.y, std::max(n.z, 1e-12)));
        i = glm::normalize(2.0 * glm::dot(o, h) * h - o);
    }
    const double drawn_with = density(o, i);
    if (!(i.z > 0.0 && drawn_with > 0.0))
        return std::nullopt;
    return ScatterSample{i, evaluate(o, i) * (i.z / drawn_with), drawn_with};
}

} // namespace isospline
