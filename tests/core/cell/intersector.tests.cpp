#include "catch.h"
#include "each_target.h"
#include "random_cells.h"

#include "isospline/cell/intersector.h"
#include "isospline/cell/solve-inl.h"
#include "isospline/cell/value-inl.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/surface_hit.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdint>
#include <deque>
#include <random>
#include <string>
#include <vector>

using namespace isospline;

namespace {

double value(const Volume& volume, const CellCoefficients& cell, const LatticeRay& ray, double t)
{
    return dispatch_degree(volume.degree(),
                           [&](auto degree) { return scalar::value_in_cell<degree>(cell, ray.at(t) - cell.lower); });
}

glm::dvec3 gradient(const Volume& volume, const CellCoefficients& cell, const LatticeRay& ray, double t)
{
    return dispatch_degree(volume.degree(),
                           [&](auto degree) { return scalar::gradient_in_cell<degree>(cell, ray.at(t) - cell.lower); });
}

} // namespace

TEST_CASE("exact and reference find the first crossing of random cells", "[cell]")
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
        const glm::ivec3 index(random() % static_cast<unsigned>(cells.x), random() % static_cast<unsigned>(cells.y),
                               random() % static_cast<unsigned>(cells.z));
        const VolumeCell cell(volume, threshold(random), index);
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
            REQUIRE(value(volume, cell, ray, root->t) == Approx(0.0).margin(1e-10));
        }
    }
    REQUIRE(found > 2000);
}

TEST_CASE("the single precision filter is as sure for values far from zero and for tiny contrast", "[cell]")
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
        const VolumeCell cell(volume, base + contrast * level(random) - volume.offset(), glm::ivec3(2, 2, 2));
        const LatticeRay ray(random_ray(random, cell.lower), volume.cell_shape());
        const auto root = exact(cell, ray), root_reference = reference(cell, ray);
        REQUIRE(root.has_value() == root_reference.has_value());
        if (root)
            REQUIRE(root->t == Approx(root_reference->t).margin(1e-7));
    }
}

namespace {

/// A cell for each lane.
using CellsOfLanes = std::array<const VolumeCell*, LatticeRayPacket::capacity>;

/// The candidates of active lanes, copied unless all lanes have the same cell.
CandidateCells candidates(const CellsOfLanes& cells, int degree, LaneMask active)
{
    CandidateCells result;
    result.lanes = active;
    result.are_copied = cells.front() != cells.back();
    result.only = *cells.front();
    result.lower_of_only = glm::ivec3(cells.front()->lower);
    for (std::size_t lane = 0; lane < cells.size(); ++lane) {
        for (int axis = 0; axis < 3; ++axis)
            result.lower[axis][lane] = static_cast<std::int32_t>(cells[lane]->lower[axis]);
        std::size_t number = 0;
        for (int k = 0; k <= degree; ++k)
            for (int j = 0; j <= degree; ++j)
                for (int i = 0; i <= degree; ++i)
                    result.coefficients[number++][lane] = cells[lane]->row(j, k)[i];
    }
    return result;
}

/// Packets against rays alone, in the lanes given: the same roots and gradients, bit for bit, and no other lane
/// touched; nor those whose root is beyond a limit.
int check_packet(const CellIntersector& intersector, const Volume& volume, const CellsOfLanes& cells,
                 std::mt19937& random, LaneMask active)
{
    LatticeRayPacket packet;
    std::vector<LatticeRay> rays;
    for (const VolumeCell* const cell : cells) {
        rays.emplace_back(random_ray(random, cell->lower), volume.cell_shape());
        packet.set(static_cast<int>(rays.size()) - 1, rays.back());
    }
    const double threshold = cells.front()->threshold;
    const CandidateCells of_lanes = candidates(cells, volume.degree(), active);
    RootPacket roots;
    alignas(64) double t_limit[LatticeRayPacket::capacity];
    std::fill_n(t_limit, LatticeRayPacket::capacity, 1e30);
    const LaneMask found = intersector.first_roots(of_lanes, threshold, packet, t_limit, roots);
    REQUIRE((found & ~active) == 0);

    RootPacket limited;
    LaneMask within = 0;
    for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
        if ((found >> lane & 1u) == 0)
            continue;
        t_limit[lane] = lane % 2 != 0 ? std::nextafter(roots.t[lane], -1e30) : roots.t[lane];
        within |= static_cast<LaneMask>(lane % 2 == 0) << lane;
    }
    REQUIRE(intersector.first_roots(of_lanes, threshold, packet, t_limit, limited) == within);
    REQUIRE(intersector.any_roots(of_lanes, threshold, packet) == found);

