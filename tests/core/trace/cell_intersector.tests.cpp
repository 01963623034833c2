#include "catch.h"

#include "isospline/trace/cell_group.h"
#include "isospline/trace/cell_intersector.h"
#include "isospline/trace/ray_polynomial.h"
#include "isospline/trace/surface_hit.h"

#include <glm/geometric.hpp>

#include <hwy/highway.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace isospline;

namespace {

/// A volume whose coefficients are the given samples.
Volume volume_of_coefficients(const std::vector<float>& samples, glm::ivec3 shape, int degree)
{
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    const std::ptrdiff_t size = sizeof(float);
    return Volume({samples.data(), SampleType::float32, shape, {size, size * shape.x, size * shape.x * shape.y}},
                  options);
}

std::vector<float> random_samples(std::size_t count, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<float> value;
    std::vector<float> samples(count);
    for (float& sample : samples)
        sample = value(random);
    return samples;
}

double value(const Volume& volume, const CellBlock& cell, const LatticeRay& ray, double t)
{
    const glm::dvec3 local = ray.at(t) - cell.lower;
    switch (volume.degree()) {
    case 1:
        return value_in_cell<1>(cell, local);
    case 2:
        return value_in_cell<2>(cell, local);
    default:
        return value_in_cell<3>(cell, local);
    }
}

glm::dvec3 gradient(const Volume& volume, const CellBlock& cell, const LatticeRay& ray, double t)
{
    const glm::dvec3 local = ray.at(t) - cell.lower;
    switch (volume.degree()) {
    case 1:
        return gradient_in_cell<1>(cell, local);
    case 2:
        return gradient_in_cell<2>(cell, local);
    default:
        return gradient_in_cell<3>(cell, local);
    }
}

/// The group of a cell alone.
CellGroup group_of(int degree, const CellBlock& cell)
{
    CellGroup group{};
    group.members = 1;
    set_slabs(group, cell, degree);
    return group;
}

/// Rays of many kinds at the unit cube at `lower`: through two random points near it, along axes, from inside.
Ray random_ray(std::mt19937& random, const glm::dvec3& lower)
{
    std::uniform_real_distribution<double> near_cell(-0.3, 1.3), within(0.0, 1.0);
    std::uniform_int_distribution<int> kind(0, 4), axis(0, 2);
    const glm::dvec3 a(near_cell(random), near_cell(random), near_cell(random));
    const glm::dvec3 b(within(random), within(random), within(random));
    Ray ray;
    ray.direction = b - a;
    ray.origin = lower + a - 3.0 * ray.direction;
    switch (kind(random)) {
    case 0: // along an axis
        ray.direction = glm::dvec3(0.0);
        ray.direction[axis(random)] = 1.0;
        ray.origin = lower + b - 3.0 * ray.direction;
        break;
    case 1: // in a plane of two axes
        ray.direction[axis(random)] = 0.0;
        ray.origin = lower + b - 3.0 * ray.direction;
        break;
    case 2: // begins inside
        ray.origin = lower + b;
        break;
    }
    return ray;
}

} // namespace

