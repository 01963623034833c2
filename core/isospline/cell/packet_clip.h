// The parts of the rays of a packet in half-spaces.
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/math/half_space.h"

#include <vector>

namespace isospline {

/// The numbers of the half-spaces through whose planes the rays of a packet enter and leave, as those of Chord.
struct PlanesOfChords {
    int entry_of(int lane) const { return static_cast<int>(entry[lane]); }
    int exit_of(int lane) const { return static_cast<int>(exit[lane]); }

    alignas(64) double entry[packet_capacity];
    alignas(64) double exit[packet_capacity];
};

/// Limits rays to their parts inside all of the half-spaces, with the numbers of clip() for one ray, bit for bit.
/// Returns those of `lanes` of which a part is left.
LaneMask clip(LatticeRayPacket& rays, LaneMask lanes, const std::vector<HalfSpace>& half_spaces,
              PlanesOfChords& through);

} // namespace isospline
