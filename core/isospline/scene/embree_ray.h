// Prepared rays for Embree, in single precision.
#pragma once

#include "isospline/scene/embree_api.h"
#include "isospline/trace/prepared_ray.h"

#include <algorithm>
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

/// Sets the rays of an Embree packet.
template <int Size>
void set_rays(const PreparedPacket& prepared, RTCRayHitNt<Size>& packet)
{
    const auto to_single = [](const double* from, float* to) {
        for (int lane = 0; lane < Size; ++lane)
            to[lane] = static_cast<float>(from[lane]);
    };
    to_single(prepared.origin[0], packet.ray.org_x);
    to_single(prepared.origin[1], packet.ray.org_y);
    to_single(prepared.origin[2], packet.ray.org_z);
    for (int lane = 0; lane < Size; ++lane) {
        packet.ray.dir_x[lane] = direction_single(prepared.direction[0][lane]);
        packet.ray.dir_y[lane] = direction_single(prepared.direction[1][lane]);
        packet.ray.dir_z[lane] = direction_single(prepared.direction[2][lane]);
        packet.ray.tnear[lane] = rounded_down(prepared.t_near[lane]);
        packet.ray.tfar[lane] = rounded_up(prepared.t_far[lane]);
        packet.ray.time[lane] = 0.0f;
        packet.ray.mask[lane] = 0xffffffffu;
        packet.ray.id[lane] = static_cast<unsigned int>(lane);
        packet.ray.flags[lane] = 0;
        packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
        packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
}

} // namespace isospline
