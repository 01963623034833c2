// Rays that are cast together, stored axis by axis. Cameras and arrays of rays are converted to packets.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/math/ray.h"

namespace isospline {

/// Up to 16 rays, in the first lanes.
struct RayPacket {
    static constexpr int capacity = packet_capacity;

    void set(int lane, const Ray& ray)
    {
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis][lane] = ray.origin[axis];
            direction[axis][lane] = ray.direction[axis];
        }
        t_near[lane] = ray.t_near;
        t_far[lane] = ray.t_far;
    }

    Ray ray(int lane) const
    {
        return {{origin[0][lane], origin[1][lane], origin[2][lane]},
                {direction[0][lane], direction[1][lane], direction[2][lane]},
                t_near[lane],
                t_far[lane]};
    }

    int count = 0;
    alignas(64) double origin[3][capacity] = {}; ///< lanes beyond the count are harmless
    alignas(64) double direction[3][capacity] = {};
    alignas(64) double t_near[capacity] = {};
    alignas(64) double t_far[capacity] = {};
};

} // namespace isospline
