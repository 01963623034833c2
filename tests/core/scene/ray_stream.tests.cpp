// Incoherent rays in a stream, and the tree that they go through.
#include "catch.h"
#include "each_target.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/scene/absorption.h"
#include "isospline/scene/leaf_tree_builder.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/scene.h"

#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

using namespace isospline;

namespace {

/// Boxes of about the size of leaves, in a ball.
std::vector<Box> random_boxes(std::size_t count)
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::vector<Box> boxes;
    while (boxes.size() < count) {
        const glm::dvec3 centre = 300.0 * glm::normalize(glm::dvec3{unit(random), unit(random), unit(random)});
        const glm::dvec3 half = glm::abs(glm::dvec3{unit(random), unit(random), unit(random)}) + 1e-3;
        boxes.push_back({centre - half, centre + half});
    }
    return boxes;
}

/// Checks the nodes below one, and counts how often each leaf is found. Returns the depth.
int check_below(const LeafTree& tree, std::uint32_t place, const std::vector<Box>& boxes, const Box& within,
                std::vector<int>& found)
{
    const LeafTree::Node& node = tree.nodes[place];
    int depth = 0;
    for (int i = 0; i < LeafTree::width; ++i) {
        Box box;
        bool is_there = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t lower = LeafTree::Node::first_bound(axis) + static_cast<std::size_t>(i);
            is_there = is_there && node.bounds[lower] <= node.bounds[lower + LeafTree::width];
            const auto plane = [&](std::size_t bound) {
                return node.origin[axis] + double{node.step[axis]} * node.bounds[bound];
            };
            box.lower[static_cast<int>(axis)] = plane(lower);
            box.upper[static_cast<int>(axis)] = plane(lower + LeafTree::width);
        }
        if (!is_there)
            continue;
        const std::uint32_t child = node.children[i];
        if ((child & LeafTree::leaf_bit) == 0) {
            REQUIRE(child > place);
            depth = std::max(depth, check_below(tree, child, boxes, box, found));
            continue;
        }
        const std::uint32_t leaf = child & ~LeafTree::leaf_bit;
        ++found.at(leaf);
        REQUIRE(glm::all(glm::lessThanEqual(box.lower, boxes[leaf].lower)));
        REQUIRE(glm::all(glm::greaterThanEqual(box.upper, boxes[leaf].upper)));
        REQUIRE(glm::all(glm::lessThanEqual(within.lower, boxes[leaf].lower)));
        REQUIRE(glm::all(glm::greaterThanEqual(within.upper, boxes[leaf].upper)));
    }
    return depth + 1;
}

void require_tree(const std::vector<Box>& boxes)
{
    const LeafTree tree = build_leaf_tree(Device::shared(), boxes.size(), [&](unsigned int i) { return boxes[i]; });
    std::vector<int> found(boxes.size());
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Box all{glm::dvec3(-infinity), glm::dvec3(infinity)};
    REQUIRE(check_below(tree, 0, boxes, all, found) <= LeafTree::largest_depth);
    REQUIRE(std::all_of(found.begin(), found.end(), [](int times) { return times == 1; }));
}

/// A scene of one surface. In the draft, coherent rays are always in packets.
struct Snapshots {
    std::shared_ptr<const SceneSnapshot> draft, settled;
};

Snapshots snapshots_of(const std::shared_ptr<const Volume>& volume, double level, const IsosurfaceOptions& options,
                       const glm::dmat4& transform)
{
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, level, options), transform);
    return {scene.snapshot(), scene.settle()};
}

std::vector<Ray> rays_through(const Volume& volume, const glm::dmat4& transform, std::size_t count)
{
    std::mt19937 random(11);
    const glm::dmat4 to_world = transform * volume.lattice_to_world();
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        Ray ray = random_lattice_ray(random, volume.cell_shape());
        ray.origin = transform_point(to_world, ray.origin);
        ray.direction = transform_vector(to_world, ray.direction);
        if (i % 5 == 0)
            ray.t_far = 0.8;
        if (i % 7 == 0)
            ray.t_near = 0.5;
        rays.push_back(ray);
    }
    // Rays that are traced in packets, close to each other; the last ones of them leave the volume.
    const glm::dvec3 middle = 0.5 * glm::dvec3(volume.cell_shape());
    for (std::size_t i = 0; i < count / 4; ++i) {
        const double x = 0.05 * static_cast<double>(i % 16), y = 0.05 * static_cast<double>(i / 16);
        rays.push_back({transform_point(to_world, {middle.x + x, middle.y + y, -3.0}),
                        transform_vector(to_world, {0.1, 0.2, 1.0})});
    }
    return rays;
}

