// What rays carry through Embree: themselves in double precision, and the nearest roots found so far.
//
// Embree traverses boxes in single precision; cells are solved in double precision on the rays kept here. The context
// that Embree hands to the callbacks is the base of these objects.
#pragma once

#include "isospline/cell/lattice_ray.h"
#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/scene/embree_ray.h"
#include "isospline/scene/instance.h"
#include "isospline/scene/mesh_query.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/cap.h"
#include "isospline/trace/prepared_ray.h"
#include "isospline/trace/triangle_packet.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <span>
#include <variant>
#include <vector>

namespace isospline {

/// Instances by their slots, the numbers that Embree tells: in the order of their geometry ids.
using Instances = std::span<const std::shared_ptr<const Instance>>;

/// A crossing as a cell or a triangle has it.
struct RawCrossing {
    double t() const
    {
        const auto* const in_cell = std::get_if<CrossingInCell>(&found);
        return in_cell != nullptr ? in_cell->root.t : std::get<TriangleHit>(found).t;
    }

    std::variant<CrossingInCell, TriangleHit> found;
    double t_begin; ///< of the cell's segment, by which crossings at the same t follow each other; of a mesh, t
    std::uint32_t slot;
    std::uint64_t primitive;
};

/// What was hit, but for where.
struct HitIds {
    std::uint32_t slot = RTC_INVALID_GEOMETRY_ID;
    bool is_cap = false;
    std::uint64_t primitive = 0;
};

/// Whether one of two hits at the same t is the hit of the ray, and not the other: the one with the smaller geometry
/// id, then with the smaller primitive id. A cap gives way to what is not one. Where caps of several instances
/// coincide, as those of skin and bone in one clip do, the last one added is seen.
inline bool precedes(const HitIds& a, const HitIds& b)
{
    if (a.is_cap != b.is_cap)
        return b.is_cap;
    if (a.slot == b.slot)
        return a.primitive < b.primitive;
    return a.is_cap == (a.slot > b.slot);
}

/// What the clip of a capped isosurface leaves of a ray that is to be listed.
struct ChordOfInstance {
    CappedChord chord;
    const IsosurfaceSnapshot* surface;
    std::uint32_t slot;
};

/// What is common to queries of one ray and of a packet: the first exception of a callback, which must not cross
/// Embree's frames.
struct Query : embree::QueryContext {
    /// Calls `body` from a callback for `count` rays that end at t_far. Where that throws, now or in a callback before,
    /// the rays end.
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

    /// To be called after the traversal.
    void rethrow() const
    {
        if (raised)
            std::rethrow_exception(raised);
    }

    std::exception_ptr raised;
};

/// The query of one ray.
struct RayQuery : Query {
    explicit RayQuery(Instances instances_by_slot) : instances(instances_by_slot) { embree::initialize(*this); }

    /// To be called with the ray as given when `prepared` is set.
    void begin(const Ray& ray)
    {
        given = &ray;
        slot_in_mesh = nearest_in_mesh.slot = RTC_INVALID_GEOMETRY_ID;
        nearest.t = prepared.ray.t_far;
        nearest_ids = {};
        cached_slot = RTC_INVALID_GEOMETRY_ID;
        chords.clear();
    }

    bool has_hit() const { return nearest_ids.slot != RTC_INVALID_GEOMETRY_ID; }

    /// Keeps a hit, and ends Embree's ray there, where it is nearer than the nearest so far.
    void record(const RootInCell& root, const HitIds& ids, RTCRay& ray)
    {
        if (!(root.t < nearest.t || (root.t == nearest.t && (!has_hit() || precedes(ids, nearest_ids)))))
            return;
        keep(root, ids, ray);
    }
    void keep(const RootInCell& root, const HitIds& ids, RTCRay& ray)
    {
        nearest = root;
        nearest_ids = ids;
        ray.tfar = std::min(ray.tfar, rounded_up(root.t));
    }

    /// Makes `in_lattice` and what follows it those of an instance. The ray stays in one instance for many cells, so
    /// the last one is remembered.
    void enter(std::uint32_t slot, const IsosurfaceSnapshot& surface);

    /// Makes `in_mesh` the ray in the space of an instance of a mesh.
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
    std::uint32_t slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
    TriangleRay in_mesh;
    MeshHit nearest_in_mesh; ///< of meshes, the last that was the nearest hit
    RootInCell nearest;      ///< the nearest hit so far; t is the ray's t_far where there is none
    HitIds nearest_ids;
    std::uint32_t cached_slot = RTC_INVALID_GEOMETRY_ID;
    LatticeRay in_lattice; ///< limited to what the clip leaves
    bool clip_leaves_any = false;
    CappedChord chord;                       ///< of a capped surface: what the clip leaves
    bool enters_cap = false;                 ///< whether it begins on a cap, behind which nothing is the first
    std::vector<RawCrossing>* all = nullptr; ///< where crossings go if all are wanted, and none ends the ray
    std::vector<ChordOfInstance> chords;     ///< in this case, those of capped surfaces
};

/// The query of a packet of rays.
struct PacketQuery : Query {
    explicit PacketQuery(Instances instances_by_slot) : instances(instances_by_slot) { embree::initialize(*this); }

    /// To be called with the rays as given when `prepared` is set.
    void begin(const RayPacket& rays, LaneMask used_lanes)
    {
        given = &rays;
        slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
        for (MeshHit& hit : nearest_in_mesh)
            hit.slot = RTC_INVALID_GEOMETRY_ID;
        used = used_lanes;
        std::copy_n(prepared.t_far, PreparedPacket::capacity, nearest.t);
        std::fill_n(nearest_ids, PreparedPacket::capacity, HitIds());
        cached_slot = RTC_INVALID_GEOMETRY_ID;
    }

    /// As of RayQuery, for all lanes.
    void enter(std::uint32_t slot, const IsosurfaceSnapshot& surface);

    bool has_hit(int lane) const { return nearest_ids[lane].slot != RTC_INVALID_GEOMETRY_ID; }

    /// As of RayQuery; `t_far` is that of the lane.
    void record(int lane, const RootInCell& root, const HitIds& ids, float& t_far)
    {
        if (!(root.t < nearest.t[lane] ||
              (root.t == nearest.t[lane] && (!has_hit(lane) || precedes(ids, nearest_ids[lane])))))
            return;
        keep(lane, root, ids, t_far);
    }
    void keep(int lane, const RootInCell& root, const HitIds& ids, float& t_far)
    {
        nearest.set(lane, root);
        nearest_ids[lane] = ids;
        t_far = std::min(t_far, rounded_up(root.t));
    }

    void enter_mesh(std::uint32_t slot);

    Instances instances;
    const RayPacket* given = nullptr;
    PreparedPacket prepared;
    std::uint32_t slot_in_mesh = RTC_INVALID_GEOMETRY_ID;
    TriangleRayPacket in_mesh;
    MeshHit nearest_in_mesh[PreparedPacket::capacity];
    RootPacket nearest; ///< as in RayQuery
    HitIds nearest_ids[PreparedPacket::capacity];
    LaneMask used = 0; ///< lanes that hold a ray
    std::uint32_t cached_slot = RTC_INVALID_GEOMETRY_ID;
    LatticeRayPacket in_lattice;
    LaneMask clip_leaves = 0; ///< lanes of which the clip leaves anything
    CappedChord chords[LatticeRayPacket::capacity];
    LaneMask enters_cap = 0;
};

} // namespace isospline
