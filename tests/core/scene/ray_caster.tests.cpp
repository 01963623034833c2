#include "isospline/scene/ray_caster.h"

#include "catch.h"

#include "counting_source.h"
#include "volumes.h"

#include "isospline/hopper/hopper.h"
#include "isospline/scene/absorption.h"
#include "isospline/scene/embree_ray.h"
#include "isospline/scene/scene.h"

#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

using namespace isospline;

namespace {

RayPacket packet_of(int count)
{
    RayPacket packet;
    packet.count = count;
    for (int lane = 0; lane < RayPacket::capacity; ++lane)
        packet.set(lane, {{-20.0, 5.0 + 0.5 * lane, 8.0}, {1.0, 0.0, 0.0}});
    return packet;
}

} // namespace

TEST_CASE("a caster that has thrown works again", "[scene]")
{
    const auto in_memory = noise_volume({20, 20, 20}, 2);
    Scene expected_scene;
    expected_scene.add(std::make_shared<Isosurface>(in_memory, 0.1));
    const auto expected_snapshot = expected_scene.snapshot();
    for (const auto kind : {RayCaster::Rays::incoherent, RayCaster::Rays::coherent}) {
        const auto source = std::make_shared<CountingSource>(in_memory);
        Scene scene;
        scene.add(std::make_shared<Isosurface>(volume_of(source, *in_memory), 0.1));
        const auto snapshot = scene.snapshot();
        RayCaster expected_caster(*expected_snapshot, kind), caster(*snapshot, kind);
        const RayPacket rays = packet_of(caster.width());
        std::array<Hit, RayPacket::capacity> expected, hits;
        const LaneMask expected_lanes = expected_caster.cast(rays, 0, expected);
        REQUIRE(expected_lanes != 0);

        source->refuse = true;
        REQUIRE_THROWS_AS(caster.cast(rays, 0, hits), CountingSource::Refusal);
        REQUIRE_THROWS_AS(caster.test_occlusions(rays, 0), CountingSource::Refusal);
        source->refuse = false;
        REQUIRE(caster.cast(rays, 0, hits) == expected_lanes);
        REQUIRE(caster.test_occlusions(rays, 0) == expected_lanes);
        for (std::size_t lane = 0; lane < hits.size(); ++lane)
            if ((expected_lanes >> lane & 1u) != 0)
                REQUIRE(hits[lane].t == expected[lane].t);
    }
}

TEST_CASE("a packet of more rays than its caster's width, or with fewer hits, is refused", "[scene]")
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(noise_volume({20, 20, 20}, 2), 0.1));
    const auto snapshot = scene.snapshot();
    for (const auto kind : {RayCaster::Rays::incoherent, RayCaster::Rays::coherent}) {
        RayCaster caster(*snapshot, kind);
        std::array<Hit, RayPacket::capacity + 1> hits;
        for (const int count : {caster.width() + 1, -1}) {
            REQUIRE_THROWS_AS(caster.cast(packet_of(count), 0, hits), std::invalid_argument);
            REQUIRE_THROWS_AS(caster.test_occlusions(packet_of(count), 0), std::invalid_argument);
        }
        const std::span<Hit> too_few(hits.data(), static_cast<std::size_t>(caster.width()) - 1);
        REQUIRE_THROWS_AS(caster.cast(packet_of(caster.width()), 0, too_few), std::invalid_argument);
        REQUIRE(caster.cast(packet_of(caster.width()), 0, hits) != 0);
    }
}

TEST_CASE("one output for each ray", "[scene]")
{
    Scene scene;
    const auto surface = std::make_shared<Isosurface>(noise_volume({20, 20, 20}, 2), 0.1);
    scene.add(surface);
    const auto snapshot = scene.snapshot();
    const std::vector<Ray> rays(3, packet_of(1).ray(0));
    for (const std::size_t count : {2u, 4u}) {
        std::vector<Hit> hits(count);
        for (const bool coherent : {false, true})
            REQUIRE_THROWS_AS(snapshot->cast_rays(rays, hits, coherent), std::invalid_argument);
        REQUIRE_THROWS_AS(VoxelHopper(surface->snapshot()).cast_rays(rays, hits), std::invalid_argument);
        std::vector<std::uint8_t> occluded(count);
        REQUIRE_THROWS_AS(snapshot->test_occlusions(rays, occluded), std::invalid_argument);
        std::vector<Crossing> crossings;
        std::vector<std::uint32_t> counts(count);
        REQUIRE_THROWS_AS(snapshot->list_intersections(rays, crossings, counts), std::invalid_argument);
        const Absorption opaque(
            *snapshot, [](std::uint32_t) { return 1.0; }, nullptr);
        std::vector<double> transmitted(count);
        REQUIRE_THROWS_AS(snapshot->attenuate_rays(rays, opaque, transmitted), std::invalid_argument);
    }
}

TEST_CASE("Embree gets rays that have hit nothing", "[scene]")
{
    RTCRayHit single;
    std::memset(static_cast<void*>(&single), 0x55, sizeof(single));
    set_ray(packet_of(1).ray(0), single);
    REQUIRE(single.hit.geomID == RTC_INVALID_GEOMETRY_ID);
    REQUIRE(single.hit.instID[0] == RTC_INVALID_GEOMETRY_ID);

    RTCRayHitNt<16> packet;
    std::memset(static_cast<void*>(&packet), 0x55, sizeof(packet));
    set_rays(PreparedPacket(), packet);
    for (int lane = 0; lane < 16; ++lane) {
        REQUIRE(packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID);
        REQUIRE(packet.hit.instID[0][lane] == RTC_INVALID_GEOMETRY_ID);
    }
}
