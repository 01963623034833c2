// The nearest hits that queries have found so far, and which of two hits is nearer.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/scene/embree_api.h"
#include "isospline/trace/triangle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

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

/// A bound on the rounding of a reported t, relative to what it is computed from.
inline constexpr double rounding_of_equal_t = 0x1p-50;

/// No t beyond this one is reported as the same number, or as a smaller one.
inline double last_equal_t(double moved, const RayLimits& limits)
{
    return moved + rounding_of_equal_t * (moved + std::abs(limits.shift) * limits.length);
}

/// The nearest hits of the rays of a packet so far.
struct PacketHits {
    /// `t_far` are the ends of the rays.
    void begin(const double* t_far)
    {
        std::copy_n(t_far, packet_capacity, t_limit);
        hit_lanes = 0;
    }

    bool has_hit(int lane) const { return (hit_lanes >> lane & 1u) != 0; }

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
    /// The same for hits of some lanes, none of them beyond its limit; `primitives` are those of all lanes. Returns the
    /// lanes whose hits are the nearest.
    LaneMask record(LaneMask lanes, const RootPacket& roots, std::uint32_t slot, const std::uint64_t* primitives,
                    const RayLimitsPacket& limits);
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

    void set(int lane, const RootInCell& root, double given, const HitIds& ids)
    {
        hit_lanes |= LaneMask{1} << lane;
        nearest.set(lane, root);
        nearest_given[lane] = given;
        nearest_ids[lane] = ids;
    }

    LaneMask hit_lanes = 0; ///< whose members below have a meaning
    RootPacket nearest;     ///< like that of RayQuery
    alignas(64) double nearest_given[packet_capacity] = {};
    HitIds nearest_ids[packet_capacity];
    alignas(64) double t_limit[packet_capacity];

private:
    bool is_first(int lane, const HitT& t, const HitIds& ids) const
    {
        return precedes(t, ids, {nearest.t[lane], nearest_given[lane]}, nearest_ids[lane]);
    }
    void keep(int lane, const RootInCell& root, const HitT& t, const HitIds& ids, const RayLimits& limits)
    {
        set(lane, root, t.given, ids);
        t_limit[lane] = last_equal_t(root.t, limits);
    }
};

} // namespace isospline
