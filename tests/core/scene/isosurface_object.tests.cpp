// Which coefficients of a surface the queries of a scene request, and when.
#include "catch.h"
#include "counting_source.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/scene/scene.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

using namespace isospline;

namespace {

/// A shell of the ball around the middle: rays from outside see only a part of the surface.
std::shared_ptr<const Volume> hollow_ball(int size, int degree)
{
    std::vector<float> samples;
    for (int z = 0; z < size; ++z)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const double r = glm::length(glm::dvec3(x, y, z) - 0.5 * (size - 1));
                samples.push_back(static_cast<float>(std::cos(r) + 0.02 * std::sin(1.3 * x) * std::cos(0.7 * y)));
            }
    VolumeOptions options;
    options.degree = degree;
    return make_volume(samples, glm::ivec3(size), options);
}

std::shared_ptr<Isosurface> surface_of(const std::shared_ptr<const Volume>& volume, IsosurfaceOptions options = {})
{
    return std::make_shared<Isosurface>(volume, 0.3, std::move(options));
}

std::vector<Ray> random_rays(const Volume& volume, std::size_t count)
{
    std::mt19937 random(4);
    std::vector<Ray> rays;
    while (rays.size() < count) {
        Ray ray = random_lattice_ray(random, volume.cell_shape());
        ray.origin = transform_point(volume.lattice_to_world(), ray.origin);
        ray.direction = transform_vector(volume.lattice_to_world(), ray.direction);
        rays.push_back(ray);
    }
    return rays;
}

/// All answers of a scene for some rays.
struct Answers {
    Answers(const SceneSnapshot& scene, std::span<const Ray> rays)
        : single(rays.size()), packet(rays.size()), occluded(rays.size()), occluded_in_packet(rays.size()),
          counts(rays.size())
    {
        scene.cast_rays(rays, packet, true);
        scene.cast_rays(rays, single);
        scene.test_occlusions(rays, occluded);
        scene.test_occlusions(rays, occluded_in_packet, true);
        scene.list_intersections(rays, crossings, counts);
    }

    static bool are_same(const Hit& a, const Hit& b)
    {
        return a.t == b.t && a.geometry_id == b.geometry_id && a.primitive_id == b.primitive_id &&
               a.position == b.position && a.normal == b.normal && a.gradient_magnitude == b.gradient_magnitude;
    }

    bool operator==(const Answers& other) const
    {
        return std::equal(single.begin(), single.end(), other.single.begin(), other.single.end(), are_same) &&
               std::equal(packet.begin(), packet.end(), other.packet.begin(), other.packet.end(), are_same) &&
               std::equal(crossings.begin(), crossings.end(), other.crossings.begin(), other.crossings.end(),
                          [](const Crossing& a, const Crossing& b) {
                              return are_same(a.hit, b.hit) && a.entering == b.entering;
                          }) &&
               occluded == other.occluded && occluded_in_packet == other.occluded && counts == other.counts;
    }

    std::vector<Hit> single, packet;
    std::vector<std::uint8_t> occluded, occluded_in_packet;
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts;
};

/// Answers of a new scene.
Answers answers(const std::shared_ptr<const Isosurface>& surface, std::span<const Ray> rays)
{
    Scene scene;
    scene.add(surface);
    return {*scene.snapshot(), rays};
}

} // namespace

TEST_CASE("coefficients of another source give the same hits", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = hollow_ball(41, degree);
    const std::vector<Ray> rays = random_rays(*volume, 2000);
    IsosurfaceOptions options;
    options.clip = {{{1.0, 0.5, 0.2}, 25.0}};
    options.capped = GENERATE(false, true);
    const auto source = std::make_shared<CountingSource>(volume);
    const Answers expected = answers(surface_of(volume, options), rays);
    REQUIRE((answers(surface_of(volume_of(source, *volume), options), rays) == expected));
    REQUIRE(source->asked() > 0);
    REQUIRE(std::count_if(expected.single.begin(), expected.single.end(), [](const Hit& hit) { return bool(hit); }) >
            1000);
}

TEST_CASE("the bricks that rays meet are requested once from a source", "[scene]")
{
    const auto volume = hollow_ball(60, 2);
    const auto source = std::make_shared<CountingSource>(volume);
    const auto surface = surface_of(volume_of(source, *volume));
    Scene scene;
    scene.add(surface);
    const auto snapshot = scene.snapshot();
    const std::size_t memory = snapshot->memory();
    REQUIRE(source->asked() == 0);

    // A narrow beam, and a ray at a time.
    std::mt19937 random(8);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    const glm::dvec3 middle(29.5);
    std::vector<Ray> rays;
    for (int i = 0; i < 64; ++i) {
        const glm::dvec3 eye(-50.0, 10.0, 20.0);
        rays.push_back({eye, middle + 6.0 * glm::dvec3(unit(random), unit(random), unit(random)) - eye});
    }
    std::vector<Hit> hits(rays.size());
    snapshot->cast_rays(rays, hits);
    const auto is_met = [&](const glm::ivec3& first) {
        // Index space, and the margin of boxes.
        const Box box{glm::dvec3(first) - 0.51, glm::dvec3(first) + 7.51};
        return std::any_of(rays.begin(), rays.end(), [&](const Ray& ray) { return clip(ray, box).has_value(); });
    };
    const std::vector<glm::ivec3> asked = source->bricks();
    REQUIRE(!asked.empty());
    REQUIRE(source->asked() == asked.size());
    for (const glm::ivec3& first : asked)
        REQUIRE(is_met(first));

    // Bricks behind the first sheet are not requested.
    std::size_t met = 0;
    const Bricks& bricks = surface->snapshot()->bricks();
    for (const Octet& octet : bricks.octets())
        for (int child = 0; child < 8; ++child)
            met += (octet.bricks >> child & 1) != 0 && is_met(bricks.place(octet, child).first);
    REQUIRE(2 * asked.size() < met);
    REQUIRE(4 * met < bricks.count());
    REQUIRE(snapshot->memory() > memory);

    // The same rays ask for nothing more; a new level begins with nothing.
    const std::size_t memory_after = snapshot->memory();
    snapshot->cast_rays(rays, hits);
    REQUIRE(source->asked() == asked.size());
    REQUIRE(snapshot->memory() == memory_after);
    surface->set_level(0.2);
    const auto changed = scene.snapshot();
    REQUIRE(source->asked() == asked.size());
    changed->cast_rays(rays, hits, true);
    REQUIRE(source->asked() > asked.size());
}

