#include "catch.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/near_mesh.h"
#include "isospline/polygonize/surface_parts.h"
#include "isospline/query/closest_point.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

using namespace isospline;

namespace {

std::mt19937 random_numbers; // each test begins anew

double random_number(double lower, double upper)
{
    return std::uniform_real_distribution<double>(lower, upper)(random_numbers);
}

glm::dvec3 random_point(const glm::dvec3& lower, const glm::dvec3& upper)
{
    return {random_number(lower.x, upper.x), random_number(lower.y, upper.y), random_number(lower.z, upper.z)};
}

Corners random_triangle(const glm::ivec3& cell_shape)
{
    const Box all{glm::dvec3(0.0), glm::dvec3(cell_shape)};
    const glm::dvec3 center = random_point(all.lower, all.upper), reach(random_number(0.01, 4.0));
    Corners corners;
    for (glm::dvec3& corner : corners) {
        corner = glm::clamp(center + random_point(-reach, reach), all.lower, all.upper);
        for (int axis = 0; axis < 3; ++axis)
            if (random_number(0.0, 1.0) < 0.2) // in a plane between parts
                corner[axis] = std::round(corner[axis] * parts_per_cell) / parts_per_cell;
    }
    return corners;
}

glm::dvec3 random_point_of(const Corners& corners)
{
    double a = random_number(0.0, 1.0), b = random_number(0.0, 1.0);
    if (a + b > 1.0) {
        a = 1.0 - a;
        b = 1.0 - b;
    }
    return corners[0] + a * (corners[1] - corners[0]) + b * (corners[2] - corners[0]);
}

/// Whether a triangle meets a box that is grown by a margin: it does not if a plane across an axis, a normal or a cross
/// product of edges separates them (T. Akenine-Moeller, "Fast 3D triangle-box overlap testing", 2001).
bool meets(const Corners& corners, const Box& box, double margin)
{
    const glm::dvec3 half = 0.5 * box.size() + margin, center = box.center();
    const std::array<glm::dvec3, 3> axes{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)};
    std::vector<glm::dvec3> directions(axes.begin(), axes.end());
    directions.push_back(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
    for (std::size_t i = 0; i < 3; ++i)
        for (const glm::dvec3& axis : axes)
            directions.push_back(glm::cross(corners[(i + 1) % 3] - corners[i], axis));
    return std::none_of(directions.begin(), directions.end(), [&](const glm::dvec3& direction) {
        double least = glm::dot(direction, corners[0] - center), most = least;
        for (const glm::dvec3& corner : corners) {
            least = std::min(least, glm::dot(direction, corner - center));
            most = std::max(most, glm::dot(direction, corner - center));
        }
        const double reach = glm::dot(glm::abs(direction), half);
        return least > reach || most < -reach;
    });
}

Box box_of_part(const glm::ivec3& part)
{
    return {glm::dvec3(part) / double{parts_per_cell}, glm::dvec3(part + 1) / double{parts_per_cell}};
}

glm::dmat4 sheared()
{
    return {{0.8, 0.0, 0.0, 0.0}, {0.3, 1.0, 0.0, 0.0}, {0.0, 0.1, 1.3, 0.0}, {5.0, -7.0, 11.0, 1.0}};
}

} // namespace

TEST_CASE("rows of parts hold a triangle, and each part has a point of it", "[polygonize]")
{
    random_numbers.seed(5);
    const glm::ivec3 cell_shape(11, 9, 17);
    RowsOfTriangle rows(parts_per_cell * cell_shape);
    for (int i = 0; i < 400; ++i) {
        const Corners corners = random_triangle(cell_shape);
        CellParts parts(cell_shape);
        int count = 0, met = 0;
        rows(corners, [&](const glm::ivec3& first, int last_x) {
            for (int x = first.x; x <= last_x; ++x, ++count) {
                const glm::ivec3 part(x, first.y, first.z);
                met += meets(corners, box_of_part(part), 1e-6);
                parts.add(part, 1);
            }
            return true;
        });
        REQUIRE(count > 0);
        REQUIRE(met == count);
        for (int j = 0; j < 100; ++j) {
            const glm::dvec3 at = static_cast<double>(parts_per_cell) * random_point_of(corners);
            REQUIRE(parts.contains(glm::clamp(glm::ivec3(at), glm::ivec3(0), parts.shape() - 1)));
        }
    }
}

