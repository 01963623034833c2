#include "../each_target.h"

#include "isospline/label/brick_filter.h"
#include "isospline/label/label_bricks.h"
#include "isospline/label/label_field.h"
#include "isospline/label/partial_volumes.h"
#include "isospline/math/frame.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

using namespace isospline;

namespace {

/// All bricks of a volume, stored and computed.
BrickLayout all_bricks(const glm::ivec3& shape)
{
    BrickLayout layout(shape);
    for (std::size_t brick = 0; brick < layout.place.size(); ++brick)
        layout.store(brick, true);
    return layout;
}

/// Calls `visit(at, number)` for the number of each voxel.
template <typename Visit>
void for_each_voxel(BrickField& field, const Visit& visit)
{
    for (std::size_t number = 0; number < field.layout->stored.size(); ++number) {
        const auto [first, size] = field.layout->brick(number);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    visit(first + glm::ivec3(x, y, z), field.numbers(number)[x + 8 * (y + 8 * z)]);
    }
}

/// Some numbers.
double noise(const glm::ivec3& at)
{
    return std::sin(12.9898 * at.x + 78.233 * at.y + 37.719 * at.z * at.x + at.y * at.z);
}

int mirrored(int i, int count)
{
    while (i < 0 || i >= count)
        i = count == 1 ? 0 : i < 0 ? -i : 2 * (count - 1) - i;
    return i;
}

/// A field filtered along one axis after the other, in double precision.
std::vector<double> filtered(const SeparableFilter& filter, const glm::ivec3& shape)
{
    std::vector<double> numbers(place_count(shape));
    for (std::size_t i = 0; i < numbers.size(); ++i)
        numbers[i] = noise(at_place(shape, i));
    for (int axis = 0; axis < 3; ++axis) {
        const auto& weights = filter[static_cast<std::size_t>(axis)];
        const std::vector<double> before = numbers;
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const glm::ivec3 at = at_place(shape, i);
            numbers[i] = 0.0;
            const int radius = static_cast<int>(weights.size()) - 1;
            for (int step = -radius; step <= radius; ++step) {
                glm::ivec3 from = at;
                from[axis] = mirrored(at[axis] + step, shape[axis]);
                numbers[i] += static_cast<double>(weights[static_cast<std::size_t>(std::abs(step))]) *
                              before[place_in(shape, from)];
            }
        }
    }
    return numbers;
}

/// 6.3 voxels minus the distance from a point near the middle.
double depth_in_ball(const glm::ivec3& at, const glm::ivec3& shape)
{
    return 6.3 - glm::distance(glm::dvec3(at), glm::dvec3(shape / 2) - glm::dvec3(0.8, 0.3, 0.6));
}

std::vector<std::int32_t> ball_of_labels(const glm::ivec3& shape)
{
    std::vector<std::int32_t> labels(place_count(shape));
    for (std::size_t i = 0; i < labels.size(); ++i)
        labels[i] = depth_in_ball(at_place(shape, i), shape) > 0.0 ? 7 : 0;
    return labels;
}

} // namespace

TEST_CASE("filters of bricks mirror volumes at their ends", "[label]")
{
    for_each_target([] {
        for (const glm::ivec3 shape : {glm::ivec3(30, 17, 9), glm::ivec3(3, 1, 8), glm::ivec3(2, 40, 1)})
            for (const SeparableFilter& filter :
                 {gaussian_filter({1.5, 0.8, 2.0}), low_pass_filter({1.5, 0.8, 2.0}), interpolation_filter()}) {
                const BrickLayout layout = all_bricks(shape);
                BrickField from(layout, 0.0f), to(layout, 0.0f), between(layout, 0.0f);
                for_each_voxel(from,
                               [](const glm::ivec3& at, float& number) { number = static_cast<float>(noise(at)); });
                apply(filter, from, to, between);
                const std::vector<double> expected = filtered(filter, shape);
                double most = 0.0;
                for_each_voxel(to, [&](const glm::ivec3& at, float& number) {
                    most = std::max(most, std::abs(static_cast<double>(number) - expected[place_in(shape, at)]));
                });
                REQUIRE(most < 5e-6);
            }
    });
}

TEST_CASE("filters keep constants and, at low pass, polynomials", "[label]")
{
    const glm::ivec3 shape(64, 3, 3);
    const BrickLayout layout = all_bricks(shape);
    BrickField from(layout, 0.0f), to(layout, 0.0f), between(layout, 0.0f);
    const auto polynomial = [](int x) {
        const double t = x / 31.5 - 1.0;
        return std::pow(t, 5) - std::pow(t, 3) + t;
    };
    for_each_voxel(from, [&](const glm::ivec3& at, float& number) { number = static_cast<float>(polynomial(at.x)); });
    apply(low_pass_filter(glm::dvec3(1.5)), from, to, between);
    for_each_voxel(to, [&](const glm::ivec3& at, float& number) {
        if (16 <= at.x && at.x < 48)
            REQUIRE(std::abs(static_cast<double>(number) - polynomial(at.x)) < 1e-5);
    });
    for (const SeparableFilter& filter : {gaussian_filter(glm::dvec3(2.0)), interpolation_filter()}) {
        apply(filter, BrickField(layout, 1.0f), to, between);
        for_each_voxel(to, [](const glm::ivec3&, float& number) { REQUIRE(std::abs(number - 1.0f) < 1e-5f); });
    }
}

