// Data that rays carry through Embree: the rays in double precision, and the nearest roots found so far.
//
// Embree traverses boxes in single precision. Cells are solved in double precision with the rays kept here. These
// objects derive from the context that Embree passes to the callbacks.
#pragma once

#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/scene/embree_api.h"
#include "isospline/scene/embree_ray.h"
#include "isospline/scene/instance.h"
#include "isospline/scene/nearest_hits.h"
#include "isospline/scene/object.h"
#include "isospline/scene/raw_crossings.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/cap.h"
#include "isospline/trace/prepared_ray.h"
#include "isospline/trace/triangle.h"
#include "isospline/trace/triangle_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace isospline {

/// A ray in the space of an instance's mesh; the given ray if the instance is not moved.
inline TriangleRay ray_in_mesh(const Ray& ray_world, const Placement& placement)
{
    const glm::dvec3 translation(placement.transform[3]);
    return TriangleRay({placement.linear_inverse * (ray_world.origin - translation),
                        placement.linear_inverse * ray_world.direction, ray_world.t_near, ray_world.t_far});
}

/// Instances by slot, the number that Embree reports, in the order of their geometry ids.
using Instances = std::span<const std::shared_ptr<const Instance>>;

/// The common part of queries of one ray and of a packet: the first exception of a callback. It must not cross Embree's
/// frames.
struct Query : embree::QueryContext {
    /// Calls `body` from a callback for `count` rays that end at t_far. If it throws, or an earlier callback did, the
    /// rays end.
    template <typename Body>
    void guard(float* t_far, unsigned int count, const Body& body) noexcept
    {
        if (!raised) {
            try {
                return body();
            } catch (...) {
                raised = std::current_exception();
            }
        }
        std::fill_n(t_far, count, -std::numeric_limits<float>::infinity());
    }

    /// Call this after the traversal. The query can then be used again.
    void rethrow()
    {
        if (raised)
            std::rethrow_exception(std::exchange(raised, nullptr));
    }

    std::exception_ptr raised;
};

/// The query of one ray.
struct RayQuery : Query {
    explicit RayQuery(Instances instances_by_slot) : instances(instances_by_slot) { embree::initialize(*this); }

    /// Call this with the given ray after `prepared` is set.
    void begin(const Ray& ray)
    {
        given = &ray;
        slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
        in_meshes.clear();
        t_limit = prepared.ray.t_far;
        nearest_ids = {};
        cached_slot = RTC_INVALID_GEOMETRY_ID;
        chords.clear();
    }

    /// Call this after begin(): the nearest hit so far is that of a lane of a packet.
    void begin_at(const PacketHits& hits, int lane);

    bool has_hit() const { return nearest_ids.slot != RTC_INVALID_GEOMETRY_ID; }

    /// Keeps a hit of an isosurface if it is nearer than the nearest so far, and ends Embree's ray there.
    void record(const RootInCell& root, const HitIds& ids, RTCRay& ray)
    {
        if (!(root.t <= t_limit))
            return;
        const HitT t{root.t, prepared.limits.given_t(root.t)};
        if (!has_hit() || precedes(t, ids, {nearest.t, nearest_given}, nearest_ids))
            keep(root, t, ids, ray);
    }
    /// The same for the first hit of a mesh.
    void record(const MeshHit& hit, RTCRay& ray)
    {
        const HitIds ids{hit.slot, false, hit.primitive};
        const HitT t{prepared.limits.moved_t(hit.t), hit.t};
        if (!has_hit() || ids.slot == nearest_ids.slot || precedes(t, ids, {nearest.t, nearest_given}, nearest_ids))
            keep({t.moved, glm::dvec3(0.0)}, t, ids, ray);
    }

    /// Sets `in_lattice` and the members after it for an instance. The ray stays in one instance for many cells, so the
    /// last instance is remembered.
    void enter(std::uint32_t slot, const IsosurfaceSnapshot& surface, const CapBoxes& caps);

    /// Sets `in_mesh` to the ray in the space of an instance of a mesh.
    void enter_mesh(std::uint32_t slot)
    {
        if (slot == slot_in_mesh)
            return;
        slot_in_mesh = slot;
        in_mesh = ray_in_mesh(*given, instances[slot]->placement);
    }