TEST_CASE("a set of parts has those that were added", "[polygonize]")
{
    random_numbers.seed(5);
    const glm::ivec3 cell_shape(19, 8, 9);
    CellParts parts(cell_shape);
    std::set<std::array<int, 3>> added;
    for (int i = 0; i < 200; ++i) {
        const glm::ivec3 first(random_point(glm::dvec3(-70.0, -2.0, -2.0), glm::dvec3(90.0, 36.0, 40.0)));
        const std::uint64_t bits = std::uint64_t{random_numbers()} << 32 | random_numbers();
        parts.add(first, bits);
        for (int bit = 0; bit < 64; ++bit)
            if ((bits >> bit & 1u) != 0)
                added.insert({first.x + bit, first.y, first.z});
    }
    std::size_t found = 0;
    glm::ivec3 at;
    for (at.z = 0; at.z < parts.shape().z; ++at.z)
        for (at.y = 0; at.y < parts.shape().y; ++at.y)
            for (at.x = 0; at.x < parts.shape().x; ++at.x) {
                const bool is_added = added.count({at.x, at.y, at.z}) != 0;
                REQUIRE(parts.contains(at) == is_added);
                const glm::ivec3 in_cell = at % parts_per_cell;
                const int bit = in_cell.x + parts_per_cell * (in_cell.y + parts_per_cell * in_cell.z);
                REQUIRE((parts.of_cell(at / parts_per_cell) >> bit & 1u) == (is_added ? 1u : 0u));
                found += is_added;
            }
    REQUIRE(found > 1000);
    std::size_t in_rows = 0;
    for (std::size_t brick = 0; brick < parts.brick_count(); ++brick)
        parts.for_each_row(brick, [&](int y, int z, std::uint32_t bits) {
            for (int x = 0; x < parts_per_brick; ++x)
                if ((bits >> x & 1u) != 0) {
                    const glm::ivec3 part = parts.first_of(brick) + glm::ivec3(x, y, z);
                    in_rows += added.count({part.x, part.y, part.z});
                }
        });
    REQUIRE(in_rows == found);
    for (int i = 0; i < 200; ++i) {
        const glm::ivec3 first(random_point(glm::dvec3(0.0), glm::dvec3(parts.shape())));
        const int last = std::min(first.x + i % 40, parts.shape().x - 1);
        bool has_all = true;
        for (int x = first.x; x <= last; ++x)
            has_all &= parts.contains({x, first.y, first.z});
        REQUIRE(parts.contains_row(first, last) == has_all);
    }
}

