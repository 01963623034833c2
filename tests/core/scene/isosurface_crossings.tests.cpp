// Rays through lattice points, along edges, diagonals and planes of the lattice, and close to these, at a level that f
// takes there: each crossing belongs to one cell, in every kind of query. ISOSPLINE_TEST_RAYS sets the number of rays.
#include "catch.h"
#include "volumes.h"

#include "isospline/hopper/hopper.h"
#include "isospline/scene/scene.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

using namespace isospline;

namespace {

std::size_t crossing_ray_count()
{
    const char* const given = std::getenv("ISOSPLINE_TEST_RAYS");
    return given != nullptr ? std::strtoull(given, nullptr, 10) : 60'000;
}

/// Coefficients of 0, 1 and 2 in a frame of zeros, so that f is below 1 at the border of the volume.
std::shared_ptr<const Volume> random_integers(int degree, std::mt19937& random)
{
    const glm::ivec3 shape(9, 10, 11);
    std::vector<float> samples;
    for (int z = 0; z < shape.z; ++z)
        for (int y = 0; y < shape.y; ++y)
            for (int x = 0; x < shape.x; ++x) {
                const glm::ivec3 at(x, y, z);
                const bool inside =
                    glm::all(glm::greaterThanEqual(at, glm::ivec3(2))) && glm::all(glm::lessThan(at, shape - 2));
                samples.push_back(inside ? static_cast<float>(random() % 3) : 0.0f);
            }
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    return make_volume(samples, shape, options);
}

/// A ray that comes from outside of the volume and goes through all of it; every other one is degenerate.
Ray random_ray(std::mt19937& random, const Volume& volume)
{
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const glm::dvec3 shape(volume.cell_shape());
    const auto number = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
    const auto point = [&] { return shape * glm::dvec3(unit(random), unit(random), unit(random)); };
    const auto corner = [&] { return glm::floor(point() + 0.5); };

    glm::dvec3 through = point(), direction = point() - point();
    if (number(2) == 0)
        switch (number(6)) {
        case 0: // along an edge
            through = corner();
            direction = glm::dvec3(0.0);
            direction[number(3)] = 1.0;
            break;
        case 1: // along a diagonal of a face or of a cell
            through = corner();
            direction = {number(3) - 1, number(3) - 1, 1};
            break;
        case 2: // through corners
            through = corner();
            direction = corner() - through;
            break;
        case 3: { // in a plane of the lattice
            const int axis = number(3);
            through[axis] = std::floor(through[axis]);
            direction[axis] = 0.0;
            break;
        }
        case 4: // along an axis, near a plane
            direction = glm::dvec3(0.0);
            direction[number(3)] = 1.0;
            through = corner();
            through[number(3)] += (number(2) == 0 ? 1.0 : -1.0) * std::pow(10.0, -15.0 + 7.0 * unit(random));
            break;
        case 5: // nearly along an axis
            through = corner();
            direction *= std::pow(10.0, -12.0 * unit(random));
            direction[number(3)] = 1.0;
            break;
        }
    if (direction == glm::dvec3(0.0))
        direction.x = 1.0;
    direction *= (number(2) == 0 ? 1.0 : -1.0) / glm::length(direction);
    // The origin is far enough outside, and where it makes no difference exactly so.
    const glm::dvec3 lattice_to_index(volume.degree() % 2 == 0 ? -0.5 : 0.0);
    return {through - 64.0 * direction + lattice_to_index, direction};
}

} // namespace

TEST_CASE("rays alternately enter and leave, even at corners, edges and faces of cells", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    constexpr std::size_t rays_of_volume = 1000;
    std::mt19937 random(static_cast<unsigned>(degree));
    std::size_t crossing_count = 0;
    for (std::size_t done = 0; done < crossing_ray_count() / 3; done += rays_of_volume) {
        const auto volume = random_integers(degree, random);
        const auto surface = std::make_shared<Isosurface>(volume, 1.0);
        IsosurfaceOptions options;
        options.method = Method::reference;
        const auto reference = std::make_shared<Isosurface>(volume, 1.0, options);
        Scene scene, reference_scene;
        scene.add(surface);
        reference_scene.add(reference);
        const auto snapshot = scene.snapshot();

        std::vector<Ray> rays;
        for (std::size_t i = 0; i < rays_of_volume; ++i)
            rays.push_back(random_ray(random, *volume));
        std::vector<Crossing> crossings;
        std::vector<std::uint32_t> counts(rays.size());
        snapshot->list_intersections(rays, crossings, counts);
        crossing_count += crossings.size();

        std::vector<Hit> single(rays.size()), packet(rays.size()), by_reference(rays.size()), hopped(rays.size());
        snapshot->cast_rays(rays, single);
        snapshot->cast_rays(rays, packet, true);
        reference_scene.snapshot()->cast_rays(rays, by_reference);
        VoxelHopper(surface->snapshot()).cast_rays(rays, hopped);
        std::vector<std::uint8_t> occluded(rays.size()), occluded_in_packet(rays.size());
        snapshot->test_occlusions(rays, occluded);
        snapshot->test_occlusions(rays, occluded_in_packet, true);
        REQUIRE(occluded_in_packet == occluded);

        std::size_t wrong_turns = 0, wrong_signs = 0, differing_hits = 0;
        auto crossing = crossings.begin();
        for (std::size_t i = 0; i < rays.size(); ++i) {
            bool turns = counts[i] % 2 == 0;
            for (std::uint32_t k = 0; k < counts[i]; ++k) {
                const Crossing& at = crossing[k];
                turns = turns && at.entering == (k % 2 == 0) && (k == 0 || crossing[k - 1].hit.t <= at.hit.t);
                if (k + 1 == counts[i])
                    continue;
                // Points between two crossings are on the expected side, if this can be decided.
                const double value = volume->value(rays[i].at(0.5 * (at.hit.t + crossing[k + 1].hit.t))) - 1.0;
                wrong_signs += std::abs(value) > 1e-9 && (value > 0.0) != at.entering;
            }
            wrong_turns += !turns;

            for (const Hit& hit : {packet[i], by_reference[i], hopped[i]})
                differing_hits += hit.t != single[i].t || hit.geometry_id != single[i].geometry_id ||
                                  hit.primitive_id != single[i].primitive_id || hit.normal != single[i].normal ||
                                  hit.position != single[i].position;
            const double first_t = counts[i] > 0 ? crossing->hit.t : std::numeric_limits<double>::infinity();
            differing_hits += single[i].t != first_t || (occluded[i] != 0) != (counts[i] > 0);
            crossing += counts[i];
        }
        REQUIRE(wrong_turns == 0);
        REQUIRE(wrong_signs == 0);
        REQUIRE(differing_hits == 0);
    }
    REQUIRE(crossing_count > crossing_ray_count() / 5);
}