bool is_same(const Hit& a, const Hit& b)
{
    return a.t == b.t && a.position == b.position && a.normal == b.normal &&
           a.gradient_magnitude == b.gradient_magnitude && a.geometry_id == b.geometry_id &&
           a.primitive_id == b.primitive_id && a.uv == b.uv;
}

bool is_equal_crossing(const Crossing& a, const Crossing& b)
{
    return is_same(a.hit, b.hit) && a.entering == b.entering;
}

/// Whether lists of all crossings, or of those that are seen, are the same in a stream and in packets, bit for bit.
void require_lists_of_packets(const Snapshots& snapshots, const std::vector<Ray>& rays, bool of_seen)
{
    const auto opacity = [](std::uint32_t id) { return id == 3 ? std::nullopt : std::optional(0.4 + 0.2 * (id % 4)); };
    const auto opacity_of = [](const Hit&, const Ray&) { return 0.5; };
    const auto list = [&](const SceneSnapshot& scene, std::vector<std::uint32_t>& counts) {
        const Absorption absorption(scene, opacity, opacity_of);
        std::vector<Crossing> crossings;
        counts.resize(rays.size());
        RayCaster(scene, RayCaster::Rays::coherent).list(rays, crossings, counts, of_seen ? &absorption : nullptr);
        return crossings;
    };
    std::vector<std::uint32_t> counts, counts_of_packets;
    const std::vector<Crossing> stream = list(*snapshots.settled, counts);
    const std::vector<Crossing> packets = list(*snapshots.draft, counts_of_packets);
    REQUIRE(counts == counts_of_packets);
    REQUIRE(std::equal(stream.begin(), stream.end(), packets.begin(), packets.end(), is_equal_crossing));
}

/// Whether rays one by one and in packets have the same answers, bit for bit. Returns the number of hits.
std::size_t require_as_packets(const Snapshots& snapshots, const std::vector<Ray>& rays)
{
    const SceneSnapshot& scene = *snapshots.settled;
    std::vector<Hit> stream(rays.size()), coherent(rays.size()), packets(rays.size());
    scene.cast_rays(rays, stream, false);
    scene.cast_rays(rays, coherent, true); // in a stream or in packets
    snapshots.draft->cast_rays(rays, packets, true);
    std::vector<std::uint8_t> occluded(rays.size()), occluded_packets(rays.size());
    scene.test_occlusions(rays, occluded, false);
    scene.test_occlusions(rays, occluded_packets, true);
    for (const bool of_seen : {false, true})
        require_lists_of_packets(snapshots, rays, of_seen);
    std::size_t differ = 0, hits = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        differ += !is_same(stream[i], packets[i]) || !is_same(coherent[i], packets[i]) ||
                  occluded[i] != occluded_packets[i] || (occluded[i] != 0) != static_cast<bool>(stream[i]);
        hits += static_cast<bool>(stream[i]);
    }
    REQUIRE(differ == 0);
    return hits;
}

} // namespace

TEST_CASE("a tree of leaves has each leaf once, in the boxes of all nodes above", "[scene]")
{
    for (const std::size_t count : {1u, 2u, 8u, 9u, 64u, 65u, 5000u})
        require_tree(random_boxes(count));
}

TEST_CASE("a tree of leaves of one place is not too deep", "[scene]")
{
    require_tree(std::vector<Box>(20000, random_boxes(1).front()));
    // Each box is half as far from the origin as the one before it.
    std::vector<Box> row;
    for (int i = 0; i < 60; ++i)
        row.push_back({glm::dvec3(std::ldexp(1.0, 14 - i)), glm::dvec3(std::ldexp(1.5, 14 - i))});
    require_tree(row);
}

