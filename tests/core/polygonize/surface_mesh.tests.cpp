#include "catch.h"
#include "long_tests.h"
#include "volumes.h"

#include "isospline/polygonize/surface_mesh.h"
#include "isospline/query/solid.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

using namespace isospline;

namespace {

/// The faces at each directed edge are one, those at each vertex a single fan.
void check_closed_manifold(const SurfaceMesh& mesh)
{
    std::map<std::pair<unsigned, unsigned>, unsigned> third;
    std::map<unsigned, std::size_t> face_count;
    for (const glm::uvec3& face : mesh.faces)
        for (int corner = 0; corner < 3; ++corner) {
            const bool is_new =
                third.try_emplace({face[corner], face[(corner + 1) % 3]}, face[(corner + 2) % 3]).second;
            REQUIRE(is_new);
            ++face_count[face[corner]];
        }
    for (const auto& [edge, unused] : third)
        REQUIRE(third.count({edge.second, edge.first}) == 1);
    for (const auto& [edge, first] : third) {
        std::size_t steps = 0;
        unsigned next = edge.second;
        do {
            next = third.at({edge.first, next});
            ++steps;
        } while (next != edge.second && steps <= face_count[edge.first]);
        REQUIRE(steps == face_count[edge.first]);
    }
}

double volume_of(const SurfaceMesh& mesh)
{
    double six = 0.0;
    for (const glm::uvec3& face : mesh.faces)
        six += glm::dot(mesh.vertices[face.x], glm::cross(mesh.vertices[face.y], mesh.vertices[face.z]));
    return six / 6.0;
}

Isosurface noise_surface(int degree, unsigned seed, std::vector<HalfSpace> clip)
{
    VolumeOptions options;
    options.degree = degree;
    IsosurfaceOptions surface_options;
    surface_options.clip = std::move(clip);
    surface_options.capped = true;
    const auto volume = noise_volume({11, 9, 10}, options, seed);
    for (const HalfSpace& side : half_spaces(volume->bounds()))
        surface_options.clip.push_back(side);
    return {volume, 0.1, surface_options};
}

} // namespace

TEST_CASE("meshes of noise that is closed at the border are closed manifolds", "[polygonize]")
{
    for (int degree = 1; degree <= 3; ++degree)
        for (unsigned seed = 0; seed < 6; ++seed) {
            const Isosurface surface = noise_surface(degree, seed, {});
            const SurfaceMesh mesh = to_mesh(*surface.snapshot());
            check_closed_manifold(mesh);
            REQUIRE(volume_of(mesh) > 0.0);
            for (const glm::dvec3& normal : mesh.normals)
                REQUIRE(glm::length(normal) == Approx(1.0));
        }
}

TEST_CASE("meshes of noise that planes cut are closed manifolds", "[polygonize]")
{
    const std::vector<std::vector<HalfSpace>> clips{
        {{{1.0, 0.0, 0.0}, 4.5}},  // through corners of cells of even degrees
        {{{1.0, 0.0, 0.0}, 4.0}},  // of odd ones
        {{{1.0, 0.2, -0.3}, 3.3}}, //
        {{{1.0, 0.2, -0.3}, 3.3}, {{-1.0, 0.2, -0.3}, -7.0}, {{0.0, 1.0, 1.0}, 6.0}},
        {{{1.0, 1.0, 1.0}, 12.0}, {{-1.0, -1.0, -1.0}, -12.5}}, // a slice that is thinner than cells
    };
    for (int degree = 1; degree <= 3; ++degree)
        for (const auto& clip : clips) {
            const Isosurface surface = noise_surface(degree, 3, clip);
            const SurfaceMesh mesh = to_mesh(*surface.snapshot());
            REQUIRE(!mesh.faces.empty());
            check_closed_manifold(mesh);
            for (const glm::dvec3& vertex : mesh.vertices)
                for (const HalfSpace& half_space : surface.options().clip)
                    REQUIRE(glm::dot(half_space.normal, vertex) >= half_space.offset - 1e-8);
        }
}

TEST_CASE("meshes with a tolerance are closed manifolds within it", "[polygonize][slow]")
{
    for (int degree = 1; degree <= 3; ++degree)
        for (const double tolerance : {1.0, 0.3, 0.1}) {
            if (tolerance < 0.3 && !are_tests_long())
                continue;
            const Isosurface surface = noise_surface(degree, 5, {{{1.0, 0.2, -0.3}, 3.3}});
            const SurfaceMesh mesh = to_mesh(*surface.snapshot(), tolerance);
            check_closed_manifold(mesh);
            REQUIRE(mesh.distance <= tolerance);
            REQUIRE(mesh.left_out.empty());
            REQUIRE(mesh.crossings == 0);
        }
}

TEST_CASE("a surface between the corners of cells has a mesh if a tolerance requires it", "[polygonize]")
{
    // A bump of the quadratic spline between samples' corners: f is above 0.7 about one sample's centre alone.
    std::vector<float> samples(std::size_t{9} * 9 * 9, 0.0f);
    samples[4 + 9 * (4 + 9 * 4)] = 1.0f;
    VolumeOptions options;
    options.filter = Filter::none;
    const auto volume = make_volume(samples, {9, 9, 9}, options);
    const Isosurface surface(volume, 0.3);
    REQUIRE(to_mesh(*surface.snapshot()).faces.empty());
    const SurfaceMesh mesh = to_mesh(*surface.snapshot(), 0.05);
    REQUIRE(!mesh.faces.empty());
    check_closed_manifold(mesh);
    REQUIRE(mesh.distance <= 0.05);
}

TEST_CASE("a tolerance that is not positive is an error", "[polygonize]")
{
    const Isosurface surface = noise_surface(2, 1, {});
    for (const double tolerance : {0.0, -1.0, std::nan("")})
        REQUIRE_THROWS_AS(to_mesh(*surface.snapshot(), tolerance), std::invalid_argument);
}
