#include "catch.h"
#include "random_rays.h"

#include "isospline/cell/intersector.h"
#include "isospline/hopper/hopper.h"
#include "isospline/trace/prepared_ray.h"

#include "isospline/math/affine.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

using namespace isospline;

namespace {

using std::numbers::pi;

/// A volume whose coefficients are a function of the index.
template <typename Function>
std::shared_ptr<const Volume> make_volume(const glm::ivec3& shape, VolumeOptions options, const Function& f)
{
    std::vector<float> samples;
    for (int z = 0; z < shape.z; ++z)
        for (int y = 0; y < shape.y; ++y)
            for (int x = 0; x < shape.x; ++x)
                samples.push_back(static_cast<float>(f(glm::dvec3(x, y, z))));
    options.filter = Filter::none;
    const std::ptrdiff_t size = sizeof(float);
    const SampleView view{samples.data(), SampleType::float32, shape, {size, size * shape.x, size * shape.x * shape.y}};
    return std::make_shared<const Volume>(view, options);
}

/// A small ball and a wavy sheet in much empty space, so that there are bricks to stride over.
std::shared_ptr<const Volume> ball_and_sheet(VolumeOptions options)
{
    return make_volume({41, 30, 27}, options, [](const glm::dvec3& k) {
        const double ball = 5.0 - glm::length(k - glm::dvec3(30.0, 15.0, 12.0));
        const double sheet = 3.0 + 2.0 * std::sin(0.4 * k.y) * std::cos(0.5 * k.z) - k.x;
        return std::max(ball, sheet);
    });
}

std::shared_ptr<const Volume> noise(VolumeOptions options)
{
    std::mt19937 random(5);
    std::normal_distribution<double> value;
    return make_volume({11, 9, 10}, options, [&](const glm::dvec3&) { return value(random); });
}

/// The first crossing, by testing every cell of the shell; of crossings at the same t, the one with the smallest id.
struct BruteForce {
    double t = std::numeric_limits<double>::infinity();
    std::uint64_t primitive = invalid_primitive_id;

    BruteForce(const IsosurfaceSnapshot& surface, const Ray& ray_world)
    {
        const Volume& volume = surface.volume();
        const RayFrame frame(transform_box(volume.lattice_to_world(), domain_lattice(volume)));
        PreparedRay prepared;
        if (!prepare(ray_world, 0, frame, prepared))
            return;
        LatticeRay ray = to_lattice(prepared, centred_to_local(volume.lattice_to_world(), frame), volume.cell_shape());
        const auto inside = clip({ray.origin, ray.direction, ray.t_near, ray.t_far}, surface.clip_lattice());
        if (!inside)
            return;
        ray.t_near = inside->t_near;
        ray.t_far = inside->t_far;
        const auto first_root = cell_intersector(volume.degree(), surface.options().method).first_root;
        double nearest = std::numeric_limits<double>::infinity();
        for (const Cell& cell : surface.shell().cells()) {
            const auto root = first_root(VolumeCell(volume, surface.threshold(), cell), ray);
            const std::uint64_t id = volume.primitive_id(cell);
            if (!root || root->t > nearest || (root->t == nearest && id > primitive))
                continue;
            nearest = root->t;
            t = ray.limits.given_t(nearest);
            primitive = id;
        }
    }
};

void check_against_brute_force(const std::shared_ptr<const IsosurfaceSnapshot>& surface, int count)
{
    const VoxelHopper plain(surface), striding(surface, {true});
    const Volume& volume = surface->volume();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> limit(0.0, 1.0);
    int found = 0;
    for (int i = 0; i < count; ++i) {
        Ray ray_lattice = random_lattice_ray(random, volume.cell_shape());
        if (i % 3 == 0) {
            ray_lattice.t_near = limit(random);
            ray_lattice.t_far = ray_lattice.t_near + 3.0 * limit(random);
        }
        Ray ray = ray_lattice;
        ray.origin = transform_point(volume.lattice_to_world(), ray_lattice.origin);
        ray.direction = transform_vector(volume.lattice_to_world(), ray_lattice.direction);

        const BruteForce expected(*surface, ray);
        for (const VoxelHopper* hopper : {&plain, &striding}) {
            Hit hit;
            hopper->cast_rays({&ray, 1}, {&hit, 1});
            REQUIRE(static_cast<bool>(hit) == std::isfinite(expected.t));
            if (!hit)
                continue;
            ++found;
            REQUIRE(hit.t == expected.t);
            REQUIRE(hit.geometry_id == 0);
            REQUIRE(hit.primitive_id == expected.primitive);
            REQUIRE(glm::length(hit.position - ray.at(hit.t)) < 1e-12);
            REQUIRE(glm::length(hit.normal) == Approx(1.0));
        }
    }
    REQUIRE(found > count / 4);
}

} // namespace

