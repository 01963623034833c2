#include "isospline/cell/packet_clip.h"

#include "catch.h"

#include <cstddef>
#include <optional>
#include <random>
#include <vector>

using namespace isospline;

TEST_CASE("rays of packets are clipped as single ones, bit for bit", "[cell]")
{
    std::mt19937 random(7);
    std::uniform_int_distribution<int> whole(-3, 3);
    std::uniform_real_distribution<double> real(-3.0, 3.0);
    const auto any = [&] { return random() % 2 == 0 ? static_cast<double>(whole(random)) : real(random); };
    int count = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        std::vector<HalfSpace> planes = half_spaces({glm::dvec3(-2.0), glm::dvec3(2.0)});
        for (int i = trial % 4; i > 0; --i)
            planes.push_back(random() % 3 == 0 ? planes[random() % planes.size()]
                                               : HalfSpace{{any(), any(), any()}, any()});
        LatticeRayPacket rays;
        for (int lane = 0; lane < packet_capacity; ++lane) {
            for (int axis = 0; axis < 3; ++axis) {
                rays.origin[axis][lane] = any();
                rays.direction[axis][lane] = random() % 4 == 0 ? 0.0 : any();
            }
            rays.t_near[lane] = random() % 2 == 0 ? 0.0 : any();
            rays.t_far[lane] = rays.t_near[lane] + 4.0;
        }
        const LatticeRayPacket given = rays;
        const LaneMask lanes = static_cast<LaneMask>(random()) & 0xffffu;
        PlanesOfChords through;
        const LaneMask left = clip(rays, lanes, planes, through);
        for (int lane = 0; lane < packet_capacity; ++lane) {
            const std::optional<Chord> chord =
                clip({given.origin_of(lane), given.direction_of(lane), given.t_near[lane], given.t_far[lane]}, planes);
            const bool is_left = (left >> lane & 1u) != 0;
            REQUIRE(is_left == (chord && (lanes >> lane & 1u) != 0));
            if (!is_left)
                continue;
            ++count;
            REQUIRE(rays.t_near[lane] == chord->t_near);
            REQUIRE(rays.t_far[lane] == chord->t_far);
            REQUIRE(through.entry_of(lane) == chord->entry);
            REQUIRE(through.exit_of(lane) == chord->exit);
        }
    }
    REQUIRE(count > 2000);
}
