// Rays that are tested against a triangle together, one per SIMD lane.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/trace/triangle.h"

namespace isospline {

/// Up to 16 rays scaled for triangles; lanes without a ray are harmless.
struct TriangleRayPacket {
    static constexpr int capacity = LatticeRayPacket::capacity;

    void set(int lane, const TriangleRay& ray)
    {
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis][lane] = ray.origin[axis];
            direction[axis][lane] = ray.direction[axis];
        }
        scale[lane] = ray.scale;
        t_near[lane] = ray.t_near;
        t_far[lane] = ray.t_far;
    }

    TriangleRay ray(int lane) const
    {
        TriangleRay ray;
        ray.origin = {origin[0][lane], origin[1][lane], origin[2][lane]};
        ray.direction = {direction[0][lane], direction[1][lane], direction[2][lane]};
        ray.scale = scale[lane];
        ray.t_near = t_near[lane];
        ray.t_far = t_far[lane];
        return ray;
    }

    alignas(64) double origin[3][capacity] = {};
    alignas(64) double direction[3][capacity] = {};
    double scale[capacity] = {};
    double t_near[capacity] = {}, t_far[capacity] = {};
};

/// The lanes whose lines go through a triangle.
struct LanePassages {
    LaneMask against_normal = 0, along_normal = 0;
};

/// How the lines of `lanes` go through a triangle, each with the result of passage().
LanePassages passages(const TriangleRayPacket& rays, const Triangle& triangle, LaneMask lanes);

} // namespace isospline