    // Rays that begin or end at their first root, or just behind or before it, as those that leave a surface.
    for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
        if ((found >> lane & 1u) == 0)
            continue;
        LatticeRay ray = rays[static_cast<std::size_t>(lane)];
        const double root = roots.t[lane];
        if (lane % 4 < 2)
            ray.t_near = ray.limits.t_near = lane % 2 != 0 ? std::nextafter(root, 1e30) : root;
        else
            ray.t_far = ray.limits.t_far = lane % 2 != 0 ? std::nextafter(root, -1e30) : root;
        packet.set(lane, ray);
    }
    const LaneMask any = intersector.any_roots(of_lanes, threshold, packet);
    for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
        const auto i = static_cast<std::size_t>(lane);
        const bool is_active = (active >> lane & 1u) != 0;
        REQUIRE(((any >> lane & 1u) != 0) == (is_active && intersector.any_root(*cells[i], packet.ray(lane))));
    }

    int count = 0;
    for (std::size_t lane = 0; lane < cells.size(); ++lane) {
        const bool is_active = (active >> lane & 1u) != 0, is_found = (found >> lane & 1u) != 0;
        const auto alone = intersector.first_root(*cells[lane], rays[lane]);
        if (is_active) {
            REQUIRE(is_found == alone.has_value());
            REQUIRE(is_found == intersector.any_root(*cells[lane], rays[lane]));
        }
        if (is_found) {
            REQUIRE(roots.t[lane] == alone->t);
            REQUIRE(roots.root(static_cast<int>(lane)).gradient == alone->gradient);
        }
        count += is_found;
    }
    return count;
}

} // namespace

TEST_CASE("rays in packets and single rays find the same, bit for bit, on every SIMD target", "[cell]")
{
    const int degree = GENERATE(1, 2, 3);
    const Method method = GENERATE(Method::exact, Method::reference, Method::bracket);
    const glm::ivec3 shape(6, 5, 7);
    const Volume volume = volume_of_coefficients(random_samples(210, static_cast<unsigned>(degree)), shape, degree);
    for_each_target([&] {
        const CellIntersector intersector = cell_intersector(degree, method);
        std::mt19937 random(29);
        std::uniform_real_distribution<double> threshold(-0.4, 0.4);
        int found = 0;
        for (int repetition = 0; repetition < 300; ++repetition) {
            // One cell of all lanes, or several.
            const double level = threshold(random);
            std::deque<VolumeCell> cells;
            for (int i = 0; i < (repetition % 2 == 0 ? 1 : 5); ++i) {
                const auto index = [&] { return static_cast<int>(random() % 4); };
                cells.emplace_back(volume, level, glm::ivec3(index(), index(), index()));
            }
            CellsOfLanes of_lanes;
            for (std::size_t lane = 0; lane < of_lanes.size(); ++lane)
                of_lanes[lane] = &cells[lane * cells.size() / of_lanes.size()];
            const LaneMask active = repetition % 3 == 0 ? 0xffffu : static_cast<LaneMask>(random()) & 0xffffu;
            found += check_packet(intersector, volume, of_lanes, random, active);
        }
        REQUIRE(found > 300);
    });
}

TEST_CASE("positions and normals of a packet are those of hits alone, bit for bit, on every SIMD target", "[cell]")
{
    const Inside inside = GENERATE(Inside::above, Inside::below);
    for_each_target([&] {
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
        RayPacket rays;
        for (int lane = 0; lane < RayPacket::capacity; ++lane)
            rays.set(lane, {{value(random), value(random), value(random)}, {value(random), value(random), 1.0}});
        rays.count = RayPacket::capacity;
        SurfaceHitPacket hits;
        set_surface_hits(hits, rays, roots.t, roots, inside, world_to_lattice);
        for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane) {
            Hit alone;
            set_surface_normal(alone, roots.root(lane).gradient, inside, world_to_lattice);
            REQUIRE(hits.gradient_magnitude[lane] == alone.gradient_magnitude);
            for (int axis = 0; axis < 3; ++axis) {
                REQUIRE(hits.normal[axis][lane] == alone.normal[axis]);
                REQUIRE(hits.position[axis][lane] == rays.ray(lane).at(roots.t[lane])[axis]);
            }
        }
    });
}

