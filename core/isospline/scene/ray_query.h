// What rays carry through Embree: themselves in double precision, and the nearest roots found so far.
//
// Embree traverses boxes in single precision; cells are solved in double precision on the rays kept here. The context
// that Embree hands to the callbacks is the base of these objects.
#pragma once

#include "isospline/scene/embree_api.h"
#include "isospline/scene/instance.h"
#include "isospline/scene/prepared_ray.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/cap.h"
#include "isospline/trace/lattice_ray.h"
#include "isospline/trace/lattice_ray_packet.h"

#include <glm/vec2.hpp>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace isospline {

/// Instances by their slots, the numbers that Embree tells: in the order of their geometry ids.
using Instances = std::span<const std::shared_ptr<const Instance>>;

/// A crossing as Embree or a cell has it.
struct RawCrossing {
    CrossingInCell in_cell; ///< of a mesh, t alone
    glm::vec2 uv;
    std::uint32_t slot, primitive;
};

/// What the clip of a capped isosurface leaves of a ray that is to be listed.
struct ChordOfInstance {
    CappedChord chord;
    const IsosurfaceSnapshot* surface;
    std::uint32_t slot;
};

/// The query of one ray.
struct RayQuery : embree::QueryContext {
    explicit RayQuery(Instances instances_by_slot) : instances(instances_by_slot) { embree::initialize(*this); }

    /// To be called when `prepared` is set.
    void begin()
    {
        nearest.t = prepared.ray.t_far;
        cached_slot = RTC_INVALID_GEOMETRY_ID;
        chords.clear();
    }

    /// Makes `in_lattice` and what follows it those of an instance. The ray stays in one instance for many cells, so
    /// the last one is remembered.
    void enter(std::uint32_t slot, const IsosurfaceSnapshot& surface);

    Instances instances;
    PreparedRay prepared;
    RootInCell nearest; ///< root of an isosurface so far; t is the ray's t_far where there is none
    std::uint32_t cached_slot = RTC_INVALID_GEOMETRY_ID;
    LatticeRay in_lattice; ///< limited to what the clip leaves
    bool clip_leaves_any = false;
    CappedChord chord;                       ///< of a capped surface: what the clip leaves
    bool enters_cap = false;                 ///< whether it begins on a cap, behind which nothing is the first
    std::vector<RawCrossing>* all = nullptr; ///< where crossings go if all are wanted, and none ends the ray
    std::vector<ChordOfInstance> chords;     ///< in this case, those of capped surfaces
};

/// The query of a packet of rays.
struct PacketQuery : embree::QueryContext {
    explicit PacketQuery(Instances instances_by_slot) : instances(instances_by_slot) { embree::initialize(*this); }

    /// To be called when `prepared` is set.
    void begin(LaneMask used_lanes)
    {
        used = used_lanes;
        std::copy_n(prepared.t_far, PreparedPacket::capacity, nearest.t);
        cached_slot = RTC_INVALID_GEOMETRY_ID;
    }

    /// As of RayQuery, for all lanes.
    void enter(std::uint32_t slot, const IsosurfaceSnapshot& surface);

    Instances instances;
    PreparedPacket prepared;
    RootPacket nearest; ///< as in RayQuery
    LaneMask used = 0;  ///< lanes that hold a ray
    std::uint32_t cached_slot = RTC_INVALID_GEOMETRY_ID;
    LatticeRayPacket in_lattice;
    LaneMask clip_leaves = 0; ///< lanes of which the clip leaves anything
    CappedChord chords[LatticeRayPacket::capacity];
    LaneMask enters_cap = 0;
};

} // namespace isospline
