#include "catch.h"

#include "isospline/trace/prepared_ray.h"

#include <glm/geometric.hpp>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

using namespace isospline;

namespace {

bool same_bits(const PreparedRay& a, const PreparedRay& b)
{
    const auto same = [](double x, double y) {
        return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
    };
    bool all = same(a.ray.t_near, b.ray.t_near) && same(a.ray.t_far, b.ray.t_far) &&
               same(a.limits.shift, b.limits.shift) && same(a.limits.length, b.limits.length);
    for (int axis = 0; axis < 3; ++axis)
        all = all && same(a.ray.origin[axis], b.ray.origin[axis]) && same(a.ray.direction[axis], b.ray.direction[axis]);
    return all;
}

} // namespace

TEST_CASE("packets of rays are prepared as single rays are, bit for bit", "[trace]")
{
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto vector = [&](auto& distribution) {
        return glm::dvec3(distribution(random), distribution(random), distribution(random));
    };
    int inside_count = 0, miss_count = 0, grazing_count = 0;
    for (int trial = 0; trial < 25000; ++trial) {
        const glm::dvec3 centre = 100.0 * vector(uniform), size = glm::abs(vector(normal)) + 0.1;
        const RayFrame frame(Box{centre - size, centre + size});
        const int kind = trial % 5;
        const double distance = std::pow(10.0, 4.0 * uniform(random) + 2.0),
                     scale = std::pow(10.0, 3.0 * uniform(random));
        RayPacket packet;
        packet.count = 1 + trial % RayPacket::capacity;
        for (int lane = 0; lane < packet.count; ++lane) {
            // At any place in or near the box; at its edges, which rounding decides about; away from it; along an axis;
            // from a place on a face or some roundings off it, and away from it.
            glm::dvec3 target = centre + 1.5 * size * vector(uniform);
            glm::dvec3 direction = vector(normal);
            if (kind == 1) {
                const glm::dvec3 half = frame.box.upper;
                target = frame.centre +
                         glm::dvec3(uniform(random) < 0.0 ? half.x : -half.x, half.y, uniform(random) * half.z);
            } else if (kind == 2) {
                target += 20.0 * glm::length(size) * vector(uniform);
            } else if (kind == 3) {
                direction = glm::dvec3(0.0);
                direction[trial % 3] = uniform(random);
            } else if (kind == 4) {
                const int axis = trial % 3;
                const double side = uniform(random) < 0.0 ? -1.0 : 1.0;
                const double off = frame.box.upper[axis] * (1.0 + std::round(40.0 * uniform(random)) * 0x1p-52);
                target[axis] = frame.centre[axis] + side * off;
                direction[axis] = side * std::abs(direction[axis]) * std::pow(10.0, 8.0 * uniform(random) - 8.0);
            }
            const glm::dvec3 origin = kind == 4 ? target : target - distance * direction;
            packet.set(lane, {origin, scale * direction, lane % 3 == 0 ? -1.0 : 0.0,
                              lane % 5 == 0 ? 1e3 : std::numeric_limits<double>::infinity()});
        }
        PreparedPacket prepared;
        const LaneMask inside = prepare_packet(packet, 0, frame, prepared);
        REQUIRE(inside >> packet.count == 0);
        for (int lane = 0; lane < packet.count; ++lane) {
            PreparedRay single;
            const bool hits_box = prepare(packet.ray(lane), 0, frame, single);
            REQUIRE(hits_box == ((inside >> lane & 1u) != 0));
            if (hits_box)
                REQUIRE(same_bits(single, prepared[lane]));
            ++(hits_box ? inside_count : miss_count);
            grazing_count += kind == 1 && hits_box;
        }
    }
    REQUIRE(inside_count > 20000);
    REQUIRE(miss_count > 20000);
    REQUIRE(grazing_count > 1000);
}

TEST_CASE("rays that cannot be cast are named, also among those that miss", "[trace]")
{
    const RayFrame frame(Box{glm::dvec3(-1.0), glm::dvec3(1.0)});
    constexpr double infinity = std::numeric_limits<double>::infinity();
    for (const Ray& bad :
         {Ray{{5, 5, 5}, {0, 0, 0}}, Ray{{5, 5, std::nan("")}, {1, 0, 0}}, Ray{{infinity, 5, 5}, {1, 0, 0}},
          Ray{{5, 5, 5}, {0, infinity, 0}}, Ray{{5, 5, 5}, {0, 1e200, 0}}, Ray{{5, 5, 5}, {1e-320, 0, 0}},
          Ray{{5, 5, 5}, {1e-170, 0, 0}}}) {
        for (const bool others_miss : {true, false}) {
            RayPacket packet;
            packet.count = 9;
            for (int lane = 0; lane < packet.count; ++lane)
                packet.set(lane, {{5, 5, 5}, others_miss ? glm::dvec3(1, 0, 0) : glm::dvec3(-1, -1, -1)});
            packet.set(6, bad);
            PreparedPacket prepared;
            REQUIRE_THROWS_WITH(prepare_packet(packet, 100, frame, prepared), ContainsSubstring("in ray 106"));
            PreparedRay single;
            REQUIRE_THROWS_WITH(prepare(bad, 106, frame, single), ContainsSubstring("in ray 106"));
        }
    }
}
