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
#include "isospline/scene/object.h"
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
#include <variant>
#include <vector>

namespace isospline {

/// A ray in the space of an instance's mesh; the given ray if the instance is not moved.
inline TriangleRay ray_in_mesh(const Ray& ray_world, const Placement& placement)
{
    const glm::dvec3 translation(placement.transform[3]);
    return TriangleRay({placement.linear_inverse * (ray_world.origin - translation),
                        placement.linear_inverse * ray_world.direction, ray_world.t_near, ray_world.t_far});
}

/// The first triangle of a mesh that a ray crosses, of those found so far.
struct MeshHit {
    std::uint32_t slot, primitive;
    TriangleHit hit;
    double t; ///< the least of the triangles, which rounding may make less than that of the first one
};

/// The first hits of a ray in meshes, one a mesh. They do not depend on hits of other objects, so that these cannot
/// change which triangle of a mesh is hit.
class MeshHits {
public:
    void clear() { hits_.clear(); }
    const MeshHit* find(std::uint32_t slot) const
    {
        const auto i = place_of(slot);
        return i < hits_.size() ? &hits_[i] : nullptr;
    }
    /// Adds a hit of a mesh; `is_before(hit, other)` tells which of two triangles the ray meets first. Returns the
    /// first hit in the mesh.
    template <typename IsBefore>
    const MeshHit& add(const MeshHit& hit, const IsBefore& is_before)
    {
        const auto i = place_of(hit.slot);
        if (i == hits_.size())
            return hits_.emplace_back(hit);
        MeshHit& first = hits_[i];
        const double t = std::min(hit.t, first.t);
        if (is_before(hit, first))
            first = hit;
        first.t = t;
        return first;
    }

private:
    std::size_t place_of(std::uint32_t slot) const
    {
        const auto found = std::find_if(hits_.begin(), hits_.end(), [&](const MeshHit& in) { return in.slot == slot; });
        return static_cast<std::size_t>(found - hits_.begin());
    }

    std::vector<MeshHit> hits_;
};

/// Instances by slot, the number that Embree reports, in the order of their geometry ids.
using Instances = std::span<const std::shared_ptr<const Instance>>;

/// A crossing with a cell or a triangle.
struct RawCrossing {
    double t() const
    {
        const auto* const in_cell = std::get_if<CrossingInCell>(&found);
        return in_cell != nullptr ? in_cell->root.t : std::get<TriangleHit>(found).t;
    }