TEST_CASE("the hopper finds the same as a test of every cell", "[hopper]")
{
    VolumeOptions options;
    options.degree = GENERATE(1, 2, 3);
    options.boundary = GENERATE(Boundary::mirror, Boundary::periodic);
    IsosurfaceOptions surface_options;
    surface_options.method = GENERATE(Method::exact, Method::bracket);
    check_against_brute_force(Isosurface(noise(options), 0.2, surface_options).snapshot(), 400);
    check_against_brute_force(Isosurface(ball_and_sheet(options), 0.1, surface_options).snapshot(), 100);
}

TEST_CASE("the hopper finds the same as a test of every cell, for rotated, mirrored and cut volumes", "[hopper]")
{
    VolumeOptions options;
    options.spacing = {0.5, 1.2, 2.0};
    options.origin = {-100.0, 3.0, 40.0};
    options.direction = glm::dmat3({0.8, 0.6, 0.0}, {0.6, -0.8, 0.0}, {0.0, 0.0, 1.0});
    const auto volume = noise(options);
    IsosurfaceOptions surface_options;
    surface_options.clip = {{{0.3, 0.2, 0.1}, glm::dot({0.3, 0.2, 0.1}, volume->bounds().center())}};
    check_against_brute_force(Isosurface(volume, 0.1, surface_options).snapshot(), 600);
}

TEST_CASE("the normal of a hopper's hit is the outward gradient", "[hopper]")
{
    const auto volume = ball_and_sheet({});
    const auto surface = Isosurface(volume, 0.0).snapshot();
    const Ray ray{{20.0, 15.0, 12.0}, {1.0, 0.01, 0.02}};
    Hit hit;
    VoxelHopper(surface).cast_rays({&ray, 1}, {&hit, 1});
    REQUIRE(hit);
    const glm::dvec3 gradient = volume->gradient(hit.position);
    REQUIRE(hit.gradient_magnitude == Approx(glm::length(gradient)));
    REQUIRE(glm::length(hit.normal + gradient / glm::length(gradient)) < 1e-9);
    REQUIRE(volume->value(hit.position) == Approx(0.0).margin(1e-9));
}

