// Rays that are traced one by one, many of them under way at a time.
#pragma once

#include "isospline/cell/intersector.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/trace/brick_trace.h"
#include "isospline/trace/leaf_tree.h"

#include <glm/vec3.hpp>

namespace isospline {

/// A source of rays, and what happens to them. A lane holds a ray until next() sets another one.
struct RayStream {
    void* context;
    /// Sets a lane to the next ray, with the part of it that cuts leave; returns false if no ray is left.
    bool (*next)(void* context, int lane, LatticeRayPacket& rays);
    /// Takes the first crossing in a cell. Returns the t beyond which no crossing of the ray counts any more.
    double (*record)(void* context, int lane, const RayLimits& limits, const RootInCell& root, const glm::ivec3& cell);
    /// If given in place of record(), gets all crossings, with the t at which the ray enters the cell, and returns the
    /// same.
    double (*list)(void* context, int lane, const CrossingInCell& crossing, double t_begin,
                   const glm::ivec3& cell) = nullptr;
    /// If given in place of record(), any crossing ends a ray.
    void (*occlude)(void* context, int lane) = nullptr;
    /// If given in place of record(), gets the number of crossings in each cell, in any order. Returns whether the ray
    /// ends.
    bool (*count)(void* context, int lane, int crossings) = nullptr;
};

/// Traces rays through the tree. Sixteen rays are under way: while one waits for memory, the others go on. As soon as
/// each of them has a cell to be solved, the cells are solved side by side. The roots are those of packets and of
/// single rays in Embree, bit for bit, because the cell alone decides.
void trace_stream(const LeafTree& tree, const Leaves& leaves, float margin, const CellIntersector& intersector,
                  const RayStream& stream);

} // namespace isospline