TEST_CASE("exact and reference find the first crossing of random cells", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const glm::ivec3 shape(6, 5, 7);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), shape, degree);
    const auto exact = cell_intersector(degree, Method::exact).first_root;
    const auto reference = cell_intersector(degree, Method::reference).first_root;

    std::mt19937 random(17);
    std::uniform_real_distribution<double> threshold(-0.4, 0.4);
    const glm::ivec3 cells = volume.cell_shape();
    int found = 0;
    for (int repetition = 0; repetition < 20000; ++repetition) {
        const Cell index{static_cast<std::uint16_t>(random() % static_cast<unsigned>(cells.x)),
                         static_cast<std::uint16_t>(random() % static_cast<unsigned>(cells.y)),
                         static_cast<std::uint16_t>(random() % static_cast<unsigned>(cells.z))};
        const CellBlock cell(volume, threshold(random), index);
        const LatticeRay ray(random_ray(random, cell.lower), volume.cell_shape());
        const std::optional<RootInCell> root = exact(cell, ray);
        const std::optional<RootInCell> root_reference = reference(cell, ray);
        REQUIRE(root.has_value() == root_reference.has_value());
        if (root) {
            REQUIRE(root->t == root_reference->t);
            const glm::dvec3 exact_gradient = gradient(volume, cell, ray, root->t);
            REQUIRE(glm::length(root->gradient - exact_gradient) <= 1e-7);
        }

        // No change of sign before the root, by dense sampling; and a residual of nothing at the root.
        Interval inside = ray.inside_cell(cell.lower);
        inside.t_near = std::max(inside.t_near, ray.t_near);
        if (!(inside.t_near < inside.t_far))
            continue;
        const double end = root ? root->t : inside.t_far;
        const bool negative = value(volume, cell, ray, inside.t_near) < 0.0;
        constexpr int samples = 200;
        for (int i = 1; i < samples; ++i) {
            const double t_sample = inside.t_near + (end - inside.t_near) * i / samples;
            const double f = value(volume, cell, ray, t_sample);
            if (std::abs(f) > 1e-9)
                REQUIRE((f < 0.0) == negative);
        }
        if (root) {
            ++found;
            // The hit is in the slab and in its box, up to the margin that cells have.
            const glm::dvec3 position = ray.at(root->t);
            const CellGroup group = group_of(degree, cell);
            const Box box = bounds(group);
            for (int axis = 0; axis < 3; ++axis) {
                REQUIRE(position[axis] - cell.lower[axis] >= box.lower[axis] - 1e-6);
                REQUIRE(position[axis] - cell.lower[axis] <= box.upper[axis] + 1e-6);
            }
            const glm::dvec3 normal(group.slab_normal[0][0], group.slab_normal[1][0], group.slab_normal[2][0]);
            const double along = glm::dot(normal, position - cell.lower);
            REQUIRE(along >= group.slab_lower[0] - 1e-6);
            REQUIRE(along <= group.slab_upper[0] + 1e-6);
            REQUIRE(value(volume, cell, ray, root->t) == Approx(0.0).margin(1e-10));
        }
    }
    REQUIRE(found > 2000);
}

TEST_CASE("the single precision filter is as sure for values far from zero and for tiny contrast", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const double base = GENERATE(0.0, 1000.0, -1e6);
    const double contrast = GENERATE(1e-3, 1.0);
    const glm::ivec3 shape(5, 5, 5);
    std::vector<float> samples = random_samples(125, 5);
    for (float& sample : samples)
        sample = static_cast<float>(base + contrast * static_cast<double>(sample));
    samples[0] = 0.0f; // keeps the volume's offset away from the base
    const Volume volume = volume_of_coefficients(samples, shape, degree);
    const auto exact = cell_intersector(degree, Method::exact).first_root;
    const auto reference = cell_intersector(degree, Method::reference).first_root;

    std::mt19937 random(3);
    std::uniform_real_distribution<double> level(-0.3, 0.3);
    for (int repetition = 0; repetition < 20000; ++repetition) {
        const CellBlock cell(volume, base + contrast * level(random) - volume.offset(), Cell{2, 2, 2});
        const LatticeRay ray(random_ray(random, cell.lower), volume.cell_shape());
        const auto root = exact(cell, ray), root_reference = reference(cell, ray);
        REQUIRE(root.has_value() == root_reference.has_value());
        if (root)
            REQUIRE(root->t == Approx(root_reference->t).margin(1e-7));
    }
}

namespace {

/// Packets against rays alone, in the lanes given: the same roots and gradients, bit for bit, and no other lane
/// touched; nor those whose root is beyond a limit.
int check_packet(const CellIntersector& intersector, const Volume& volume, const CellBlock& cell, std::mt19937& random,
                 LaneMask active)
{
    LatticeRayPacket packet;
    std::vector<LatticeRay> rays;
    for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
        rays.emplace_back(random_ray(random, cell.lower), volume.cell_shape());
        packet.set(lane, rays.back());
    }
    RootPacket roots;
    alignas(64) double t_limit[LatticeRayPacket::capacity];
    std::fill_n(t_limit, LatticeRayPacket::capacity, 1e30);
    const LaneMask found = intersector.first_roots(cell, packet, t_limit, active, roots);
    REQUIRE((found & ~active) == 0);

