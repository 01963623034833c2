#include "isospline/scene/raw_crossings.h"

#include "isospline/scene/nearest_hits.h"

#include <algorithm>
#include <iterator>

namespace isospline {

void add_chord(const ChordOfInstance& chord, std::vector<ChordOfInstance>& chords)
{
    if (std::none_of(chords.begin(), chords.end(), [&](const auto& listed) { return listed.slot == chord.slot; }))
        chords.push_back(chord);
}

void RawCrossings::clear()
{
    for (int lane = 0; lane < packet_capacity; ++lane) {
        of_ray[lane].clear();
        chords_of_ray[lane].clear();
    }
}

bool add_visible(const RawCrossing& crossing, const Absorption& absorption, const RayLimits& limits, int lane,
                 PacketDepths& depths, std::vector<RawCrossing>& listed, double& t_limit)
{
    // Rounding leaves the order of crossings open that are this near to each other.
    const auto first_t = [&](const RawCrossing& of) {
        const auto* const triangle = std::get_if<TriangleHit>(&of.found);
        return triangle ? limits.moved_t(of.t() - 8.0 * triangle->t_error) : of.t();
    };
    const auto last_t = [&](const RawCrossing& of) {
        const auto* const triangle = std::get_if<TriangleHit>(&of.found);
        return last_equal_t(triangle ? limits.moved_t(of.t() + 8.0 * triangle->t_error) : of.t(), limits);
    };
    const auto depth_of = [&](const RawCrossing& of) { return absorption.depth(of.slot).value_or(0); };
    if (depths.is_largest(lane) && first_t(crossing) > t_limit)
        return false;
    listed.push_back(crossing);
    const Absorption::Depth added = depth_of(crossing);
    if (!depths.add(lane, added) || added == 0)
        return false;

    // The limit is where the crossings found so far reach the depth, and decreases as more are found.
    std::sort(listed.begin(), listed.end(),
              [&](const RawCrossing& a, const RawCrossing& b) { return last_t(a) < last_t(b); });
    Absorption::Depth sum = 0;
    auto end = listed.begin();
    while (sum < depths.largest[lane])
        sum += depth_of(*end++);
    t_limit = last_t(*std::prev(end));
    std::erase_if(listed, [&](const RawCrossing& of) { return first_t(of) > t_limit; });
    return true;
}

void PacketCrossings::begin(const LatticeRayPacket& rays)
{
    limits = rays.limits;
    depths.begin(Absorption::invisibility);
    std::copy_n(rays.t_far, packet_capacity, t_limit);
}

void PacketCrossings::add(int lane, const RawCrossing& crossing, const Absorption* absorption)
{
    std::vector<RawCrossing>& listed = crossings.of_ray[lane];
    if (absorption == nullptr)
        listed.push_back(crossing);
    else
        add_visible(crossing, *absorption, limits[lane], lane, depths, listed, t_limit[lane]);
}

} // namespace isospline
