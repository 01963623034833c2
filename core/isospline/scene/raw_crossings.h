// The crossings of rays as they are found, in no order, for lists of them.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/cell/root_in_cell.h"
#include "isospline/scene/absorption.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/cap.h"
#include "isospline/trace/triangle.h"

#include <cstdint>
#include <variant>
#include <vector>

namespace isospline {

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

/// The part of a ray that the clip of a capped isosurface keeps, for lists of crossings.
struct ChordOfInstance {
    CappedChord chord;
    const IsosurfaceSnapshot* surface;
    std::uint32_t slot;
};

/// Adds the chord of an instance to a list in which it is once.
void add_chord(const ChordOfInstance& chord, std::vector<ChordOfInstance>& chords);

/// All crossings of the rays of a packet, in no order, and the chords of capped surfaces.
struct RawCrossings {
    void clear();

    std::vector<RawCrossing> of_ray[packet_capacity];
    std::vector<ChordOfInstance> chords_of_ray[packet_capacity];
};

/// Adds a crossing to those of the ray in a lane, up to the crossing where its largest depth is reached: nothing is
/// seen behind it, at t above `t_limit`. Returns whether this limit is lower now.
bool add_visible(const RawCrossing& crossing, const Absorption& absorption, const RayLimits& limits, int lane,
                 PacketDepths& depths, std::vector<RawCrossing>& listed, double& t_limit);

/// The crossings of a packet's rays that are seen, for rays in a stream.
struct PacketCrossings {
    /// `crossings` are empty.
    void begin(const LatticeRayPacket& rays);
    /// Adds a crossing of the ray in a lane; without an absorption, all are seen.
    void add(int lane, const RawCrossing& crossing, const Absorption* absorption);

    RawCrossings crossings;
    RayLimitsPacket limits;
    PacketDepths depths;
    double t_limit[packet_capacity];
};

} // namespace isospline
