#include "isospline/trace/surface_hit.h"

#include "isospline/math/affine.h"

#include <glm/geometric.hpp>

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/surface_hit.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The operations of set_surface_normal(), Ray::at() and GLM's products, in their order.
void packet_hits(SurfaceHitPacket& hits, const RayPacket& rays, const double* HWY_RESTRICT t, const RootPacket& roots,
                 double outward, const glm::dmat4& world_to_lattice)
{
    const hn::CappedTag<double, LatticeRayPacket::capacity> d;
    using V = hn::Vec<decltype(d)>;
    const auto sum_of_products = [](V ax, V bx, V ay, V by, V az, V bz) HWY_ATTR {
        return hn::Add(hn::Add(hn::Mul(ax, bx), hn::Mul(ay, by)), hn::Mul(az, bz));
    };
    for (std::size_t first = 0; first < LatticeRayPacket::capacity; first += hn::Lanes(d)) {
        V from[3], gradient[3];
        for (int axis = 0; axis < 3; ++axis)
            from[axis] = hn::Load(d, roots.gradient[axis] + first);
        for (int axis = 0; axis < 3; ++axis) {
            const glm::dvec4& column = world_to_lattice[axis];
            gradient[axis] = sum_of_products(hn::Set(d, column.x), from[0], hn::Set(d, column.y), from[1],
                                             hn::Set(d, column.z), from[2]);
        }
        const V magnitude =
            hn::Sqrt(sum_of_products(gradient[0], gradient[0], gradient[1], gradient[1], gradient[2], gradient[2]));
        const V scale = hn::Div(hn::Set(d, outward), magnitude);
        const auto has_direction = hn::Gt(magnitude, hn::Zero(d));
        const V of_hit = hn::Load(d, t + first);
        for (int axis = 0; axis < 3; ++axis) {
            hn::Store(hn::IfThenElseZero(has_direction, hn::Mul(scale, gradient[axis])), d, hits.normal[axis] + first);
            const V way = hn::Mul(of_hit, hn::Load(d, rays.direction[axis] + first));
            hn::Store(hn::Add(hn::Load(d, rays.origin[axis] + first), way), d, hits.position[axis] + first);
        }
        hn::Store(magnitude, d, hits.gradient_magnitude + first);
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
    // Lattice coordinates are a function of world coordinates: the chain rule is the transpose of that map.
    const glm::dvec3 gradient = transform_gradient(world_to_lattice, gradient_lattice);
    const double magnitude = glm::length(gradient);
    hit.gradient_magnitude = magnitude;
    hit.normal = magnitude > 0.0 ? (outward(inside) / magnitude) * gradient : glm::dvec3(0.0);
}

void set_surface_hits(SurfaceHitPacket& hits, const RayPacket& rays, const double* t, const RootPacket& roots,
                      Inside inside, const glm::dmat4& world_to_lattice)
{
    HWY_DYNAMIC_DISPATCH(packet_hits)(hits, rays, t, roots, outward(inside), world_to_lattice);
}

} // namespace isospline
#endif