    std::variant<CrossingInCell, TriangleHit> found;
    double t_begin; ///< begin of the cell's segment, which orders crossings at the same t; for a mesh, t
    std::uint32_t slot;
    std::uint64_t primitive;
};

/// The ids of a hit.
struct HitIds {
    std::uint32_t slot = RTC_INVALID_GEOMETRY_ID;
    bool is_cap = false;
    std::uint64_t primitive = 0;
};

/// Whether the first of two hits at the same t is the hit of the ray, and not the second. It is the one with the
/// smaller geometry id, then the one with the smaller primitive id. A cap comes after all others. If caps of several
/// instances coincide, as those of skin and bone in one clip, the one that was added last is visible.
inline bool precedes(const HitIds& a, const HitIds& b)
{
    if (a.is_cap != b.is_cap)
        return b.is_cap;
    if (a.slot == b.slot)
        return a.primitive < b.primitive;
    return a.is_cap == (a.slot > b.slot);
}

/// The t of a hit: that of the prepared ray, and that which is reported.
struct HitT {
    double moved, given;
};

/// Whether the first of two hits is the hit of the ray, and not the second. Reported numbers decide, so that objects
/// tie if they are seen to. Crossings of one isosurface are compared with the precision of the prepared ray. This is a
/// total order, so the order in which hits are found does not matter.
inline bool precedes(const HitT& a_t, const HitIds& a, const HitT& b_t, const HitIds& b)
{
    if (a_t.given != b_t.given)
        return a_t.given < b_t.given;
    if (a.slot == b.slot && a.is_cap == b.is_cap && a_t.moved != b_t.moved)
        return a_t.moved < b_t.moved;
    return precedes(a, b);
}

/// No t beyond this one is reported as the same number, or as a smaller one.
inline double last_equal_t(double moved, const RayLimits& limits)
{
    return moved + 0x1p-50 * (moved + std::abs(limits.shift) * limits.length);
}

/// The part of a ray that the clip of a capped isosurface keeps, for lists of crossings.
struct ChordOfInstance {
    CappedChord chord;
    const IsosurfaceSnapshot* surface;
    std::uint32_t slot;
};

/// All crossings of the rays of a packet, in no order, and the chords of capped surfaces.
struct RawCrossings {
    std::vector<RawCrossing> of_ray[PreparedPacket::capacity];
    std::vector<ChordOfInstance> chords_of_ray[PreparedPacket::capacity];
};

/// Adds the chord of an instance to a list in which it is once.
inline void add_chord(const ChordOfInstance& chord, std::vector<ChordOfInstance>& chords)
{
    if (std::none_of(chords.begin(), chords.end(), [&](const auto& listed) { return listed.slot == chord.slot; }))
        chords.push_back(chord);
}

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

struct PacketHits;

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

/// The nearest hits of the rays of a packet so far.
struct PacketHits {
    /// `t_far` are the ends of the rays.
    void begin(const double* t_far)
    {
        std::copy_n(t_far, packet_capacity, t_limit);
        std::fill_n(nearest_ids, packet_capacity, HitIds());
    }

    bool has_hit(int lane) const { return nearest_ids[lane].slot != RTC_INVALID_GEOMETRY_ID; }
    /// Those of `lanes` that have a hit.
    LaneMask lanes_with_hit(LaneMask lanes) const
    {
        LaneMask found = 0;
        for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u)
            if (const int lane = std::countr_zero(rest); has_hit(lane))
                found |= LaneMask{1} << lane;
        return found;
    }

    /// Keeps a hit of an isosurface if it is nearer than the nearest so far; returns whether it is.
    bool record(int lane, const RootInCell& root, const HitIds& ids, const RayLimits& limits)
    {
        if (!(root.t <= t_limit[lane]))
            return false;
        const HitT t{root.t, limits.given_t(root.t)};
        if (has_hit(lane) && !is_first(lane, t, ids))
            return false;
        keep(lane, root, t, ids, limits);
        return true;
    }
    /// The same for the first hit of a mesh.
    bool record(int lane, const MeshHit& hit, const RayLimits& limits)
    {
        const HitIds ids{hit.slot, false, hit.primitive};
        const HitT t{limits.moved_t(hit.t), hit.t};
        if (has_hit(lane) && ids.slot != nearest_ids[lane].slot && !is_first(lane, t, ids))
            return false;
        keep(lane, {t.moved, glm::dvec3(0.0)}, t, ids, limits);
        return true;
    }

    RootPacket nearest; ///< like that of RayQuery
    double nearest_given[packet_capacity];
    HitIds nearest_ids[packet_capacity];
    alignas(64) double t_limit[packet_capacity];

private:
    bool is_first(int lane, const HitT& t, const HitIds& ids) const
    {
        return precedes(t, ids, {nearest.t[lane], nearest_given[lane]}, nearest_ids[lane]);
    }
    void keep(int lane, const RootInCell& root, const HitT& t, const HitIds& ids, const RayLimits& limits)
    {
        nearest.set(lane, root);
        nearest_given[lane] = t.given;
        nearest_ids[lane] = ids;
        t_limit[lane] = last_equal_t(root.t, limits);
    }
};

inline void RayQuery::begin_at(const PacketHits& hits, int lane)
{
    t_limit = hits.t_limit[lane];
    nearest_ids = hits.nearest_ids[lane];
    if (!has_hit())
        return;
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
