#include "catch.h"

#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/clipped_triangle.h"
#include "isospline/polygonize/parity_proof.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <vector>

using namespace isospline;

namespace {

constexpr int cells = 12; // along an edge of a sheet, from -1 to 1

/// A rippled sheet about z = height, turned in space.
void add_sheet(LabeledMesh& mesh, double height, const glm::dmat3& turn)
{
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int j = 0; j <= cells; ++j)
        for (int i = 0; i <= cells; ++i) {
            const double x = 2.0 * i / cells - 1.0, y = 2.0 * j / cells - 1.0;
            mesh.vertices.push_back(turn * glm::dvec3(x, y, height + 0.02 * std::sin(5.0 * x + 3.0 * y)));
        }
    for (int j = 0; j < cells; ++j)
        for (int i = 0; i < cells; ++i) {
            const std::uint32_t at = first + static_cast<std::uint32_t>(i + (cells + 1) * j), above = at + cells + 1;
            mesh.faces.push_back({at, at + 1, above + 1});
            mesh.faces.push_back({at, above + 1, above});
        }
}

double distance_to(const LabeledMesh& mesh, const glm::dvec3& point)
{
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        const Corners corners = corners_of(mesh, i);
        least =
            std::min(least, glm::distance(point, closest_point_of_triangle(point, corners[0], corners[1], corners[2])));
    }
    return least;
}

std::vector<std::uint32_t> all_faces(const LabeledMesh& mesh)
{
    std::vector<std::uint32_t> faces(mesh.faces.size());
    std::iota(faces.begin(), faces.end(), 0u);
    return faces;
}

} // namespace

TEST_CASE("what the parity of crossings proves near a mesh of many faces is true", "[polygonize]")
{
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto vector = [&] { return glm::dvec3(unit(random), unit(random), unit(random)); };
    ParityProof::Workspace workspace;
    int proven = 0;
    constexpr int trials = 400;
    for (int trial = 0; trial < trials; ++trial) {
        const glm::dvec3 n = glm::normalize(vector()), u = glm::normalize(glm::cross(n, vector()));
        const glm::dmat3 turn(u, glm::cross(n, u), n);
        LabeledMesh mesh;
        add_sheet(mesh, 0.0, turn);
        const bool has_hole = trial % 4 == 1;
        if (has_hole)
            mesh.faces.erase(mesh.faces.begin() + cells * cells - 8, mesh.faces.begin() + cells * cells + 16);
        if (trial % 4 == 2)
            add_sheet(mesh, 0.1 * unit(random), turn);
        // Points around a thin box over some faces, which may reach beyond the sheet.
        const glm::dvec3 at(0.8 * unit(random), 0.8 * unit(random), 0.06 * unit(random));
        std::vector<glm::dvec3> points;
        for (int i = 0; i < 12; ++i)
            points.push_back(turn * (at + vector() * glm::dvec3(0.15, 0.15, 0.02)));
        constexpr double most = 0.1;
        const auto distance =
            ParityProof(mesh, mesh.vertices).distance(points, n + 0.1 * vector(), all_faces(mesh), most, workspace);
        if (!distance)
            continue;
        ++proven;
        REQUIRE(*distance <= most);
        for (int i = 0; i < 50; ++i) {
            glm::dvec3 point(0.0);
            double sum = 0.0;
            for (const glm::dvec3& each : points) {
                const double weight = std::pow(0.5 + 0.5 * unit(random), 4.0);
                point += weight * each;
                sum += weight;
            }
            REQUIRE(distance_to(mesh, point / sum) <= *distance);
        }
    }
    REQUIRE(proven > trials / 4);
    REQUIRE(proven < trials);
}

TEST_CASE("the parity of crossings proves nothing at a border, between two sheets and far from a mesh", "[polygonize]")
{
    ParityProof::Workspace workspace;
    const glm::dmat3 turn(1.0);
    const auto distance = [&](const LabeledMesh& mesh, const glm::dvec3& at, double most) {
        std::vector<glm::dvec3> points;
        for (const double x : {-0.1, 0.1})
            for (const double y : {-0.1, 0.1})
                for (const double z : {-0.01, 0.01})
                    points.push_back(at + glm::dvec3(x, y, z));
        return ParityProof(mesh, mesh.vertices)
            .distance(points, glm::dvec3(0.0, 0.0, 2.0), all_faces(mesh), most, workspace);
    };
    LabeledMesh sheet;
    add_sheet(sheet, 0.0, turn);
    const auto near = distance(sheet, glm::dvec3(0.0), 0.1);
    REQUIRE(near);
    REQUIRE(*near >= 0.01);
    REQUIRE(*near <= 0.04);
    REQUIRE(!distance(sheet, glm::dvec3(0.0), 0.005));          // the set itself is thicker
    REQUIRE(!distance(sheet, glm::dvec3(0.0, 0.0, 0.2), 0.1));  // beyond
    REQUIRE(!distance(sheet, glm::dvec3(0.95, 0.0, 0.0), 0.1)); // at the border
    REQUIRE(!distance(sheet, glm::dvec3(3.0, 0.0, 0.0), 0.1));  // beside
    LabeledMesh two = sheet;
    add_sheet(two, 0.09, turn);
    REQUIRE(!distance(two, glm::dvec3(0.0, 0.0, 0.045), 0.1));
    REQUIRE(distance(two, glm::dvec3(0.0), 0.035)); // the second one is out of reach
    LabeledMesh fins = sheet; // an edge with four faces on opposite sides is no border, one with three is
    const std::uint32_t last = static_cast<std::uint32_t>(fins.vertices.size());
    fins.vertices.push_back({0.0, 0.0, 0.05});
    fins.faces.push_back({fins.faces[cells * cells].x, fins.faces[cells * cells].y, last});
    REQUIRE(!distance(fins, fins.vertices[fins.faces[cells * cells].x], 0.1));
}

TEST_CASE("a plane cuts a triangle, and rounding errors along it do not write beyond its corners", "[polygonize]")
{
    const ClippedTriangle triangle(Corners{glm::dvec3(0.0), glm::dvec3(2.0, 0.0, 1.0), glm::dvec3(0.0, 2.0, 0.0)});
    const ClippedTriangle below = triangle.cut(0, 0.5, false), above = triangle.cut(0, 0.5, true);
    REQUIRE(below.count == 4);
    REQUIRE(above.count == 3);
    REQUIRE(below.box().upper == glm::dvec3(0.5, 2.0, 0.25));
    REQUIRE(above.box().lower == glm::dvec3(0.5, 0.0, 0.25));
    REQUIRE(triangle.cut(2, 2.0, true).count == 0);
    ClippedTriangle wavy;
    wavy.count = ClippedTriangle::capacity;
    for (std::size_t i = 0; i < wavy.count; ++i)
        wavy.corners[i] = {static_cast<double>(i), 1.0 + (i % 2 == 0 ? 0x1p-50 : -0x1p-50), 0.0};
    REQUIRE(wavy.cut(1, 1.0, true).has_too_many);
    REQUIRE(wavy.cut(1, 1.0, true).cut(0, 3.0, false).has_too_many);
}
