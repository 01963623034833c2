#include "catch.h"

#include "noise_volume.h"

#include "isospline/shell/value_bounds.h"

#include <algorithm>

using namespace isospline;

TEST_CASE("value bounds are those of the coefficients that reach a brick's cells", "[shell][threads]")
{
    for (const auto& shape : {glm::ivec3(20, 9, 17), glm::ivec3(16, 8, 8), glm::ivec3(3, 2, 2), glm::ivec3(9, 33, 2)})
        for (int degree = 0; degree <= 5; ++degree) {
            const auto volume = noise_volume(shape, degree);
            const ValueBounds bounds(*volume);
            REQUIRE(bounds.shape() == brick_shape(volume->cell_shape()));
            for (std::size_t index = 0; index < bounds.ranges().size(); ++index) {
                const Brick brick = brick_at(volume->cell_shape(), index);
                const float* first = volume->cell_coefficients(brick.first.x, brick.first.y, brick.first.z);
                float lower = *first, upper = *first;
                for (int z = 0; z < brick.size.z + degree; ++z)
                    for (int y = 0; y < brick.size.y + degree; ++y)
                        for (int x = 0; x < brick.size.x + degree; ++x) {
                            const float c = first[x + y * volume->row_stride() + z * volume->slice_stride()];
                            lower = std::min(lower, c);
                            upper = std::max(upper, c);
                        }
                REQUIRE(bounds.ranges()[index].lower == lower);
                REQUIRE(bounds.ranges()[index].upper == upper);
            }
        }
}

TEST_CASE("a range straddles a threshold where both signs occur, zero counting as positive", "[shell]")
{
    const ValueBounds::Range range{-1.0f, 2.0f};
    REQUIRE(range.straddles(0.0));
    REQUIRE(range.straddles(2.0));
    REQUIRE(!range.straddles(-1.0));
    REQUIRE(!range.straddles(2.0 + 1e-12));
    REQUIRE(range.straddles(-1.0 + 1e-12));
}
