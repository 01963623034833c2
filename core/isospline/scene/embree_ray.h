// Prepared rays and boxes for Embree, in single precision.
#pragma once

#include "isospline/math/box.h"
#include "isospline/scene/embree_api.h"
#include "isospline/trace/prepared_ray.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace isospline {

/// The next larger number in single precision, for t >= 0, so that the hit itself stays within the ray. The result is a
/// normal number, because subnormal ones may be treated as zero.
inline float rounded_up(double t)
{
    const float next = std::bit_cast<float>(std::bit_cast<std::uint32_t>(static_cast<float>(t) + 0.0f) + 1u);
    return std::max(next, std::numeric_limits<float>::min());
}

/// The next smaller number in single precision, but at least zero.
inline float rounded_down(double t)
{
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(t) + 0.0f);
    return std::bit_cast<float>(bits - (bits != 0u));
}

/// The next smaller number in single precision.
inline float next_below(double value)
{
    return std::nextafter(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}

/// Sets Embree's bounds around a box; `Bounds` is RTCBounds or RTCBuildPrimitive.
template <typename Bounds>
void set_bounds(const Box& box, Bounds& bounds)
{
    bounds.lower_x = next_below(box.lower.x);
    bounds.lower_y = next_below(box.lower.y);
    bounds.lower_z = next_below(box.lower.z);
    bounds.upper_x = -next_below(-box.upper.x);
    bounds.upper_y = -next_below(-box.upper.y);
    bounds.upper_z = -next_below(-box.upper.z);
}

/// A component of a unit direction. Embree replaces smaller components by +1e-18, even negative ones. Packets whose
/// rays then seem to go the opposite way would miss objects.
inline float direction_single(double component)
{
    const auto single = static_cast<float>(component);
    return std::abs(single) < 1e-17f ? 0.0f : single;
}

/// Sets Embree's ray.
inline void set_ray(const Ray& from, RTCRay& to)
{
    to.org_x = static_cast<float>(from.origin.x);
    to.org_y = static_cast<float>(from.origin.y);
    to.org_z = static_cast<float>(from.origin.z);
    to.tnear = rounded_down(from.t_near);
    to.dir_x = direction_single(from.direction.x);
    to.dir_y = direction_single(from.direction.y);
    to.dir_z = direction_single(from.direction.z);
    to.time = 0.0f;
    to.tfar = rounded_up(from.t_far);
    to.mask = 0xffffffffu;
    to.id = 0;
    to.flags = 0;
}

/// Sets Embree's ray, which has not hit anything yet.
inline void set_ray(const Ray& from, RTCRayHit& to)
{
    set_ray(from, to.ray);
    to.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    to.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

/// Bit i for lane i, for loops that compilers vectorise.
inline constexpr auto lane_bits = [] {
    std::array<LaneMask, packet_capacity> bits{};
    for (std::size_t lane = 0; lane < bits.size(); ++lane)
        bits[lane] = LaneMask{1} << lane;
    return bits;
}();

/// The lanes that Embree passes to a callback.
inline LaneMask active_lanes(const int* valid, unsigned int count)
{
    LaneMask active = 0;
    for (unsigned int lane = 0; lane < count; ++lane)
        active |= static_cast<LaneMask>(valid[lane]) & lane_bits[lane];
    return active;
}

/// Sets the rays of an Embree packet; `Rays` is a PreparedPacket or a LatticeRayPacket.
template <int Size, typename Rays>
void set_rays(const Rays& from_rays, RTCRayNt<Size>& packet)
{
    const auto to_single = [](const double* from, float* to) {
        for (int lane = 0; lane < Size; ++lane)
            to[lane] = static_cast<float>(from[lane]);
    };
    to_single(from_rays.origin[0], packet.org_x);
    to_single(from_rays.origin[1], packet.org_y);
    to_single(from_rays.origin[2], packet.org_z);
    for (int lane = 0; lane < Size; ++lane) {
        packet.dir_x[lane] = direction_single(from_rays.direction[0][lane]);
        packet.dir_y[lane] = direction_single(from_rays.direction[1][lane]);
        packet.dir_z[lane] = direction_single(from_rays.direction[2][lane]);
        packet.tnear[lane] = rounded_down(from_rays.t_near[lane]);
        packet.tfar[lane] = rounded_up(from_rays.t_far[lane]);
        packet.time[lane] = 0.0f;
        packet.mask[lane] = 0xffffffffu;
        packet.id[lane] = static_cast<unsigned int>(lane);
        packet.flags[lane] = 0;
    }
}

/// Sets the rays of an Embree packet, which have not hit anything yet.
template <int Size, typename Rays>
void set_rays(const Rays& from_rays, RTCRayHitNt<Size>& packet)
{
    set_rays<Size>(from_rays, packet.ray);
    for (int lane = 0; lane < Size; ++lane) {
        packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
        packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
}

} // namespace isospline
