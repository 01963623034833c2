// Rays at closed meshes through vertices, along edges and in the plane of walls: every query crosses them in turn.
//
// ISOSPLINE_TEST_RAYS sets the number of rays of each mesh; 10^7 were tried.
#include "catch.h"
#include "long_tests.h"
#include "scene/closed_meshes.h"

#include "isospline/math/affine.h"
#include "isospline/scene/scene.h"

#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

using namespace isospline;
using test::ClosedMesh;

namespace {

std::size_t closed_mesh_ray_count()
{
    const char* const count = std::getenv("ISOSPLINE_TEST_RAYS");
    return count ? std::stoul(count) : are_tests_long() ? 20000 : 8000;
}

std::array<std::pair<const char*, glm::dmat4>, 4> transforms()
{
    const glm::dmat4 one(1.0);
    const glm::dmat4 turned = glm::rotate(glm::translate(one, {3.0, -5.0, 8.0}), 0.7, {0.3, -0.5, 0.8});
    glm::dmat4 sheared = glm::scale(turned, {0.2, 3.0, 1.0});
    sheared[1][0] += 0.4;
    return {{{"in place", one},
             {"turned", turned},
             {"mirrored", glm::scale(turned, {-1.0, 1.0, 1.0})},
             {"sheared and stretched", sheared}}};
}

/// Rays from outside of a mesh, all degenerate where there is no transform: through vertices, points of edges, two of
/// these, along edges, in the plane of faces, along axes.
class DegenerateRays {
public:
    DegenerateRays(const ClosedMesh& mesh, const glm::dmat4& transform) : mesh_(mesh), transform_(transform) {}

    Ray operator()()
    {
        const glm::uvec3& face = mesh_.faces[any(mesh_.faces.size())];
        const glm::dvec3 vertex = mesh_.vertices[face.x], next = mesh_.vertices[face.y], third = mesh_.vertices[face.z];
        const double share = std::array{0.0, 0.25, 0.5, 0.3}[any(4)];
        const glm::dvec3 target = vertex + share * (next - vertex);
        glm::dvec3 direction;
        switch (any(6)) {
        case 0: // along an axis
            direction = glm::dvec3(0.0);
            direction[static_cast<int>(any(3))] = any(2) == 0 ? 1.0 : -1.0;
            break;
        case 1: // along an edge
            direction = next - vertex;
            break;
        case 2: // in the plane of a face
            direction = (next - vertex) + static_cast<double>(any(5)) * 0.5 * (third - vertex);
            break;
        case 3: // through two vertices
            direction = mesh_.vertices[any(mesh_.vertices.size())] - target;
            break;
        case 4: // in a plane of lattice points
            direction = {static_cast<double>(any(5)) - 2.0, static_cast<double>(any(5)) - 2.0, 0.0};
            break;
        default:
            direction = {normal(), normal(), normal()};
        }
        if (direction == glm::dvec3(0.0))
            direction = {0.0, 0.0, 1.0};
        direction *= std::exp2(-std::ilogb(glm::length(direction))); // exact
        const double distance = std::array{4.0, 8.0, 1000.0}[any(3)];
        return {transform_point(transform_, target - distance * direction),
                transform_vector(transform_, direction * std::array{1.0, 0.5, 3.7}[any(3)])};
    }

private:
    std::size_t any(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }
    double normal() { return std::normal_distribution<double>()(random_); }

    const ClosedMesh& mesh_;
    const glm::dmat4 transform_;
    std::mt19937_64 random_{7};
};

bool is_same_hit(const Hit& a, const Hit& b)
{
    return a.t == b.t && a.geometry_id == b.geometry_id && a.primitive_id == b.primitive_id && a.normal == b.normal &&
           a.uv == b.uv && a.position == b.position;
}

/// Counts what is wrong with the crossings of rays; all counts are to be zero.
struct Faults {
    int odd = 0, not_in_turn = 0, unordered = 0, first_hits = 0, packets = 0, occlusions = 0, limits = 0;

    bool operator==(const Faults&) const = default;
};

Faults find_faults(const SceneSnapshot& scene, const std::vector<Ray>& rays, bool is_tangled,
                   std::size_t& crossing_count)
{
    Faults faults;
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts(rays.size());
    scene.list_intersections(rays, crossings, counts);
    std::vector<Hit> singles(rays.size()), packets(rays.size());
    scene.cast_rays(rays, singles);
    scene.cast_rays(rays, packets, true);
    std::vector<std::uint8_t> occluded(rays.size()), occluded_in_packet(rays.size());
    scene.test_occlusions(rays, occluded);
    scene.test_occlusions(rays, occluded_in_packet, true);
    REQUIRE(occluded_in_packet == occluded);
    crossing_count += crossings.size();

    std::vector<Ray> at_hits;
    std::size_t first = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        int depth = 0;
        for (std::size_t j = first; j < first + counts[i]; ++j) {
            depth += crossings[j].entering ? 1 : -1;
            faults.not_in_turn += depth < 0 || (depth > 1 && !is_tangled);
            faults.unordered += j > first && crossings[j].hit.t < crossings[j - 1].hit.t;
        }
        faults.odd += depth != 0;
        faults.packets += !is_same_hit(singles[i], packets[i]);
        faults.first_hits += counts[i] > 0 ? !is_same_hit(singles[i], crossings[first].hit) : bool(singles[i]);
        faults.occlusions += (counts[i] > 0) != (occluded[i] != 0);
        if (singles[i]) {
            at_hits.push_back(rays[i]);
            at_hits.back().t_near = at_hits.back().t_far = singles[i].t;
        }
        first += counts[i];
    }

    // The limits belong to the ray.
    std::vector<Hit> again(at_hits.size());
    scene.cast_rays(at_hits, again);
    for (std::size_t i = 0; i < at_hits.size(); ++i)
        faults.limits += again[i].t != at_hits[i].t_near;
    return faults;
}

} // namespace

TEST_CASE("rays alternately enter and leave closed meshes, even at vertices, edges and walls", "[scene][slow]")
{
    constexpr std::size_t batch = 10000;
    for (const auto& [mesh_name, mesh] : test::closed_meshes())
        for (const auto& [transform_name, transform] : transforms()) {
            INFO(mesh_name << ", " << transform_name);
            Scene scene;
            scene.add(std::make_shared<Mesh>(mesh.vertices, mesh.faces), transform);
            const auto snapshot = scene.snapshot();
            DegenerateRays next(mesh, transform);
            std::size_t crossing_count = 0;
            const std::size_t count = std::max<std::size_t>(1, closed_mesh_ray_count() / transforms().size());
            for (std::size_t begin = 0; begin < count; begin += batch) {
                std::vector<Ray> rays;
                for (std::size_t i = begin; i < std::min(begin + batch, count); ++i)
                    rays.push_back(next());
                const Faults faults =
                    find_faults(*snapshot, rays, std::string(mesh_name) == "tangled tube", crossing_count);
                CHECK(faults.odd == 0);
                CHECK(faults.not_in_turn == 0);
                CHECK(faults.unordered == 0);
                CHECK(faults.first_hits == 0);
                CHECK(faults.packets == 0);
                CHECK(faults.occlusions == 0);
                CHECK(faults.limits == 0);
            }
            CHECK(crossing_count > count / 2);
        }
}
