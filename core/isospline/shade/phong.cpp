#include "isospline/shade/phong.h"

#include "isospline/shade/light.h"
#include "isospline/shade/opacity.h"
#include "isospline/util/check.h"

#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/shade/phong.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/math/power-inl.h"
#include "isospline/math/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The unit vector from a point to a light; zero for a light at the point itself, which gives no light.
template <class N>
HWY_INLINE Vector3<N> to_light(const PositionalLight& light, const Vector3<N>& position)
{
    Vector3<N> offset = constant_vector<N>(light.position);
    for (std::size_t axis = 0; axis < 3; ++axis)
        offset[axis] = offset[axis] - position[axis];
    const N distance = square_root(dot(offset, offset));
    const auto is_apart = less(number<N>(0.0), distance);
    for (N& coordinate : offset)
        coordinate = select(is_apart, coordinate / distance, number<N>(0.0));
    return offset;
}

template <class N>
HWY_INLINE Vector3<N> to_light(const DirectionalLight& light, const Vector3<N>&)
{
    return constant_vector<N>(light.to_light);
}

/// N, or -N if that faces the viewer and surfaces have two sides.
template <class N>
HWY_INLINE Vector3<N> shaded_side(const Phong& phong, const Vector3<N>& normal, const Vector3<N>& to_viewer)
{
    if (!phong.two_sided)
        return normal;
    Vector3<N> n = normal;
    const auto away = less(dot(normal, to_viewer), number<N>(0.0));
    for (N& coordinate : n)
        coordinate = select(away, negated(coordinate), coordinate);
    return n;
}

/// <N, L> and <V, R> with R = 2 N <N, L> - L.
template <class N>
struct Products {
    Products(const Vector3<N>& n, const Vector3<N>& l, const Vector3<N>& v)
        : n_l(dot(n, l)), v_r(number<N>(2.0) * n_l * dot(n, v) - dot(l, v))
    {
    }

    N n_l, v_r;
};

/// The diffuse and the specular part of a light that a white surface reflects; `n` is on the shaded side.
template <class N, class AnyLight>
HWY_INLINE std::pair<N, N> reflected_parts(const Phong& phong, const AnyLight& light, const Vector3<N>& position,
                                           const Vector3<N>& n, const Vector3<N>& to_viewer)
{
    const N zero = number<N>(0.0);
    const auto [n_l, v_r] = Products<N>(n, to_light(light, position), to_viewer);
    // A product of zero stays dark even with an exponent of zero, where 0^0 would be 1.
    const auto shines = less(zero, v_r);
    const N highlight = power(select(shines, v_r, zero), phong.specular_exponent);
    return {number<N>(phong.diffuse) * select(less(zero, n_l), n_l, zero),
            number<N>(phong.specular) * select(shines, highlight, zero)};
}

/// Phong's formula: the colour of points whose normals and directions to the viewer are unit; `lit(k)` is the part of
/// light k that reaches them.
template <class N, class Lit>
HWY_INLINE Vector3<N> phong_color(const Phong& phong, const Vector3<N>& position, const Vector3<N>& normal,
                                  const Vector3<N>& to_viewer, const Vector3<N>& surface_color, const Lit& lit)
{
    const Vector3<N> n = shaded_side(phong, normal, to_viewer);

    Vector3<N> color = constant_vector<N>(phong.ambient * phong.ambient_light);
    for (std::size_t part = 0; part < 3; ++part)
        color[part] = color[part] * surface_color[part];
    if (!phong.lights)
        return color;
    for (std::size_t k = 0; k < phong.lights->size(); ++k) {
        const auto add = [&](const auto& light) HWY_ATTR {
            const auto [diffuse, specular] = reflected_parts<N>(phong, light, position, n, to_viewer);
            for (std::size_t part = 0; part < 3; ++part)
                color[part] = color[part] + number<N>(light.intensity[static_cast<int>(part)]) * lit(k) *
                                                (diffuse * surface_color[part] + specular);
        };
        std::visit(add, (*phong.lights)[k]);
    }
    return color;
}

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

namespace {

scalar::Vector3<double> in_lanes(const glm::dvec3& vector)
{
    return {vector.x, vector.y, vector.z};
}

} // namespace

void validate(const Phong& phong)
{
    validate("color", phong.color);
    check_not_negative("ambient", phong.ambient);
    check_not_negative("diffuse", phong.diffuse);
    check_not_negative("specular", phong.specular);
    check_not_negative("specular_exponent", phong.specular_exponent);
    if (phong.shadow_samples < 1 || phong.shadow_samples > 65536)
        throw_invalid("shadow_samples", "rays a hit, from 1 to 65536", phong.shadow_samples);
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
    const auto lit = [&](std::size_t k) { return point.lit.empty() ? 1.0 : point.lit[k]; };
    const auto [red, green, blue] = scalar::phong_color(phong, in_lanes(point.position), in_lanes(point.normal),
                                                        in_lanes(point.to_viewer), in_lanes(albedo(phong, point)), lit);
    return {red, green, blue};
}

int shadow_ray_count(const Phong& phong, const Light& light)
{
    const auto* const directional = std::get_if<DirectionalLight>(&light);
    return directional != nullptr && directional->angle > 0.0 ? phong.shadow_samples : 1;
}

bool receives(const Phong& phong, const Light& light, const glm::dvec3& position, const glm::dvec3& normal,
              const glm::dvec3& to_viewer)
{
    const scalar::Vector3<double> v = in_lanes(to_viewer);
    const scalar::Vector3<double> n = scalar::shaded_side(phong, in_lanes(normal), v);
    const auto adds = [&](const auto& source) {
        const scalar::Products<double> products(n, scalar::to_light(source, in_lanes(position)), v);
        return (phong.diffuse > 0.0 && products.n_l > 0.0) || (phong.specular > 0.0 && products.v_r > 0.0);
    };
    return std::visit(adds, light);
}

double reflected(const Phong& phong, const Light& light, const glm::dvec3& position, const glm::dvec3& normal,
                 const glm::dvec3& to_viewer)
{
    const scalar::Vector3<double> v = in_lanes(to_viewer);
    const scalar::Vector3<double> n = scalar::shaded_side(phong, in_lanes(normal), v);
    const auto of_source = [&](const auto& source) {
        const auto [diffuse, specular] = scalar::reflected_parts<double>(phong, source, in_lanes(position), n, v);
        return diffuse + specular;
    };
    return std::visit(of_source, light);
}

void shade(const Phong& phong, const PhongPoints& points, PhongColors& colors)
{
    HWY_DYNAMIC_DISPATCH(shade_in_lanes)(phong, points, colors);
}

} // namespace isospline
#endif
