// Phong's formula, for one point or for one point per SIMD lane. Included once for each SIMD target.
#include "isospline/math/power-inl.h"
#include "isospline/shade/light-inl.h"
#include "isospline/shade/phong.h"

#include <cstddef>

#if defined(ISOSPLINE_SHADE_PHONG_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_SHADE_PHONG_INL_H
#undef ISOSPLINE_SHADE_PHONG_INL_H
#else
#define ISOSPLINE_SHADE_PHONG_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The colour of points whose normals and directions to the viewer are unit; `lit(k)` is the part of light k that
/// reaches them.
template <class N, class Lit>
HWY_INLINE Vector3<N> phong_color(const Phong& phong, const Vector3<N>& position, const Vector3<N>& normal,
                                  const Vector3<N>& to_viewer, const Vector3<N>& surface_color, const Lit& lit)
{
    const N zero = number<N>(0.0);
    const Vector3<N>& v = to_viewer;
    Vector3<N> n = normal;
    if (phong.two_sided) {
        const auto away = less(dot(normal, v), zero);
        for (N& coordinate : n)
            coordinate = select(away, negated(coordinate), coordinate);
    }
    const N n_v = dot(n, v);

    Vector3<N> color = constant_vector<N>(phong.ambient * phong.ambient_light);
    for (std::size_t part = 0; part < 3; ++part)
        color[part] = color[part] * surface_color[part];
    if (!phong.lights)
        return color;
    for (std::size_t k = 0; k < phong.lights->size(); ++k) {
        const auto add = [&](const auto& light) HWY_ATTR {
            const Vector3<N> l = to_light(light, position);
            const N n_l = dot(n, l);
            const N v_r = number<N>(2.0) * n_l * n_v - dot(l, v); // of R = 2 <N, L> N - L
            const N diffuse = lit(k) * number<N>(phong.diffuse) * select(less(zero, n_l), n_l, zero);
            // A product of zero stays dark even with an exponent of zero, where 0^0 would be 1.
            const auto shines = less(zero, v_r);
            const N highlight = power(select(shines, v_r, zero), phong.specular_exponent);
            const N specular = lit(k) * number<N>(phong.specular) * select(shines, highlight, zero);
            for (std::size_t part = 0; part < 3; ++part)
                color[part] = color[part] + number<N>(light.intensity[static_cast<int>(part)]) *
                                                (diffuse * surface_color[part] + specular);
        };
        std::visit(add, (*phong.lights)[k]);
    }
    return color;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
