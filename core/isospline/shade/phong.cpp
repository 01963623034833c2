#include "isospline/shade/phong.h"

#include "isospline/shade/opacity.h"
#include "isospline/util/check.h"

#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/shade/phong.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/shade/phong-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

void shade_in_lanes(const Phong& phong, const PhongPoints& points, PhongColors& colors)
{
    const hn::CappedTag<double, PhongPoints::capacity> d;
    using V = hn::Vec<decltype(d)>;
    const auto none_hidden = [d](std::size_t) HWY_ATTR { return hn::Set(d, 1.0); };
    for (std::size_t first = 0; first < points.count; first += hn::Lanes(d)) {
        const auto load = [&](const auto& axes) HWY_ATTR {
            return Vector3<V>{hn::Load(d, axes[0] + first), hn::Load(d, axes[1] + first), hn::Load(d, axes[2] + first)};
        };
        Vector3<V> to_viewer = load(points.direction);
        const V scale = number<V>(-1.0) / square_root(dot(to_viewer, to_viewer));
        for (V& coordinate : to_viewer)
            coordinate = coordinate * scale;
        const auto color = phong_color(phong, load(points.position), load(points.normal), to_viewer,
                                       load(points.surface_color), none_hidden);
        for (std::size_t part = 0; part < 3; ++part)
            hn::Store(color[part], d, colors.part[part] + first);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(shade_in_lanes);

void validate(const Phong& phong)
{
    validate("color", phong.color);
    check_not_negative("ambient", phong.ambient);
    check_not_negative("diffuse", phong.diffuse);
    check_not_negative("specular", phong.specular);
    check_not_negative("specular_exponent", phong.specular_exponent);
    check_not_negative("ambient_light", phong.ambient_light);
    validate_opacity(phong);
    if (phong.cap_color)
        validate("cap_color", *phong.cap_color);
    if (phong.lights)
        for (const Light& light : *phong.lights)
            validate(light);
}

glm::dvec3 albedo(const Phong& phong, const SurfacePoint& point)
{
    return color_at(phong.color, phong.cap_color, point) * point.vertex_color;
}

glm::dvec3 shade(const Phong& phong, const SurfacePoint& point)
{
    const auto vector = [](const glm::dvec3& v) { return scalar::Vector3<double>{v.x, v.y, v.z}; };
    const auto lit = [&](std::size_t k) { return point.lit.empty() ? 1.0 : point.lit[k]; };
    const auto [red, green, blue] = scalar::phong_color(phong, vector(point.position), vector(point.normal),
                                                        vector(point.to_viewer), vector(albedo(phong, point)), lit);
    return {red, green, blue};
}

void shade(const Phong& phong, const PhongPoints& points, PhongColors& colors)
{
    HWY_DYNAMIC_DISPATCH(shade_in_lanes)(phong, points, colors);
}

} // namespace isospline
#endif