TEST_CASE("hops are as long as the mean chord of a cube", "[hopper]")
{
    // No cell belongs to the shell: every ray hops through all of the grid.
    const auto volume = make_volume({12, 10, 8}, {}, [](const glm::dvec3& k) { return k.x; });
    const VoxelHopper hopper(Isosurface(volume, 1e3).snapshot());
    const glm::dvec3 center = volume->bounds().center();
    const double radius = 0.5 * glm::length(volume->bounds().size());
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);

    const auto mean_hop_length = [&](const auto& direction) {
        std::vector<Ray> rays(100000);
        std::vector<Hit> hits(rays.size());
        for (Ray& ray : rays) {
            // A line in the direction, uniform over a disk that it is normal to.
            ray.direction = direction();
            const glm::dvec3 other = std::abs(ray.direction.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
            const glm::dvec3 u = glm::normalize(glm::cross(ray.direction, other)), v = glm::cross(ray.direction, u);
            const double r = radius * std::sqrt(unit(random)), angle = 2.0 * pi * unit(random);
            ray.origin = center + r * std::cos(angle) * u + r * std::sin(angle) * v - 2.0 * radius * ray.direction;
        }
        const HopStatistics statistics = hopper.cast_rays(rays, hits);
        REQUIRE(statistics.evaluated_cells == 0);
        REQUIRE(statistics.strides == 0);
        return statistics.mean_hop_length();
    };

    // Cauchy: 4 V / S over all lines.
    const double isotropic = mean_hop_length([&] {
        const double z = 2.0 * unit(random) - 1.0, angle = 2.0 * pi * unit(random), r = std::sqrt(1.0 - z * z);
        return glm::dvec3(r * std::cos(angle), r * std::sin(angle), z);
    });
    REQUIRE(isotropic == Approx(2.0 / 3.0).margin(2e-3));

    // Volume over the area of the shadow, for parallel lines.
    for (const glm::dvec3& d : {glm::dvec3(1, 1, 1), glm::dvec3(1, 0, 0), glm::dvec3(3, -2, 1)}) {
        const glm::dvec3 direction = glm::normalize(d);
        const double expected = 1.0 / (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z));
        REQUIRE(mean_hop_length([&] { return direction; }) == Approx(expected).margin(2e-3));
    }
}

TEST_CASE("strides take fewer moves to the same cells", "[hopper]")
{
    const auto surface = Isosurface(ball_and_sheet({}), 0.0).snapshot();
    std::mt19937 random(9);
    std::vector<Ray> rays(500);
    for (Ray& ray : rays) {
        ray = random_lattice_ray(random, surface->volume().cell_shape());
        ray.origin -= 0.5;
    }
    std::vector<Hit> hits(rays.size());
    const HopStatistics plain = VoxelHopper(surface).cast_rays(rays, hits);
    const HopStatistics striding = VoxelHopper(surface, {true}).cast_rays(rays, hits);
    REQUIRE(plain.strides == 0);
    REQUIRE(striding.strides > 0);
    REQUIRE(2 * (striding.hops + striding.strides) < plain.hops);
    REQUIRE(striding.length == Approx(plain.length));
    REQUIRE(striding.mean_hop_length() > 2.0 * plain.mean_hop_length());
}

TEST_CASE("a hopper keeps the level that its surface had", "[hopper]")
{
    Isosurface surface(ball_and_sheet({}), 0.0);
    const VoxelHopper before(surface.snapshot());
    surface.set_level(3.0);
    const VoxelHopper after(surface.snapshot());
    const Ray ray{{20.0, 15.0, 12.0}, {1.0, 0.0, 0.0}};
    Hit hit;
    before.cast_rays({&ray, 1}, {&hit, 1});
    REQUIRE(hit.t == Approx(5.0).margin(0.2));
    after.cast_rays({&ray, 1}, {&hit, 1});
    REQUIRE(hit.t == Approx(8.0).margin(0.2));
}

TEST_CASE("the hopper refuses invalid rays", "[hopper]")
{
    const VoxelHopper hopper(Isosurface(ball_and_sheet({}), 0.0).snapshot());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Hit hit;
    for (const Ray& ray : {Ray{{0, 0, 0}, {0, 0, 0}}, Ray{{0, nan, 0}, {1, 0, 0}}, Ray{{0, 0, 0}, {1, nan, 0}}})
        REQUIRE_THROWS_AS(hopper.cast_rays({&ray, 1}, {&hit, 1}), std::invalid_argument);
}

TEST_CASE("the hopper refuses no surface, and one with caps", "[hopper]")
{
    IsosurfaceOptions closed;
    closed.closed = true;
    REQUIRE_THROWS_AS(VoxelHopper(nullptr), std::invalid_argument);
    REQUIRE_THROWS_AS(VoxelHopper(Isosurface(ball_and_sheet({}), 0.0, closed).snapshot()), std::invalid_argument);
}