    RootPacket limited;
    LaneMask within = 0;
    for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
        if ((found >> lane & 1u) == 0)
            continue;
        t_limit[lane] = lane % 2 != 0 ? std::nextafter(roots.t[lane], -1e30) : roots.t[lane];
        within |= static_cast<LaneMask>(lane % 2 == 0) << lane;
    }
    REQUIRE(intersector.first_roots(cell, packet, t_limit, active, limited) == within);
    int count = 0;
    for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
        const bool is_active = (active >> lane & 1u) != 0, is_found = (found >> lane & 1u) != 0;
        const auto alone = intersector.first_root(cell, rays[static_cast<std::size_t>(lane)]);
        if (is_active) {
            REQUIRE(is_found == alone.has_value());
            REQUIRE(is_found == intersector.any_root(cell, rays[static_cast<std::size_t>(lane)]));
        }
        if (is_found) {
            REQUIRE(roots.t[lane] == alone->t);
            REQUIRE(roots.root(lane).gradient == alone->gradient);
        }
        count += is_found;
    }
    return count;
}

/// The SIMD targets that the machine has, and nothing else for the time of a test.
class EachTarget {
public:
    template <typename Check>
    static void run(const Check& check)
    {
        const std::int64_t all = hwy::SupportedTargets() & HWY_TARGETS;
        for (std::int64_t rest = all; rest != 0; rest &= rest - 1) {
            const std::int64_t target = rest & -rest;
            // Whatever is above a target is switched off; the baseline cannot be.
            hwy::SetSupportedTargetsForTest(target | HWY_STATIC_TARGET);
            hwy::GetChosenTarget().DeInit();
            INFO(hwy::TargetName(target));
            check();
        }
        hwy::SetSupportedTargetsForTest(0);
        hwy::GetChosenTarget().DeInit();
    }
};

} // namespace

TEST_CASE("rays in packets find what rays alone find, bit for bit, on every SIMD target", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const Method method = GENERATE(Method::exact, Method::reference, Method::bracket);
    const glm::ivec3 shape(6, 5, 7);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), shape, degree);
    EachTarget::run([&] {
        const CellIntersector intersector = cell_intersector(degree, method);
        std::mt19937 random(29);
        std::uniform_real_distribution<double> threshold(-0.4, 0.4);
        int found = 0;
        for (int repetition = 0; repetition < 300; ++repetition) {
            const auto index = [&] { return static_cast<std::uint16_t>(random() % 4); };
            const CellBlock cell(volume, threshold(random), Cell{index(), index(), index()});
            const LaneMask active = repetition % 3 == 0 ? 0xffffu : static_cast<LaneMask>(random()) & 0xffffu;
            found += check_packet(intersector, volume, cell, random, active);
        }
        REQUIRE(found > 300);
    });
}

TEST_CASE("normals of a packet are those of hits alone, bit for bit, on every SIMD target", "[trace]")
{
    const Inside inside = GENERATE(Inside::above, Inside::below);
    EachTarget::run([&] {
        std::mt19937 random(41);
        std::normal_distribution<double> value;
        glm::dmat4 world_to_lattice(1.0);
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 3; ++row)
                world_to_lattice[column][row] = value(random);
        RootPacket roots;
        for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane)
            roots.set(lane, {value(random), {value(random), value(random), value(random)}});
        roots.set(3, {0.0, glm::dvec3(0.0)});
        NormalPacket normals;
        surface_normals(roots, inside, world_to_lattice, normals);
        for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
            Hit alone;
            set_surface_normal(alone, roots.root(lane).gradient, inside, world_to_lattice);
            REQUIRE(normals.magnitude[lane] == alone.gradient_magnitude);
            for (int axis = 0; axis < 3; ++axis)
                REQUIRE(normals.normal[axis][lane] == alone.normal[axis]);
        }
    });
}