TEST_CASE("every SIMD target finds the roots of the reference", "[cell]")
{
    const int degree = GENERATE(1, 2, 3);
    const Volume volume = volume_of_coefficients(random_samples(125, 8), {5, 5, 5}, degree);
    for_each_target([&] {
        const auto reference = cell_intersector(degree, Method::reference).first_root;
        const auto exact = cell_intersector(degree, Method::exact).first_root;
        std::mt19937 random(31);
        for (int repetition = 0; repetition < 3000; ++repetition) {
            const VolumeCell cell(volume, 0.1, glm::ivec3(1, 2, 1));
            const LatticeRay ray(random_ray(random, cell.lower), volume.cell_shape());
            const auto root = exact(cell, ray), root_reference = reference(cell, ray);
            REQUIRE(root.has_value() == root_reference.has_value());
            if (root)
                REQUIRE(root->t == root_reference->t);
        }
    });
}

TEST_CASE("the Bernstein coefficients of a segment are those of f along it", "[cell]")
{
    // Interpolated by exact arithmetic on the polynomial's own values: de Casteljau at many s.
    const Volume volume = volume_of_coefficients(random_samples(125, 4), {5, 5, 5}, 2);
    const VolumeCell cell(volume, 0.2, glm::ivec3(2, 1, 2));
    std::mt19937 random(5);
    std::uniform_real_distribution<double> within(0.0, 1.0);
    for (int repetition = 0; repetition < 200; ++repetition) {
        const glm::dvec3 entry(within(random), within(random), within(random));
        const glm::dvec3 exit(within(random), within(random), within(random));
        const isospline::Bernstein<6> b = scalar::bernstein_along_segment<2>(cell, entry, exit);
        for (double s = 0.0; s <= 1.0; s += 0.125) {
            isospline::Bernstein<6> level = b;
            for (int i = 6; i > 0; --i)
                for (int j = 0; j < i; ++j)
                    level[j] = (1.0 - s) * level[j] + s * level[j + 1];
            REQUIRE(level[0] == Approx(scalar::value_in_cell<2>(cell, entry + s * (exit - entry))).margin(1e-12));
        }
    }
}

TEST_CASE("two roots in one cell: exact finds the first, bracket finds none", "[cell]")
{
    // One coefficient of 1: f is the product of beta^2 of x, y, z, and along the x axis beta^2(x) (3/4)^2.
    std::vector<float> samples(27, 0.0f);
    samples[13] = 1.0f;
    const Volume volume = volume_of_coefficients(samples, {3, 3, 3}, 2);
    Ray ray;
    ray.origin = {-10.0, 1.5, 1.5};
    ray.direction = {2.0, 0.0, 0.0};

    // In the middle cell beta^2 = 3/4 - x^2, from 1/2 at its ends: never as low as 0.4.
    const VolumeCell above(volume, 0.4 * 0.5625 - volume.offset(), glm::ivec3(1, 1, 1));
    const auto exact = cell_intersector(2, Method::exact).first_root;
    const auto bracket = cell_intersector(2, Method::bracket).first_root;
    REQUIRE_FALSE(exact(above, LatticeRay(ray, {3, 3, 3})));
    REQUIRE_FALSE(bracket(above, LatticeRay(ray, {3, 3, 3})));

    // It is 0.6 at |x| = sqrt(0.15), twice in the cell.
    const VolumeCell pair(volume, 0.6 * 0.5625 - volume.offset(), glm::ivec3(1, 1, 1));
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

TEST_CASE("a degree that has no surface is refused", "[cell]")
{
    REQUIRE_THROWS_AS(cell_intersector(0, Method::exact), std::invalid_argument);
    REQUIRE_THROWS_AS(cell_intersector(4, Method::exact), std::invalid_argument);
}
