#include "catch.h"

#include "isospline/polygonize/face_octree.h"

#include <glm/common.hpp>

#include <random>
#include <set>
#include <vector>

using namespace isospline;

TEST_CASE("an octree finds all boxes that meet a box", "[polygonize]")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const auto box = [&](double size) {
        const glm::dvec3 lower = 20.0 * glm::dvec3(unit(random), unit(random), unit(random));
        return Box{lower, lower + size * glm::dvec3(unit(random), unit(random), unit(random))};
    };
    std::vector<Box> boxes;
    for (int i = 0; i < 500; ++i)
        boxes.push_back(box(i % 10 == 0 ? 8.0 : 0.5));
    FaceOctree octree({glm::dvec3(0.0), glm::dvec3(28.0)}, boxes.size(), 0.25);
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
        octree.insert(i, boxes[i]);
    std::vector<bool> is_in(boxes.size(), true);
    for (std::uint32_t i = 0; i < boxes.size(); i += 3) {
        octree.remove(i);
        is_in[i] = false;
    }
    for (int query = 0; query < 100; ++query) {
        const Box around = box(3.0);
        std::set<std::uint32_t> found;
        REQUIRE(octree.visit(around, [&](std::uint32_t item) {
            REQUIRE(is_in[item]);
            REQUIRE(found.insert(item).second);
            return true;
        }));
        for (std::uint32_t i = 0; i < boxes.size(); ++i) {
            const bool meets = glm::max(around.lower, boxes[i].lower) ==
                               glm::min(glm::max(around.lower, boxes[i].lower), glm::min(around.upper, boxes[i].upper));
            if (is_in[i] && meets)
                REQUIRE(found.count(i) == 1);
        }
        if (!found.empty())
            REQUIRE(!octree.visit(around, [](std::uint32_t) { return false; }));
    }
}
