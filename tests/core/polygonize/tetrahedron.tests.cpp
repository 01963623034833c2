#include "catch.h"

#include "isospline/polygonize/tetrahedron.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

using namespace isospline;

namespace {

double volume_of(const std::vector<glm::dvec3>& nodes, const Tetrahedron& corners)
{
    const glm::dvec3 a = nodes[corners[0]];
    return glm::dot(glm::cross(nodes[corners[1]] - a, nodes[corners[2]] - a), nodes[corners[3]] - a) / 6.0;
}

} // namespace

TEST_CASE("a tetrahedron is cut into parts that fill both sides of a plane", "[polygonize]")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int trial = 0; trial < 2000; ++trial) {
        std::vector<glm::dvec3> nodes;
        for (int i = 0; i < 4; ++i)
            nodes.push_back({uniform(random), uniform(random), uniform(random)});
        Tetrahedron whole{0, 1, 2, 3};
        if (volume_of(nodes, whole) < 0.0)
            std::swap(whole[2], whole[3]);
        std::vector<double> heights;
        for (int i = 0; i < 4; ++i) // whole numbers: corners on the plane occur
            heights.push_back(std::floor(3.0 * uniform(random)) * 0.5);

        double total = 0.0;
        for (const double sign : {1.0, -1.0}) {
            std::vector<double> above = heights;
            for (double& height : above)
                height *= sign;
            std::map<std::pair<NodeId, NodeId>, NodeId> cuts;
            const auto side = [&](NodeId node) { return (above[node] > 0.0) - (above[node] < 0.0); };
            const auto cut = [&](NodeId inner, NodeId outer) {
                const auto [found, is_new] = cuts.try_emplace(std::minmax(inner, outer), 0u);
                if (is_new) {
                    const double part = above[inner] / (above[inner] - above[outer]);
                    found->second = static_cast<NodeId>(nodes.size());
                    nodes.push_back(nodes[inner] + part * (nodes[outer] - nodes[inner]));
                    above.push_back(0.0);
                }
                return found->second;
            };
            double smallest = 1.0;
            cut_tetrahedron(whole, side, cut, std::less<NodeId>(), [&](const Tetrahedron& part) {
                smallest = std::min(smallest, volume_of(nodes, part));
                total += volume_of(nodes, part);
            });
            REQUIRE(smallest > -1e-15);
        }
        const bool is_flat = heights[0] == 0.0 && heights[1] == 0.0 && heights[2] == 0.0 && heights[3] == 0.0;
        if (!is_flat)
            REQUIRE(total == Approx(volume_of(nodes, whole)).margin(1e-14));
    }
}
