#include "catch.h"
#include "each_target.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/cell/intersector.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/certified_ray.h"

#include <glm/mat4x4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace isospline;

namespace {

constexpr std::size_t capacity = RayPacket::capacity;

/// A certificate of one ray, and the hint that a packet gets: where the ray hits, or near it, or none.
struct Known {
    Ray ray;
    RayCertificate certificate;
    double t_hint;
};

std::vector<Known> known_rays(const RayCertifier& certifier, const glm::dvec3& shape, std::size_t count)
{
    std::mt19937 random(5);
    std::vector<Known> rays;
    for (std::size_t i = 0; i < count; ++i) {
        Known known{random_lattice_ray(random, shape), {}, std::numeric_limits<double>::infinity()};
        if (i % 5 == 0)
            known.ray.t_far = 2.0;
        known.certificate = certifier.certify(known.ray);
        const RayCertificate& one = known.certificate;
        if (one.status == RayStatus::hit && i % 7 != 0)
            known.t_hint = i % 11 == 0 ? one.t_lower + 0.01 : 0.5 * (one.t_lower + one.t_upper);
        rays.push_back(known);
    }
    return rays;
}

/// Two proofs of one ray do not contradict each other.
void check_agreement(const RayCertificate& one, const RayCertificate& other)
{
    REQUIRE(one.status == other.status);
    if (one.status != RayStatus::hit)
        return;
    REQUIRE(std::max(one.t_lower, other.t_lower) <= std::min(one.t_upper, other.t_upper));
    REQUIRE(std::acos(std::min(1.0, glm::dot(one.normal, other.normal))) <=
            one.normal_angle + other.normal_angle + 1e-7);
}

} // namespace

TEST_CASE("proofs of packets agree with those of single rays", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    VolumeOptions options;
    options.degree = degree;
    const glm::ivec3 shape(50, 21, 34);
    const Isosurface surface(noise_volume(shape, options), 0.6);
    const RayCertifier certifier(surface.snapshot(), glm::dmat4(1.0));
    const std::vector<Known> rays = known_rays(certifier, glm::dvec3(shape), 200 * capacity);
    std::array<std::size_t, 3> counts{};
    for (const Known& known : rays)
        ++counts[static_cast<std::size_t>(known.certificate.status)];
    REQUIRE(*std::min_element(counts.begin(), counts.begin() + 2) > rays.size() / 10);
    for_each_target([&] {
        for (std::size_t first = 0; first < rays.size(); first += capacity) {
            RayPacket packet;
            packet.count = static_cast<int>(capacity) - (first % 3 == 0 ? 5 : 0);
            std::array<double, capacity> t_hints{};
            for (std::size_t lane = 0; lane < capacity; ++lane) {
                packet.set(static_cast<int>(lane), rays[first + lane].ray);
                t_hints[lane] = rays[first + lane].t_hint;
            }
            const LaneMask lanes = ((LaneMask{1} << packet.count) - 1) & ~LaneMask{2};
            std::array<RayCertificate, capacity> certificates;
            certificates.fill({RayStatus::undecided, -1.0, -1.0});
            certifier.certify(packet, lanes, t_hints, certificates);
            for (std::size_t lane = 0; lane < capacity; ++lane)
                if ((lanes >> lane & 1u) != 0)
                    check_agreement(certificates[lane], rays[first + lane].certificate);
                else
                    REQUIRE(certificates[lane].t_lower == -1.0);
        }
    });
}