TEST_CASE("partial volumes are those of a ball", "[label]")
{
    for_each_target([] {
        const BrickLayout layout = all_bricks(glm::ivec3(24));
        BrickField field(layout, 0.0f), coefficients = field, parts = field, slopes = field;
        for_each_voxel(field, [](const glm::ivec3& at, float& number) {
            number = static_cast<float>(depth_in_ball(at, glm::ivec3(24)));
        });
        apply(interpolation_filter(), field, coefficients, parts);
        const double exact = 4.0 / 3.0 * pi * std::pow(6.3, 3);
        for (const auto& [divisions, tolerance] : {std::pair(2, 5e-3), std::pair(4, 1e-3), std::pair(12, 5e-4)}) {
            const PartialVolume found = find_partial_volumes(coefficients, divisions, parts, slopes);
            REQUIRE(std::abs(found.voxels / exact - 1.0) < tolerance);
            REQUIRE(found.crossed > 600);
            REQUIRE(found.crossed < 1600);
            // A constant that is added moves the surface by as much.
            double area = 0.0;
            for_each_voxel(slopes, [&](const glm::ivec3&, float& number) { area += static_cast<double>(number); });
            REQUIRE(std::abs(area / (4.0 * pi * 6.3 * 6.3) - 1.0) < 0.03);
        }
    });
}

TEST_CASE("the field of a label has its sign at the centres of voxels and encloses what is asked for", "[label]")
{
    const glm::ivec3 shape(26, 25, 24);
    const std::vector<std::int32_t> labels = ball_of_labels(shape);
    LabelField field({labels.data(), shape}, 7, 0, glm::dvec3(1.5), {});
    const auto count = static_cast<double>(field.voxel_count());
    for (const double part : {1.0, 0.97}) {
        REQUIRE(std::abs(field.enclose(part * count, {})) < 5e-4);
        const std::vector<float> samples = field.samples();
        const BrickLayout layout = all_bricks(shape);
        BrickField of_bricks(layout, 0.0f), coefficients = of_bricks, parts = of_bricks, slopes = of_bricks;
        for_each_voxel(of_bricks, [&](const glm::ivec3& at, float& number) {
            number = samples[place_in(shape, at)];
            REQUIRE((number > 0.0f) == (labels[place_in(shape, at)] == 7));
        });
        apply(interpolation_filter(), of_bricks, coefficients, parts);
        REQUIRE(std::abs(find_partial_volumes(coefficients, 12, parts, slopes).voxels / (part * count) - 1.0) < 1e-3);
    }
}

TEST_CASE("the field of a label does not depend on what is far away", "[label]")
{
    // Bricks without the surface have one number, and those of a larger map are cut elsewhere.
    const glm::ivec3 shape(44), larger(101, 44, 44);
    const std::vector<std::int32_t> labels = ball_of_labels(shape);
    std::vector<std::int32_t> with_margin(place_count(larger), 0);
    for (std::size_t i = 0; i < labels.size(); ++i)
        with_margin[place_in(larger, at_place(shape, i) + glm::ivec3(29, 0, 0))] = labels[i];
    LabelField small({labels.data(), shape}, 7, 0, glm::dvec3(1.0), {});
    LabelField large({with_margin.data(), larger}, 7, 0, glm::dvec3(1.0), {});
    const std::vector<float> a = small.samples(), b = large.samples();
    double most = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::abs(depth_in_ball(at_place(shape, i), shape)) < 2.0)
            most = std::max(most, std::abs(static_cast<double>(
                                      a[i] - b[place_in(larger, at_place(shape, i) + glm::ivec3(29, 0, 0))])));
    REQUIRE(most < 2e-3);
}

TEST_CASE("smoothing of a label is cancelled by its progress", "[label]")
{
    const glm::ivec3 shape(24);
    const std::vector<std::int32_t> labels = ball_of_labels(shape);
    double last = 0.0;
    REQUIRE_THROWS_AS(LabelField({labels.data(), shape}, 7, 0, glm::dvec3(1.5),
                                 [&](double fraction) { return (last = std::max(last, fraction)) < 0.1; }),
                      Cancelled);
    REQUIRE(last < 0.3);
}