TEST_CASE("parts are near to a mesh whose points are all near to a point of it", "[polygonize]")
{
    random_numbers.seed(5);
    const glm::ivec3 cell_shape(20, 17, 18);
    const LatticeMetric metric(sheared());
    for (const double distance : {0.9, 1.7}) {
        LabeledMesh mesh;
        for (unsigned i = 0; i < 12; ++i) {
            for (const glm::dvec3& corner : random_triangle(cell_shape))
                mesh.vertices.push_back(corner);
            mesh.faces.push_back(3 * i + glm::uvec3(0, 1, 2));
            mesh.labels.push_back(on_isosurface);
        }
        MetBlocks all(cell_shape);
        all.add({glm::dvec3(0.0), glm::dvec3(cell_shape)});
        const PartReach reach(metric, distance);
        REQUIRE(reach.distance() <= distance);
        const CellParts near = parts_near_mesh(mesh, all, reach, cell_shape, {});
        std::size_t count = 0;
        for (int i = 0; i < 3000; ++i) {
            // A point beside the mesh: most parts are near to it, or far.
            const glm::dvec3 on_mesh =
                random_point_of(corners_of(mesh, static_cast<std::size_t>(i) % mesh.faces.size()));
            const glm::dvec3 beside = distance * random_point(glm::dvec3(-1.0), glm::dvec3(1.0));
            const glm::dvec3 at = glm::clamp(on_mesh + beside, glm::dvec3(0.0), glm::dvec3(cell_shape) - 1e-9);
            const bool is_near = near.contains(glm::ivec3(static_cast<double>(parts_per_cell) * at));
            double least = 1e300;
            for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
                const auto [a, b, c] = corners_of(mesh, face);
                const glm::dvec3 closest = closest_point_of_triangle(metric.to_world * at, metric.to_world * a,
                                                                     metric.to_world * b, metric.to_world * c);
                least = std::min(least, glm::distance(metric.to_world * at, closest));
            }
            if (is_near)
                REQUIRE(least <= reach.distance());
            else
                REQUIRE(least > 0.25 * distance); // it is of use
            count += is_near;
        }
        REQUIRE(count > 500);
    }
}

TEST_CASE("near parts are near to a surface, and all of it is in crossed ones", "[polygonize]")
{
    random_numbers.seed(5);
    for (int degree = 1; degree <= 3; ++degree)
        for (const bool is_cut : {false, true}) {
            VolumeOptions options;
            options.degree = degree;
            options.direction = glm::dmat3(sheared());
            const auto volume = noise_volume({14, 12, 13}, options, static_cast<unsigned>(degree));
            IsosurfaceOptions of_surface;
            if (is_cut) {
                const glm::dvec3 normal = glm::normalize(glm::dvec3(1.0, 2.0, -1.0));
                of_surface.clip.push_back({normal, glm::dot(normal, volume->bounds().center())});
            }
            const Isosurface isosurface(volume, 0.3, of_surface);
            const auto surface = isosurface.snapshot();
            constexpr double distance = 1.1;
            ClosestPointFinder finder(*surface);
            const auto examine = [&](const auto& field) {
                const SurfaceParts parts(field, distance, {});
                REQUIRE(parts.distance() <= distance);
                REQUIRE(parts.distance() > 0.8 * distance);
                std::size_t near = 0, on_surface = 0;
                for (int i = 0; i < 4000; ++i) {
                    const glm::dvec3 at = random_point(glm::dvec3(0.0), glm::dvec3(volume->cell_shape()));
                    const ClosestPoint closest = finder(transform_point(volume->lattice_to_world(), at));
                    if (parts.is_near(at)) {
                        ++near;
                        REQUIRE(closest.distance <= parts.distance());
                    }
                    if (!(closest.distance < 0.5))
                        continue;
                    ++on_surface;
                    const glm::dvec3 foot = transform_point(volume->world_to_lattice(), closest.position);
                    // The foot is rounded: it may be in any of the parts beside it.
                    bool is_in_crossed = false;
                    for (int corner = 0; corner < 8; ++corner) {
                        const glm::dvec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
                        const glm::ivec3 part(glm::floor(double{parts_per_cell} * (foot + 1e-6 * (2.0 * step - 1.0))));
                        is_in_crossed |=
                            parts.crossed().contains(glm::clamp(part, glm::ivec3(0), parts.crossed().shape() - 1));
                    }
                    REQUIRE(is_in_crossed);
                }
                REQUIRE(near > 400);
                REQUIRE(on_surface > 400);
            };
            if (degree == 1)
                examine(LatticeField<1>(*surface, 1));
            else if (degree == 2)
                examine(LatticeField<2>(*surface, 1));
            else
                examine(LatticeField<3>(*surface, 1));
        }
}
