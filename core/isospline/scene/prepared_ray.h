// Rays made ready for single precision: relative to the scene's centre, of unit direction, begun where they enter the
// scene's box; so that rounding depends on the size of the scene and not on the distance of the eye.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/scene/embree_api.h"
#include "isospline/trace/lattice_ray_packet.h"

#include <glm/mat4x4.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace isospline {

struct PreparedRay {
    /// The t of the original ray, given that of this one.
    double original_t(double t) const { return shift + t / length; }

    Ray ray;
    double shift;  ///< the t of the original ray where this one begins
    double length; ///< of the original direction
};

/// The same for up to 16 rays, one a lane. All begin at t = 0.
struct PreparedPacket {
    static constexpr int capacity = LatticeRayPacket::capacity;

    double original_t(int lane, double t) const { return shift[lane] + t / length[lane]; }

    alignas(64) double origin[3][capacity];
    alignas(64) double direction[3][capacity];
    alignas(64) double t_far[capacity];
    alignas(64) double shift[capacity];
    alignas(64) double length[capacity];
};

/// The next larger number in single precision, of a t that is not negative: the hit itself stays within the ray.
inline float rounded_up(double t)
{
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(static_cast<float>(t) + 0.0f) + 1u);
}

/// Prepares a ray; false where it misses the box, which is relative to the centre. Throws std::invalid_argument for a
/// ray that is not finite or has no direction; `index` names it in the error.
bool prepare(const Ray& ray, std::size_t index, const glm::dvec3& centre, const Box& box, PreparedRay& prepared);

/// Prepares up to 16 rays, each as prepare() would, bit for bit. `index` is the first one's. Returns those that do not
/// miss the box.
LaneMask prepare_packet(std::span<const Ray> rays, std::size_t index, const glm::dvec3& centre, const Box& box,
                        PreparedPacket& prepared);

/// Sets Embree's ray.
inline void set_ray(const Ray& from, RTCRay& to)
{
    to.org_x = static_cast<float>(from.origin.x);
    to.org_y = static_cast<float>(from.origin.y);
    to.org_z = static_cast<float>(from.origin.z);
    to.tnear = 0.0f;
    to.dir_x = static_cast<float>(from.direction.x);
    to.dir_y = static_cast<float>(from.direction.y);
    to.dir_z = static_cast<float>(from.direction.z);
    to.time = 0.0f;
    to.tfar = rounded_up(from.t_far);
    to.mask = 0xffffffffu;
    to.id = 0;
    to.flags = 0;
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
    to_single(prepared.direction[0], packet.ray.dir_x);
    to_single(prepared.direction[1], packet.ray.dir_y);
    to_single(prepared.direction[2], packet.ray.dir_z);
    for (int lane = 0; lane < Size; ++lane) {
        packet.ray.tnear[lane] = 0.0f;
        packet.ray.tfar[lane] = rounded_up(prepared.t_far[lane]);
        packet.ray.time[lane] = 0.0f;
        packet.ray.mask[lane] = 0xffffffffu;
        packet.ray.id[lane] = static_cast<unsigned int>(lane);
        packet.ray.flags[lane] = 0;
        packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
        packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
}

/// The rays in an instance's lattice space, each as LatticeRay has it, bit for bit.
void to_lattice(const PreparedPacket& prepared, const glm::dmat4& world_to_lattice, LatticeRayPacket& rays);

} // namespace isospline
