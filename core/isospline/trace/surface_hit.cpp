#include "isospline/trace/surface_hit.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/surface_hit.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/math/vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class N>
struct SurfaceNormal {
    Vector3<N> unit;
    N gradient_magnitude;
};

// Lattice coordinates are a function of world coordinates: the chain rule is the transpose of that map.
template <class N>
HWY_INLINE SurfaceNormal<N> surface_normal(const Vector3<N>& gradient_lattice, double outward,
                                           const glm::dmat4& world_to_lattice)
{
    const Vector3<N> gradient = transformed_gradient(world_to_lattice, gradient_lattice);
    const N magnitude = square_root(dot(gradient, gradient)), zero = number<N>(0.0);
    const N scale = number<N>(outward) / magnitude;
    const auto has_direction = less(zero, magnitude);
    const auto unit = [&](std::size_t axis) HWY_ATTR { return select(has_direction, scale * gradient[axis], zero); };
    return {{unit(0), unit(1), unit(2)}, magnitude};
}

void packet_hits(SurfaceHitPacket& hits, const RayPacket& rays, const double* HWY_RESTRICT t, const RootPacket& roots,
                 double outward, const glm::dmat4& world_to_lattice)
{
    const hn::CappedTag<double, LatticeRayPacket::capacity> d;
    using V = hn::Vec<decltype(d)>;
    for (std::size_t first = 0; first < static_cast<std::size_t>(rays.count); first += hn::Lanes(d)) {
        const Vector3<V> gradient = {hn::Load(d, roots.gradient[0] + first), hn::Load(d, roots.gradient[1] + first),
                                     hn::Load(d, roots.gradient[2] + first)};
        const auto normal = surface_normal(gradient, outward, world_to_lattice);
        const V of_hit = hn::Load(d, t + first);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            hn::Store(normal.unit[axis], d, hits.normal[axis] + first);
            // Like Ray::at().
            const V way = hn::Mul(of_hit, hn::Load(d, rays.direction[axis] + first));
            hn::Store(hn::Add(hn::Load(d, rays.origin[axis] + first), way), d, hits.position[axis] + first);
        }
        hn::Store(normal.gradient_magnitude, d, hits.gradient_magnitude + first);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(packet_hits);

namespace {

double outward(Inside inside)
{
    return inside == Inside::above ? -1.0 : 1.0;
}

} // namespace

void set_surface_normal(Hit& hit, const glm::dvec3& gradient_lattice, Inside inside, const glm::dmat4& world_to_lattice)
{
    const auto normal =
        scalar::surface_normal(scalar::constant_vector<double>(gradient_lattice), outward(inside), world_to_lattice);
    hit.normal = {normal.unit[0], normal.unit[1], normal.unit[2]};
    hit.gradient_magnitude = normal.gradient_magnitude;
}

void set_surface_hits(SurfaceHitPacket& hits, const RayPacket& rays, const double* t, const RootPacket& roots,
                      Inside inside, const glm::dmat4& world_to_lattice)
{
    HWY_DYNAMIC_DISPATCH(packet_hits)(hits, rays, t, roots, outward(inside), world_to_lattice);
}

} // namespace isospline
#endif