TEST_CASE("hopper and scene agree on rays along the border of a volume", "[scene]")
{
    VolumeOptions options;
    options.degree = GENERATE(1, 2, 3);
    options.filter = Filter::none;
    std::mt19937 random(11);
    std::normal_distribution<float> value;
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const glm::ivec3 shape(7, 6, 5);
    std::vector<float> samples(7 * 6 * 5);
    for (float& sample : samples)
        sample = value(random);
    const auto surface = std::make_shared<Isosurface>(make_volume(samples, shape, options), 0.1);
    Scene scene;
    scene.add(surface);
    const auto snapshot = scene.snapshot();
    const VoxelHopper hopper(surface->snapshot());

    const Box domain = surface->volume().bounds();
    std::size_t found = 0, beyond = 0;
    for (int i = 0; i < 20000; ++i) {
        // Parallel to one side of the box, or nearly so, at most 1e-7 from it on either side; some exactly on it.
        const int across = static_cast<int>(random() % 3);
        glm::dvec3 origin = domain.lower + domain.size() * glm::dvec3(unit(random), unit(random), unit(random));
        glm::dvec3 direction(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
        direction[across] = i % 3 == 0 ? 1e-9 * unit(random) : 0.0;
        const double off =
            i % 4 == 0 ? 0.0 : (unit(random) < 0.5 ? 1.0 : -1.0) * std::pow(10.0, -7.0 - 9.0 * unit(random));
        origin[across] = (unit(random) < 0.5 ? domain.lower : domain.upper)[across] + off;
        const Ray ray{origin - 20.0 * direction / glm::length(direction), direction};
        Hit hit, hopped;
        snapshot->cast_rays({&ray, 1}, {&hit, 1});
        hopper.cast_rays({&ray, 1}, {&hopped, 1});
        REQUIRE(hit.t == hopped.t);
        REQUIRE(hit.primitive_id == hopped.primitive_id);
        REQUIRE(hit.normal == hopped.normal);
        found += static_cast<bool>(hit);
        const bool is_outside = direction[across] == 0.0 && (origin[across] < domain.lower[across] - 1e-12 ||
                                                             origin[across] > domain.upper[across] + 1e-12);
        beyond += is_outside && hit;
    }
    REQUIRE(found > 5000);
    REQUIRE(beyond == 0);
}

TEST_CASE("limits that equal a hit's t include the hit", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    std::mt19937 random(7);
    const auto volume = random_integers(degree, random);
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, 0.83));
    const auto snapshot = scene.snapshot();
    std::size_t found = 0;
    for (int i = 0; i < 2000; ++i) {
        Ray ray = random_ray(random, *volume);
        ray.direction *= 0.37;
        Hit hit, again;
        snapshot->cast_rays({&ray, 1}, {&hit, 1});
        if (!hit)
            continue;
        ++found;
        for (const auto& [t_near, t_far] : {std::pair(hit.t, hit.t), std::pair(0.0, hit.t), std::pair(hit.t, 1e9)}) {
            ray.t_near = t_near;
            ray.t_far = t_far;
            for (const bool coherent : {false, true}) {
                snapshot->cast_rays({&ray, 1}, {&again, 1}, coherent);
                REQUIRE(again.t == hit.t);
                REQUIRE(again.primitive_id == hit.primitive_id);
            }
            for (const bool coherent : {false, true}) {
                std::uint8_t occluded = 0;
                snapshot->test_occlusions({&ray, 1}, {&occluded, 1}, coherent);
                REQUIRE(occluded == 1);
            }
        }
        ray.t_near = 0.0;
        ray.t_far = std::nextafter(hit.t, 0.0);
        snapshot->cast_rays({&ray, 1}, {&again, 1});
        REQUIRE_FALSE(again);
    }
    REQUIRE(found > 500);
}