TEST_CASE("the build of a tree of leaves can be cancelled", "[scene]")
{
    const std::vector<Box> boxes = random_boxes(100000);
    const auto build = [&](const Progress& progress) {
        return build_leaf_tree(
            Device::shared(), boxes.size(), [&](unsigned int i) { return boxes[i]; }, progress);
    };
    REQUIRE_THROWS_AS(build([](double) { return false; }), Cancelled);
    std::atomic<int> left = 5;
    REQUIRE_THROWS_AS(build([&](double) { return --left > 0; }), Cancelled);
    REQUIRE_THROWS_AS(build([](double) -> bool { throw std::out_of_range("of the progress"); }), std::out_of_range);
    REQUIRE(!build([](double) { return true; }).nodes.empty());
}

TEST_CASE("rays in a stream find what packets find, on every SIMD target", "[scene]")
{
    const int degree = GENERATE(1, 2, 3);
    const bool integers = GENERATE(false, true);
    const bool far_away = GENERATE(false, true);
    const auto volume =
        integers ? integer_volume(glm::ivec3(19, 23, 31), degree) : noise_volume(glm::ivec3(19, 23, 31), degree);
    glm::dmat4 transform(1.0);
    if (far_away) {
        transform = glm::translate(transform, glm::dvec3(4e3, -7e3, 2e3));
        transform = glm::rotate(transform, 0.7, glm::dvec3(1.0, 2.0, -0.5));
        transform = glm::scale(transform, glm::dvec3(0.5, -2.0, 1.25));
    }
    IsosurfaceOptions options;
    if (integers)
        options.clip = {{{1.0, 0.5, 0.2}, 9.0}};
    const Snapshots snapshots = snapshots_of(volume, integers ? 2.0 : 0.4, options, transform);
    const std::vector<Ray> rays = rays_through(*volume, transform, 3000);
    for_each_target([&] { REQUIRE(require_as_packets(snapshots, rays) > rays.size() / 3); });
}

TEST_CASE("a stream visits few isosurfaces, one after the other", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(19, 23, 31), 2), other = integer_volume(glm::ivec3(20, 18, 21), 2);
    const glm::dmat4 moved =
        glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(4.0, 3.0, 6.0)), 0.6, {1.0, 2.0, 0.5});
    const auto surface = std::make_shared<Isosurface>(volume, 0.8);
    IsosurfaceOptions cut;
    cut.clip = {{{1.0, 0.5, 0.2}, 9.0}};
    Scene scene;
    scene.add(surface);
    scene.add(std::make_shared<Isosurface>(other, 2.0, cut), moved);
    scene.add(surface); // the first one is hit
    scene.add(std::make_shared<Isosurface>(volume, -0.6));
    const std::vector<Ray> rays = rays_through(*volume, glm::dmat4(1.0), 3000);
    for (const bool is_streamed : {true, false}) {
        const Snapshots snapshots{scene.snapshot(), scene.settle()};
        REQUIRE((RayCaster(*snapshots.settled, RayCaster::Rays::incoherent).batch_size() > 1) == is_streamed);
        REQUIRE(require_as_packets(snapshots, rays) > rays.size() / 2);
        scene.add(surface, glm::scale(moved, glm::dvec3(1.5, -0.8, 1.0))); // these are too many
    }
}

