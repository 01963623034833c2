// Certificates of rays in packets, in SIMD lanes: docs/method.md, "Certified rays".
#pragma once

#include "isospline/cell/lattice_ray_packet.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/certified_placement.h"
#include "isospline/trace/certified_ray.h"
#include "isospline/trace/ray_packet.h"

#include <span>

namespace isospline::certified {

/// Proves that the rays of these lanes first cross the surface next to their t_hints, or that they miss it. Returns the
/// lanes for which one of both is proven, whose certificates it sets. The others are left to RayCertifier::certify() of
/// one ray: those that hit elsewhere, or that begin, end or touch within rounding.
LaneMask certify_packet(const IsosurfaceSnapshot& surface, const Placement& placement, const RayPacket& rays,
                        LaneMask lanes, std::span<const double, packet_capacity> t_hints,
                        std::span<RayCertificate, packet_capacity> certificates);

} // namespace isospline::certified
