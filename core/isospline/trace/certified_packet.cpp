#include "isospline/trace/certified_packet.h"

#include "isospline/math/grid.h"
#include "isospline/spline/degree.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

// Vectors whose size is only known at run time cannot be array elements.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/trace/certified_packet.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "isospline/trace/certified_hits-inl.h"
#include "isospline/trace/certified_lines-inl.h"
#include "isospline/trace/certified_parts-inl.h"
#include "isospline/trace/certified_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The certificates of a packet.
template <int Degree>
class PacketCertification {
public:
    PacketCertification(const IsosurfaceSnapshot& surface, const certified::Placement& placement, const RayPacket& rays,
                        LaneMask lanes, const double* t_hints)
        : surface_(surface), placement_(placement), t_hints_(t_hints), lines_(surface, placement, rays, lanes)
    {
    }

    LaneMask run(RayCertificate* certificates)
    {
        alignas(64) double sides[packet_capacity];
        const auto pass = [&] { pass_parts(); };
        const LaneMask walked = CertifiedWalk(surface_, placement_, lines_, t_hints_).run(parts_, ends_, sides, pass);
        if (parts_.size() > 0)
            pass_parts();
        if (undecided_.size() > 0)
            pass_undecided();
        for (std::size_t lane = 0; lane < packet_capacity; ++lane)
            if (sides[lane] != 0.0)
                follow(lane, sides[lane]);
        const LaneMask proven = walked & ~doubted_;
        LaneMask with_end = 0;
        for (std::size_t i = 0; i < ends_.size(); ++i)
            with_end |= LaneMask{1} << static_cast<int>(ends_.at(CertifiedPartList::lane, i));
        const LaneMask misses = (proven & ~with_end) | lines_.outside();
        for (LaneMask rest = misses; rest != 0; rest &= rest - 1)
            certificates[std::countr_zero(rest)] = {};
        return misses | (proven & set_hits(certificates));
    }

private:
    /// Follows the sides of f on all parts: in single precision, and later in double where that is undecided.
    void pass_parts()
    {
        follow_all<CertifiedSingles>(parts_, [&](std::size_t part) {
            undecided_.add(parts_, part);
            if (undecided_.size() >= packet_capacity)
                pass_undecided();
        });
    }

    void pass_undecided()
    {
        follow_all<CertifiedDoubles>(undecided_, [&](std::size_t part) {
            doubted_ |= LaneMask{1} << static_cast<int>(undecided_.at(CertifiedPartList::lane, part));
        });
    }

    /// Follows the sides on the parts of a list, and clears it.
    template <class D, class Doubt>
    void follow_all(CertifiedPartList& list, const Doubt& doubt)
    {
        const D d;
        constexpr std::size_t width = hn::MaxLanes(D());
        list.fill_up();
        for (std::size_t first = 0; first < list.size(); first += width) {
            const CertifiedParts<Degree, D> parts(surface_, placement_, list, first);
            alignas(64) hn::TFromD<D> sides[width];
            hn::Store(parts.side(), d, sides);
            for (std::size_t i = 0; i < width && first + i < list.size(); ++i) {
                if (sides[i] == 0)
                    doubt(first + i);
                else
                    follow(static_cast<std::size_t>(list.at(CertifiedPartList::lane, first + i)),
                           static_cast<double>(sides[i]));
            }
        }
        list.clear();
    }

    /// f has a side on another part of a lane.
    void follow(std::size_t lane, double side)
    {
        if (sides_[lane] == 0.0)
            sides_[lane] = side;
        else if (sides_[lane] != side)
            doubted_ |= LaneMask{1} << lane;
    }

    LaneMask set_hits(RayCertificate* certificates)
    {
        LaneMask lanes = 0;
        if (ends_.size() > 0)
            ends_.fill_up();
        for (std::size_t first = 0; first < ends_.size(); first += certified_width)
            lanes |=
                set_certified_hits<Degree>(surface_, placement_, lines_, ends_, first, sides_, t_hints_, certificates);
        return lanes;
    }

    const IsosurfaceSnapshot& surface_;
    const certified::Placement& placement_;
    const double* t_hints_;
    CertifiedLines lines_;
    CertifiedPartList parts_, undecided_, ends_;
    double sides_[packet_capacity] = {}; ///< of f before hits; 0 where nothing has one yet
    LaneMask doubted_ = 0;               ///< lanes in which f does not have one side
};

LaneMask certify(const IsosurfaceSnapshot& surface, const certified::Placement& placement, const RayPacket& rays,
                 LaneMask lanes, const double* t_hints, RayCertificate* certificates)
{
    const glm::ivec3 blocks = SideGrid::shape_of(*surface.shared_ranges(), surface.volume().cell_shape());
    if (place_count(blocks) > std::numeric_limits<std::int32_t>::max())
        return 0; // lanes look blocks up by such integers
    return dispatch_degree(surface.volume().degree(), [&](auto degree) {
        return PacketCertification<degree>(surface, placement, rays, lanes, t_hints).run(certificates);
    });
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(certify);

LaneMask certified::certify_packet(const IsosurfaceSnapshot& surface, const Placement& placement, const RayPacket& rays,
                                   LaneMask lanes, std::span<const double, packet_capacity> t_hints,
                                   std::span<RayCertificate, packet_capacity> certificates)
{
    return HWY_DYNAMIC_DISPATCH(certify)(surface, placement, rays, lanes, t_hints.data(), certificates.data());
}

} // namespace isospline
#endif