TEST_CASE("the slab of a cell is no thicker than its Bernstein coefficients ask for", "[trace]")
{
    // f = x + a x^2 + a y^2 about the middle of the cell, as samples of degree 2: c = f - a/2, as the second derivative
    // is 2a along both axes and c is f less an eighth of each. The Bernstein coefficients of a x^2 are a/4, -a/4, a/4.
    const float a = 0.2f;
    std::vector<float> samples;
    for (int z = 0; z < 3; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                samples.push_back(static_cast<float>(x) + a * static_cast<float>(x * x + y * y) - 0.5f * a);
    const Volume volume = volume_of_coefficients(samples, {3, 3, 3}, 2);
    EachTarget::run([&] {
        const CellGroup group = group_of(2, CellBlock(volume, -volume.offset(), Cell{1, 1, 1}));
        REQUIRE(group.slab_normal[0][0] == 31);
        REQUIRE(group.slab_normal[1][0] == 0);
        REQUIRE(group.slab_normal[2][0] == 0);
        // f - x is between -a/2 and a/2: x between 0.5 - a/2 and 0.5 + a/2, times 31, rounded outwards.
        REQUIRE(group.slab_lower[0] == 12);
        REQUIRE(group.slab_upper[0] == 19);
    });
}

TEST_CASE("the slabs of a group are those of its cells alone, on every SIMD target", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), {6, 5, 7}, degree);
    EachTarget::run([&] {
        std::mt19937 random(37);
        for (int repetition = 0; repetition < 200; ++repetition) {
            const Cell corner{static_cast<std::uint16_t>(random() % 2), static_cast<std::uint16_t>(random() % 2),
                              static_cast<std::uint16_t>(random() % 2)};
            CellGroup group{};
            group.members = static_cast<std::uint8_t>(random());
            set_slabs(group, CellBlock(volume, 0.1, corner), degree);
            Box together;
            for (std::size_t i = 0; i < 8; ++i) {
                if ((group.members >> i & 1u) == 0)
                    continue;
                const glm::dvec3 offset(i & 1, i >> 1 & 1, i >> 2);
                const Cell cell{static_cast<std::uint16_t>(corner.x + (i & 1)),
                                static_cast<std::uint16_t>(corner.y + (i >> 1 & 1)),
                                static_cast<std::uint16_t>(corner.z + (i >> 2))};
                const CellGroup alone = group_of(degree, CellBlock(volume, 0.1, cell));
                for (std::size_t axis = 0; axis < 3; ++axis)
                    REQUIRE(group.slab_normal[axis][i] == alone.slab_normal[axis][0]);
                REQUIRE(group.slab_lower[i] == alone.slab_lower[0]);
                REQUIRE(group.slab_upper[i] == alone.slab_upper[0]);
                const Box box = bounds(alone);
                if (box.empty())
                    continue;
                together.extend(offset + box.lower);
                together.extend(offset + box.upper);
            }
            const Box box = bounds(group);
            for (int axis = 0; axis < 3 && !together.empty(); ++axis) {
                REQUIRE(box.lower[axis] == Approx(together.lower[axis]).margin(1e-6));
                REQUIRE(box.upper[axis] == Approx(together.upper[axis]).margin(1e-6));
            }
            REQUIRE(box.empty() == together.empty());
        }
    });
}

TEST_CASE("every SIMD target finds the roots of the reference", "[trace]")
{
    const int degree = GENERATE(1, 2, 3);
    const Volume volume = volume_of_coefficients(random_samples(125, 8), {5, 5, 5}, degree);
    EachTarget::run([&] {
        const auto reference = cell_intersector(degree, Method::reference).first_root;
        const auto exact = cell_intersector(degree, Method::exact).first_root;
        std::mt19937 random(31);
        for (int repetition = 0; repetition < 3000; ++repetition) {
            const CellBlock cell(volume, 0.1, Cell{1, 2, 1});
            const LatticeRay ray(random_ray(random, cell.lower), volume.cell_shape());
            const auto root = exact(cell, ray), root_reference = reference(cell, ray);
            REQUIRE(root.has_value() == root_reference.has_value());
            if (root)
                REQUIRE(root->t == root_reference->t);
        }
    });
}