// Far fewer than a ray through the ball meets, so that every octet makes some anew.
TEST_CASE("bricks that exceed a budget are dropped, and hits stay the same", "[scene][threads]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = hollow_ball(60, degree);
    const std::vector<Ray> rays = random_rays(*volume, 2000);
    const Answers expected = answers(surface_of(volume), rays);
    constexpr std::size_t limit = 100'000, most_of_octet = 8 * 12'000;
    const auto source = std::make_shared<CountingSource>(volume, limit);
    const auto surface = surface_of(volume_of(source, *volume));
    Scene scene;
    scene.add(surface);
    const auto snapshot = scene.snapshot();
    std::vector<std::thread> threads;
    std::vector<std::uint8_t> is_same(4);
    for (std::size_t thread = 0; thread < is_same.size(); ++thread)
        threads.emplace_back([&, thread] { is_same[thread] = Answers(*snapshot, rays) == expected; });
    for (std::thread& thread : threads)
        thread.join();
    REQUIRE(is_same == std::vector<std::uint8_t>(4, 1));
    REQUIRE(source->budget()->dropped() > 100);
    REQUIRE(source->budget()->held() <= limit + 2 * (is_same.size() + 2) * most_of_octet);
    REQUIRE(surface->snapshot()->bricks().memory() >= source->budget()->held());
}

TEST_CASE("an exception of a source ends the query, and everything can be used afterwards", "[scene]")
{
    const auto volume = hollow_ball(41, 2);
    const std::vector<Ray> rays = random_rays(*volume, 500);
    const Answers expected = answers(surface_of(volume), rays);
    const auto source = std::make_shared<CountingSource>(volume);
    const auto surface = surface_of(volume_of(source, *volume));
    Scene scene;
    scene.add(surface);

    // Refused at once, and after other rays have had what they need.
    for (const std::size_t before : {std::size_t{0}, std::size_t{20}}) {
        surface->set_level(0.3);
        const auto snapshot = scene.snapshot();
        const Answers answers_before(*snapshot, std::span(rays).first(before));
        source->refuse = true;
        std::vector<Hit> hits(rays.size());
        std::vector<std::uint8_t> occluded(rays.size());
        std::vector<Crossing> crossings;
        std::vector<std::uint32_t> counts(rays.size());
        for (int repetition = 0; repetition < 2; ++repetition) {
            REQUIRE_THROWS_AS(snapshot->cast_rays(rays, hits), CountingSource::Refusal);
            REQUIRE_THROWS_AS(snapshot->cast_rays(rays, hits, true), CountingSource::Refusal);
            REQUIRE_THROWS_AS(snapshot->test_occlusions(rays, occluded), CountingSource::Refusal);
            REQUIRE_THROWS_AS(snapshot->test_occlusions(rays, occluded, true), CountingSource::Refusal);
            REQUIRE_THROWS_AS(snapshot->list_intersections(rays, crossings, counts), CountingSource::Refusal);
            REQUIRE_THROWS_AS(surface->snapshot()->shell(), CountingSource::Refusal);
            REQUIRE_THROWS_AS(surface->snapshot()->bounds_lattice(), CountingSource::Refusal);
            REQUIRE_THROWS_AS(surface->snapshot()->is_empty(), CountingSource::Refusal);
        }
        source->refuse = false;
        REQUIRE((Answers(*snapshot, rays) == expected));
        REQUIRE((surface->snapshot()->shell().cells() == surface_of(volume)->snapshot()->shell().cells()));
        REQUIRE(!surface->snapshot()->is_empty());
    }
}

TEST_CASE("many threads that enter the same bricks find the same as one thread", "[scene][threads]")
{
    const int degree = GENERATE(1, 2, 3);
    const auto volume = noise_volume({30, 25, 20}, degree);
    const std::vector<Ray> rays = random_rays(*volume, 256);
    const Answers expected = answers(surface_of(volume), rays);
    for (int repetition = 0; repetition < 5; ++repetition) {
        Scene scene;
        scene.add(surface_of(volume));
        const auto snapshot = scene.snapshot();
        std::vector<std::uint8_t> is_same(8);
        std::vector<std::thread> threads;
        for (std::uint8_t& same : is_same)
            threads.emplace_back([&] { same = Answers(*snapshot, rays) == expected; });
        for (std::thread& thread : threads)
            thread.join();
        REQUIRE(is_same == std::vector<std::uint8_t>(8, 1));
    }
}
