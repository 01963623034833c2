// Rays that are tested against cells together, one per SIMD lane.
#pragma once

#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/root_in_cell.h"

#include <bit>
#include <cstdint>

namespace isospline {

/// A set of lanes, lane i being bit i.
using LaneMask = std::uint32_t;

/// The largest number of rays in a packet.
inline constexpr int packet_capacity = 16;

/// The limits of the rays of a packet.
struct RayLimitsPacket {
    RayLimits operator[](int lane) const { return {shift[lane], length[lane], t_near[lane], t_far[lane]}; }

    alignas(64) double shift[packet_capacity] = {};
    alignas(64) double length[packet_capacity] = {};
    alignas(64) double t_near[packet_capacity] = {};
    alignas(64) double t_far[packet_capacity] = {};
};

/// Up to 16 rays in lattice space, axis by axis; lanes without a ray are harmless.
struct LatticeRayPacket {
    static constexpr int capacity = packet_capacity;

    void set(int lane, const LatticeRay& ray)
    {
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis][lane] = ray.origin[axis];
            plane_origin[axis][lane] = ray.plane_origin[axis];
            direction[axis][lane] = ray.direction[axis];
            inverse_direction[axis][lane] = ray.inverse_direction[axis];
            direction_single[axis][lane] = ray.direction_single[axis];
            inverse_direction_single[axis][lane] = ray.inverse_direction_single[axis];
        }
        t_near[lane] = ray.t_near;
        t_far[lane] = ray.t_far;
        limits.shift[lane] = ray.limits.shift;
        limits.length[lane] = ray.limits.length;
        limits.t_near[lane] = ray.limits.t_near;
        limits.t_far[lane] = ray.limits.t_far;
    }

    glm::dvec3 origin_of(int lane) const { return {origin[0][lane], origin[1][lane], origin[2][lane]}; }
    glm::dvec3 direction_of(int lane) const { return {direction[0][lane], direction[1][lane], direction[2][lane]}; }
    LatticeRay ray(int lane) const
    {
        LatticeRay ray;
        for (int axis = 0; axis < 3; ++axis) {
            ray.origin[axis] = origin[axis][lane];
            ray.plane_origin[axis] = plane_origin[axis][lane];
            ray.direction[axis] = direction[axis][lane];
            ray.inverse_direction[axis] = inverse_direction[axis][lane];
            ray.direction_single[axis] = direction_single[axis][lane];
            ray.inverse_direction_single[axis] = inverse_direction_single[axis][lane];
        }
        ray.t_near = t_near[lane];
        ray.t_far = t_far[lane];
        ray.limits = limits[lane];
        return ray;
    }

    alignas(64) double origin[3][capacity] = {};
    alignas(64) double plane_origin[3][capacity] = {};
    alignas(64) double direction[3][capacity] = {};
    alignas(64) double inverse_direction[3][capacity] = {};
    alignas(64) float direction_single[3][capacity] = {};
    alignas(64) float inverse_direction_single[3][capacity] = {};
    alignas(64) double t_near[capacity] = {};
    alignas(64) double t_far[capacity] = {};
    RayLimitsPacket limits;
};

/// The roots found for the lanes of a packet.
struct RootPacket {
    void set(int lane, const RootInCell& root)
    {
        t[lane] = root.t;
        for (int axis = 0; axis < 3; ++axis)
            gradient[axis][lane] = root.gradient[axis];
    }

    RootInCell root(int lane) const { return {t[lane], {gradient[0][lane], gradient[1][lane], gradient[2][lane]}}; }

    alignas(64) double t[LatticeRayPacket::capacity];
    alignas(64) double gradient[3][LatticeRayPacket::capacity]; ///< of f, by lattice coordinates
};

} // namespace isospline
