#include "catch.h"

#include "isospline/math/orientation.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <limits>

using namespace isospline;

TEST_CASE("orientations are exact", "[math]")
{
    // Points on the diagonal, moved by single units in the last place.
    const double unit = std::numeric_limits<double>::epsilon();
    for (int i = -2; i <= 2; ++i) {
        const int sign = (i > 0) - (i < 0);
        REQUIRE(orientation(glm::dvec2(12.0), glm::dvec2(24.0), glm::dvec2(0.5, 0.5 + i * unit)) == sign);
        REQUIRE(orientation(glm::dvec3(0.0), glm::dvec3(12.0, 0.0, 12.0), glm::dvec3(0.0, 12.0, 12.0),
                            glm::dvec3(0.25, 0.25, 0.5 + i * unit)) == -sign);
    }
}
