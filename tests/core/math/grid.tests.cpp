#include "catch.h"

#include "isospline/math/grid.h"

#include <random>

using namespace isospline;

TEST_CASE("Morton codes have the bits of x, y and z in turn", "[math]")
{
    REQUIRE(morton_code({0, 0, 0}) == 0);
    std::mt19937_64 random(5);
    std::uniform_int_distribution<int> any(0, (1 << 21) - 1);
    for (int i = 0; i < 1000; ++i) {
        const glm::ivec3 at = i == 0 ? glm::ivec3((1 << 21) - 1) : glm::ivec3(any(random), any(random), any(random));
        std::uint64_t expected = 0;
        for (int bit = 0; bit < 21; ++bit)
            for (int axis = 0; axis < 3; ++axis)
                expected |= static_cast<std::uint64_t>(at[axis] >> bit & 1) << (3 * bit + axis);
        REQUIRE(morton_code(at) == expected);
    }
}

TEST_CASE("places count a grid's positions, x fastest, and beyond 2^32", "[math]")
{
    REQUIRE(place_count({3, 4, 5}) == 60);
    REQUIRE(place_in({3, 4, 5}, {2, 3, 4}) == 59);
    REQUIRE(place_count({3, 0, 5}) == 0);

    constexpr int most = 65535; // cells of a volume along an axis
    for (const glm::ivec3 shape : {glm::ivec3(most), glm::ivec3(1, most, most), glm::ivec3(2048, 1625, 1290)}) {
        const std::uint64_t count = place_count(shape);
        REQUIRE(count == static_cast<std::uint64_t>(shape.x) * static_cast<std::uint64_t>(shape.y) *
                             static_cast<std::uint64_t>(shape.z));
        REQUIRE(place_in(shape, {0, 0, 0}) == 0);
        REQUIRE(place_in(shape, shape - 1) == count - 1);
        std::mt19937_64 random(4);
        std::uniform_int_distribution<std::uint64_t> any(0, count - 1);
        for (int i = 0; i < 1000; ++i) {
            const std::uint64_t place = i == 0 ? std::uint64_t{1} << 31 : any(random);
            const glm::ivec3 at = at_place(shape, place);
            REQUIRE((at.x >= 0 && at.x < shape.x && at.y >= 0 && at.y < shape.y && at.z >= 0 && at.z < shape.z));
            REQUIRE(place_in(shape, at) == place);
        }
    }
    REQUIRE(place_in({4096, 4096, 4096}, {5, 0, 256}) == 5 + (std::uint64_t{1} << 32));
    REQUIRE(at_place({4096, 4096, 4096}, 5 + (std::uint64_t{1} << 32)) == glm::ivec3(5, 0, 256));
}