    Instances instances;
    const Ray* given = nullptr;
    PreparedRay prepared;
    const LatticeRayPacket* alone = nullptr; ///< rays in the space of the only instance, if there is just one
    int lane_alone = 0;                      ///< the ray among these
    std::uint32_t slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
    TriangleRay in_mesh;
    MeshHits in_meshes;
    RootInCell nearest; ///< the nearest hit so far, if there is one
    double nearest_given = 0.0;
    HitIds nearest_ids;
    double t_limit = 0.0;        ///< roots beyond it do not matter
    bool touches_meshes = false; ///< whether touches of triangles are hits, too
    std::uint32_t cached_slot = RTC_INVALID_GEOMETRY_ID;
    LatticeRay in_lattice; ///< limited to the part that its planes keep
    bool clip_leaves_any = false;
    CappedChord chord;                       ///< of a capped surface: the part that its planes keep
    bool enters_cap = false;                 ///< whether it begins on a cap, which is then the first hit
    bool needs_caps = false;                 ///< whether the caps of the instance have not been tested
    std::vector<RawCrossing>* all = nullptr; ///< list for all crossings; if set, none ends the ray
    std::vector<ChordOfInstance> chords;     ///< in this case, the chords of capped surfaces

private:
    void keep(const RootInCell& root, const HitT& t, const HitIds& ids, RTCRay& ray)
    {
        nearest = root;
        nearest_given = t.given;
        nearest_ids = ids;
        t_limit = last_equal_t(root.t, prepared.limits);
        ray.tfar = std::min(ray.tfar, rounded_up(t_limit));
    }
};

inline void RayQuery::begin_at(const PacketHits& hits, int lane)
{
    t_limit = hits.t_limit[lane];
    nearest_ids = {};
    if (!hits.has_hit(lane))
        return;
    nearest_ids = hits.nearest_ids[lane];
    nearest = hits.nearest.root(lane);
    nearest_given = hits.nearest_given[lane];
}

/// The query of a packet of rays.
struct PacketQuery : Query, PacketHits {
    explicit PacketQuery(Instances instances_by_slot) : instances(instances_by_slot) { embree::initialize(*this); }

    /// Call this with the given rays after `prepared` is set.
    void begin(const RayPacket& rays, LaneMask used_lanes)
    {
        given = &rays;
        slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
        for (MeshHits& hits : in_meshes)
            hits.clear();
        used = used_lanes;
        PacketHits::begin(prepared.t_far);
        cached_slot = slot_in_lattice = RTC_INVALID_GEOMETRY_ID;
    }

    /// Like that of RayQuery, for all lanes; `in_lattice` may have been set for the slot.
    void enter(std::uint32_t slot, const IsosurfaceSnapshot& surface, const CapBoxes& caps);

    /// Like that of PacketHits, and ends Embree's rays; `t_far` are those of all lanes.
    void record(LaneMask lanes, const RootPacket& roots, std::uint32_t slot, const std::uint64_t* primitives,
                float* t_far)
    {
        for (LaneMask rest = PacketHits::record(lanes, roots, slot, primitives, prepared.limits); rest != 0;
             rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            t_far[lane] = std::min(t_far[lane], rounded_up(t_limit[lane]));
        }
    }
    /// Like those of RayQuery; `t_far` belongs to the lane.
    void record(int lane, const RootInCell& root, const HitIds& ids, float& t_far)
    {
        if (PacketHits::record(lane, root, ids, prepared.limits[lane]))
            t_far = std::min(t_far, rounded_up(t_limit[lane]));
    }
    void record(int lane, const MeshHit& hit, float& t_far)
    {
        if (PacketHits::record(lane, hit, prepared.limits[lane]))
            t_far = std::min(t_far, rounded_up(t_limit[lane]));
    }

    void enter_mesh(std::uint32_t slot);

    Instances instances;
    bool is_occlusion = false; ///< whether it is a PacketOcclusion
    const RayPacket* given = nullptr;
    PreparedPacket prepared;
    std::uint32_t slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
    TriangleRayPacket in_mesh;
    MeshHits in_meshes[PreparedPacket::capacity];
    LaneMask used = 0; ///< lanes that hold a ray
    std::uint32_t cached_slot = RTC_INVALID_GEOMETRY_ID;
    std::uint32_t slot_in_lattice = RTC_INVALID_GEOMETRY_ID; ///< that `in_lattice` is set for already, without a clip
    LatticeRayPacket in_lattice;
    LaneMask clip_leaves = 0; ///< lanes of which the clip keeps a part
    CappedChord chords[LatticeRayPacket::capacity];
    LaneMask enters_cap = 0, needs_caps = 0; ///< like those of RayQuery
};

} // namespace isospline