TEST_CASE("rays in a stream also meet meshes and capped surfaces", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(19, 23, 31), 2);
    const auto mesh = std::make_shared<Mesh>(
        std::vector<glm::dvec3>{{0.0, 0.0, 0.0}, {20.0, 0.0, 5.0}, {0.0, 20.0, 29.0}, {20.0, 20.0, 25.0}},
        std::vector<glm::uvec3>{{0, 1, 2}, {1, 3, 2}});
    IsosurfaceOptions capped;
    capped.clip = {{{1.0, 0.5, 0.2}, 9.0}};
    capped.capped = true;
    const bool casts_shadow = GENERATE(true, false);
    Scene scene;
    scene.add(mesh);
    scene.add(std::make_shared<Isosurface>(volume, 0.8));
    scene.add(mesh, glm::translate(glm::dmat4(1.0), glm::dvec3(1.0, 2.0, -9.0)), {true, casts_shadow});
    scene.add(std::make_shared<Isosurface>(volume, -0.6, capped));
    scene.add(std::make_shared<Isosurface>(volume, -0.9));
    const Snapshots snapshots{scene.snapshot(), scene.settle()};
    REQUIRE(RayCaster(*snapshots.settled, RayCaster::Rays::incoherent).batch_size() > 1);
    const std::vector<Ray> rays = rays_through(*volume, glm::dmat4(1.0), 3000);
    std::vector<Hit> hits(rays.size());
    snapshots.settled->cast_rays(rays, hits, false);
    std::size_t of_object[5] = {};
    for (const Hit& hit : hits)
        if (hit)
            ++of_object[hit.geometry_id];
    REQUIRE(std::all_of(std::begin(of_object), std::end(of_object), [](std::size_t count) { return count > 20; }));
    if (casts_shadow)
        REQUIRE(require_as_packets(snapshots, rays) > rays.size() / 2);
    std::vector<std::uint8_t> occluded(rays.size()), of_packets(rays.size());
    snapshots.settled->test_occlusions(rays, occluded, false);
    snapshots.draft->test_occlusions(rays, of_packets, true);
    REQUIRE(occluded == of_packets);
}

TEST_CASE("a stream takes any number of rays, and names a bad one", "[scene]")
{
    const auto volume = noise_volume(glm::ivec3(20), 2);
    const auto [draft, scene] = snapshots_of(volume, 0.4, {}, glm::dmat4(1.0));
    std::vector<Ray> rays = rays_through(*volume, glm::dmat4(1.0), 600);
    std::vector<Hit> all(rays.size());
    draft->cast_rays(rays, all, true);
    std::vector<std::uint8_t> all_occluded(rays.size());
    draft->test_occlusions(rays, all_occluded, true);
    for (const std::size_t count : {0u, 1u, 15u, 16u, 17u, 255u, 256u, 257u, 600u}) {
        std::vector<Hit> hits(count);
        scene->cast_rays(std::span(rays).first(count), hits, false);
        REQUIRE(std::equal(hits.begin(), hits.end(), all.begin(), is_same));
        std::vector<std::uint8_t> occluded(count, 2);
        scene->test_occlusions(std::span(rays).first(count), occluded, false);
        REQUIRE(std::equal(occluded.begin(), occluded.end(), all_occluded.begin()));
    }
    rays[321].origin.y = std::numeric_limits<double>::quiet_NaN();
    const auto require_named = [](const auto& query) {
        try {
            query();
            FAIL("a ray that is not finite was traced");
        } catch (const std::invalid_argument& error) {
            REQUIRE(std::string(error.what()).find("ray 321") != std::string::npos);
        }
    };
    require_named([&, &scene = scene] { scene->cast_rays(rays, all, false); });
    require_named([&, &scene = scene] { scene->test_occlusions(rays, all_occluded, false); });
    RayCaster caster(*scene, RayCaster::Rays::incoherent);
    RayPacket packets[2];
    packets[0].count = packets[1].count = 16;
    std::vector<Hit> too_few(31);
    LaneMask lanes[2];
    REQUIRE_THROWS_AS(caster.cast(packets, 0, too_few, lanes), std::invalid_argument);
    std::vector<Hit> hits(32);
    REQUIRE_THROWS_AS(caster.cast(packets, 0, hits, std::span(lanes, 1)), std::invalid_argument);
    REQUIRE_THROWS_AS(caster.test_occlusions(packets, 0, std::span(lanes, 1)), std::invalid_argument);
    packets[0].count = packets[1].count = 0;
    for (const auto kind : {RayCaster::Rays::incoherent, RayCaster::Rays::coherent}) {
        lanes[0] = lanes[1] = 1;
        RayCaster(*scene, kind).cast(packets, 0, {}, lanes);
        REQUIRE(lanes[0] + lanes[1] == 0);
        lanes[0] = lanes[1] = 1;
        RayCaster(*scene, kind).test_occlusions(packets, 0, lanes);
        REQUIRE(lanes[0] + lanes[1] == 0);
    }
}