TEST_CASE("the Bernstein coefficients of a segment are those of f along it", "[trace]")
{
    // Interpolated by exact arithmetic on the polynomial's own values: de Casteljau at many s.
    const Volume volume = volume_of_coefficients(random_samples(125, 4), {5, 5, 5}, 2);
    const CellBlock cell(volume, 0.2, Cell{2, 1, 2});
    std::mt19937 random(5);
    std::uniform_real_distribution<double> within(0.0, 1.0);
    for (int repetition = 0; repetition < 200; ++repetition) {
        const glm::dvec3 entry(within(random), within(random), within(random));
        const glm::dvec3 exit(within(random), within(random), within(random));
        const isospline::Bernstein<6> b = bernstein_along_segment<2>(cell, entry, exit);
        for (double s = 0.0; s <= 1.0; s += 0.125) {
            isospline::Bernstein<6> level = b;
            for (int i = 6; i > 0; --i)
                for (int j = 0; j < i; ++j)
                    level[j] = (1.0 - s) * level[j] + s * level[j + 1];
            REQUIRE(level[0] == Approx(value_in_cell<2>(cell, entry + s * (exit - entry))).margin(1e-12));
        }
    }
}

TEST_CASE("two roots in one cell: exact finds the first, bracket finds none", "[trace]")
{
    // One coefficient of 1: f is the product of beta^2 of x, y, z, and along the x axis beta^2(x) (3/4)^2.
    std::vector<float> samples(27, 0.0f);
    samples[13] = 1.0f;
    const Volume volume = volume_of_coefficients(samples, {3, 3, 3}, 2);
    Ray ray;
    ray.origin = {-10.0, 1.5, 1.5};
    ray.direction = {2.0, 0.0, 0.0};

    // In the middle cell beta^2 = 3/4 - x^2, from 1/2 at its ends: never as low as 0.4.
    const CellBlock above(volume, 0.4 * 0.5625 - volume.offset(), Cell{1, 1, 1});
    const auto exact = cell_intersector(2, Method::exact).first_root;
    const auto bracket = cell_intersector(2, Method::bracket).first_root;
    REQUIRE_FALSE(exact(above, LatticeRay(ray, {3, 3, 3})));
    REQUIRE_FALSE(bracket(above, LatticeRay(ray, {3, 3, 3})));

    // It is 0.6 at |x| = sqrt(0.15), twice in the cell.
    const CellBlock pair(volume, 0.6 * 0.5625 - volume.offset(), Cell{1, 1, 1});
    const auto first = exact(pair, LatticeRay(ray, {3, 3, 3}));
    REQUIRE(first);
    REQUIRE(ray.at(first->t).x == Approx(1.5 - std::sqrt(0.15)).margin(1e-7));
    REQUIRE_FALSE(bracket(pair, LatticeRay(ray, {3, 3, 3})));

    // Limits: beginning between the roots leaves the second; ending before the first leaves none.
    ray.t_near = first->t + 1e-6;
    const auto second = exact(pair, LatticeRay(ray, {3, 3, 3}));
    REQUIRE(second);
    REQUIRE(ray.at(second->t).x == Approx(1.5 + std::sqrt(0.15)).margin(1e-7));
    ray.t_near = 0.0;
    ray.t_far = first->t - 1e-6;
    REQUIRE_FALSE(exact(pair, LatticeRay(ray, {3, 3, 3})));
}

TEST_CASE("a degree that has no surface is refused", "[trace]")
{
    REQUIRE_THROWS_AS(cell_intersector(0, Method::exact), std::invalid_argument);
    REQUIRE_THROWS_AS(cell_intersector(4, Method::exact), std::invalid_argument);
}
