#include "catch.h"

#include "isospline/math/affine.h"
#include "isospline/spline/cell_weights-inl.h"
#include "isospline/spline/line_filter.h"
#include "isospline/spline/sample.h"
#include "isospline/spline/volume.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

using namespace isospline;

namespace {

struct Samples {
    glm::ivec3 shape;
    std::vector<float> values;

    Samples(const glm::ivec3& size, unsigned seed) : shape(size)
    {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> unit(-3.0f, 5.0f);
        values.resize(static_cast<std::size_t>(shape.x) * static_cast<std::size_t>(shape.y) *
                      static_cast<std::size_t>(shape.z));
        for (float& value : values)
            value = unit(random);
    }

    float& at(int x, int y, int z) { return values[static_cast<std::size_t>(x + shape.x * (y + shape.y * z))]; }
    SampleView view() const
    {
        constexpr std::ptrdiff_t size = sizeof(float);
        return {values.data(), SampleType::float32, shape, {size, size * shape.x, size * shape.x * shape.y}};
    }
};

VolumeOptions options_of(int degree, Boundary boundary)
{
    VolumeOptions options;
    options.degree = degree;
    options.boundary = boundary;
    return options;
}

} // namespace

TEST_CASE("an interpolating volume passes through its samples", "[spline][threads]")
{
    for (const auto& shape :
         {glm::ivec3(1, 1, 1), glm::ivec3(2, 1, 3), glm::ivec3(3, 2, 2), glm::ivec3(17, 70, 5), glm::ivec3(131, 4, 66)})
        for (int degree = 0; degree <= 5; ++degree)
            for (const auto boundary : {Boundary::mirror, Boundary::periodic}) {
                Samples samples(shape, 3);
                const Volume volume(samples.view(), options_of(degree, boundary));
                double worst = 0.0;
                for (int z = 0; z < shape.z; ++z)
                    for (int y = 0; y < shape.y; ++y)
                        for (int x = 0; x < shape.x; ++x)
                            worst = std::max(
                                worst, std::abs(volume.value({x, y, z}) - static_cast<double>(samples.at(x, y, z))));
                // Noise is the worst case: at degree 5 its coefficients are many times as large as the samples, and so
                // is the rounding of a float32.
                constexpr double range = 8.0;
                REQUIRE(worst < (degree < 5 ? 1e-6 : 2e-6) * range);
            }
}

TEST_CASE("a volume is the same from its stored coefficients", "[spline]")
{
    for (int degree = 0; degree <= 5; ++degree)
        for (const auto boundary : {Boundary::mirror, Boundary::periodic}) {
            const Samples samples({17, 9, 5}, 3);
            VolumeOptions options = options_of(degree, boundary);
            options.origin = {1.0, 2.0, 3.0};
            options.spacing = {0.5, 1.0, 2.0};
            const Volume volume(samples.view(), options);
            const Volume again(options, volume.summary(), volume.stored_coefficients());
            CHECK(again.shape() == volume.shape());
            CHECK(again.index_to_world() == volume.index_to_world());
            CHECK(again.world_to_lattice() == volume.world_to_lattice());
            CHECK(again.minimum() == volume.minimum());
            CHECK(again.maximum() == volume.maximum());
            const auto given = volume.stored_coefficients(), stored = again.stored_coefficients();
            CHECK(std::vector<float>(stored.begin(), stored.end()) == std::vector<float>(given.begin(), given.end()));
            for (const glm::dvec3 point : {glm::dvec3(2.25, 3.5, 1.75), glm::dvec3(-3.0, 20.0, 4.9)}) {
                CHECK(again.value(point) == volume.value(point));
                CHECK(again.gradient(point) == volume.gradient(point));
            }
            CHECK_THROWS_AS(Volume(options, volume.summary(), given.first(given.size() - 1)), std::invalid_argument);
        }
}

TEST_CASE("the padding of the coefficients follows the boundary rule", "[spline]")
{
    const Samples samples({6, 3, 2}, 4);
    for (int degree = 0; degree <= 5; ++degree)
        for (const auto boundary : {Boundary::mirror, Boundary::periodic}) {
            const Volume volume(samples.view(), options_of(degree, boundary));
            const int padding = volume.padding();
            const auto coefficient = [&](int x, int y, int z) {
                return *volume.cell_coefficients(x + padding, y + padding, z + padding);
            };
            for (int z = -padding; z < 2 + padding; ++z)
                for (int y = -padding; y < 3 + padding; ++y)
                    for (int x = -padding; x < 6 + padding; ++x)
                        REQUIRE(coefficient(x, y, z) == coefficient(detail::inside_index(x, 6, boundary),
                                                                    detail::inside_index(y, 3, boundary),
                                                                    detail::inside_index(z, 2, boundary)));
        }
}

TEST_CASE("the coefficients of a cell give the model inside of it", "[spline]")
{
    const Samples samples({5, 4, 6}, 5);
    const Volume volume(samples.view(), options_of(2, Boundary::mirror));
    std::mt19937 random(6);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int z = 0; z < volume.cell_shape().z; ++z)
        for (int y = 0; y < volume.cell_shape().y; ++y)
            for (int x = 0; x < volume.cell_shape().x; ++x) {
                const glm::dvec3 s(unit(random), unit(random), unit(random));
                const auto u = scalar::cell_weights<2>(s.x), v = scalar::cell_weights<2>(s.y),
                           w = scalar::cell_weights<2>(s.z);
                const float* const first = volume.cell_coefficients(x, y, z);
                double sum = volume.offset();
                for (std::size_t k = 0; k < 3; ++k)
                    for (std::size_t j = 0; j < 3; ++j)
                        for (std::size_t i = 0; i < 3; ++i)
                            sum += u[i] * v[j] * w[k] *
                                   static_cast<double>(first[static_cast<std::ptrdiff_t>(i) +
                                                             static_cast<std::ptrdiff_t>(j) * volume.row_stride() +
                                                             static_cast<std::ptrdiff_t>(k) * volume.slice_stride()]);
                const glm::dvec3 index = glm::dvec3(x, y, z) + s - volume.lattice_shift();
                REQUIRE(volume.value(index) == Approx(sum).epsilon(1e-12));
            }
}

TEST_CASE("derivatives are those of the values, in world space too", "[spline]")
{
    const Samples samples({7, 6, 5}, 7);
    VolumeOptions options = options_of(3, Boundary::mirror);
    options.spacing = {0.5, 2.0, 1.25};
    options.origin = {-3.0, 10.0, 0.25};
    options.direction = {glm::dvec3(0.6, 0.8, 0.0), glm::dvec3(-0.8, 0.6, 0.0), glm::dvec3(0.0, 0.0, -1.0)};
    const Volume volume(samples.view(), options);
    std::mt19937 random(8);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 50; ++trial) {
        const glm::dvec3 index(6.0 * unit(random), 5.0 * unit(random), 4.0 * unit(random));
        const glm::dvec3 position = transform_point(volume.index_to_world(), index);
        const glm::dvec3 gradient = gradient_at(volume, position);
        const glm::dmat3 hessian = hessian_at(volume, position);
        const double h = 1e-5;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0.0);
            step[axis] = h;
            const double slope = (value_at(volume, position + step) - value_at(volume, position - step)) / (2.0 * h);
            REQUIRE(gradient[axis] == Approx(slope).margin(1e-4));
            const glm::dvec3 bend =
                (gradient_at(volume, position + step) - gradient_at(volume, position - step)) / (2.0 * h);
            REQUIRE(glm::length(hessian[axis] - bend) < 2e-2);
        }
    }
}

TEST_CASE("a constant volume is constant exactly", "[spline]")
{
    Samples samples({9, 8, 7}, 9);
    for (float& value : samples.values)
        value = 1234567.0f;
    for (int degree = 0; degree <= 5; ++degree) {
        const Volume volume(samples.view(), options_of(degree, Boundary::mirror));
        REQUIRE(volume.minimum() == 1234567.0);
        REQUIRE(volume.value({3.3, 100.7, -2.9}) == 1234567.0);
        REQUIRE(volume.gradient({3.3, 1.7, 2.9}) == glm::dvec3(0.0));
    }
}

TEST_CASE("the spaces of a volume meet", "[spline]")
{
    const Samples samples({4, 5, 6}, 10);
    for (int degree = 0; degree <= 3; ++degree) {
        VolumeOptions options = options_of(degree, Boundary::mirror);
        options.spacing = {1.0, 2.0, 3.0};
        options.origin = {10.0, 20.0, 30.0};
        const Volume volume(samples.view(), options);
        const double edge = degree % 2 == 0 ? 0.5 : 0.0;
        REQUIRE(volume.bounds().lower == glm::dvec3(10.0 - edge, 20.0 - 2.0 * edge, 30.0 - 3.0 * edge));
        REQUIRE(volume.bounds().upper == glm::dvec3(13.0 + edge, 28.0 + 2.0 * edge, 45.0 + 3.0 * edge));
        const glm::dvec3 world = transform_point(volume.index_to_world(), {1.0, 2.0, 3.0});
        REQUIRE(world == glm::dvec3(11.0, 24.0, 39.0));
        REQUIRE(glm::length(transform_point(volume.world_to_lattice(), world) - glm::dvec3(1.0, 2.0, 3.0) - edge) <
                1e-12);
        REQUIRE(glm::length(transform_point(volume.lattice_to_world(), {edge, edge, edge}) - options.origin) < 1e-12);
    }
}

TEST_CASE("a volume needs little more memory than its coefficients", "[spline]")
{
    const Samples samples({96, 128, 80}, 11);
    const auto size = static_cast<double>(samples.values.size() * sizeof(float));
    for (int degree = 0; degree <= 3; ++degree) {
        const Volume volume(samples.view(), options_of(degree, Boundary::mirror));
        REQUIRE(static_cast<double>(volume.memory()) < 1.1 * size);
    }
}

TEST_CASE("bad input to a volume is named", "[spline]")
{
    Samples samples({5, 4, 3}, 12);
    const auto options = [](auto change) {
        VolumeOptions changed;
        change(changed);
        return changed;
    };
    const auto view = samples.view();
    REQUIRE_THROWS_WITH(Volume(SampleView{nullptr, SampleType::float32, {2, 2, 2}, {}}),
                        ContainsSubstring("data: expected samples, got none"));
    REQUIRE_THROWS_WITH(Volume(view, options([](auto& o) { o.degree = 6; })), ContainsSubstring("degree"));
    REQUIRE_THROWS_WITH(Volume(view, options([](auto& o) { o.spacing.y = 0.0; })), ContainsSubstring("spacing"));
    REQUIRE_THROWS_WITH(Volume(view, options([](auto& o) { o.origin.z = NAN; })), ContainsSubstring("origin"));
    REQUIRE_THROWS_WITH(Volume(view, options([](auto& o) { o.direction[1] = o.direction[0]; })),
                        ContainsSubstring("direction"));
    REQUIRE_THROWS_WITH(Volume(view, options([](auto& o) { o.smoothing = 1.0; })), ContainsSubstring("smoothing"));
    REQUIRE_THROWS_AS(Volume(SampleView{}), std::invalid_argument);

    samples.at(2, 1, 2) = std::numeric_limits<float>::infinity();
    samples.at(3, 3, 1) = std::numeric_limits<float>::quiet_NaN();
    try {
        const Volume volume(view);
        FAIL("a volume of samples that are not finite was made");
    } catch (const NonFiniteSample& error) {
        REQUIRE(error.index == glm::ivec3(3, 3, 1));
        REQUIRE_THAT(error.what(), ContainsSubstring("(3, 3, 1)"));
    }
}

TEST_CASE("a volume that does not fit into memory is refused at once", "[spline]")
{
    const std::uint8_t sample = 0;
    REQUIRE_THROWS_AS(Volume({&sample, SampleType::uint8, {200000, 200000, 200000}, {0, 0, 0}}), std::length_error);
}

TEST_CASE("making a volume can be cancelled", "[spline][threads]")
{
    const Samples samples({64, 64, 64}, 13);
    double last = 0.0;
    const Volume volume(samples.view(), {}, [&](double fraction) {
        REQUIRE(fraction >= last);
        last = fraction;
        return true;
    });
    REQUIRE(last == 1.0);
    REQUIRE_THROWS_AS(Volume(samples.view(), {}, [](double fraction) { return fraction < 0.5; }), Cancelled);
}

TEST_CASE("primitive ids count the cells of a volume, x fastest", "[spline]")
{
    for (int degree = 1; degree <= 3; ++degree) {
        const Samples samples({6, 4, 5}, 9);
        const Volume volume(samples.view(), options_of(degree, Boundary::mirror));
        const glm::ivec3 shape = volume.cell_shape();
        std::uint64_t next = 0;
        for (int z = 0; z < shape.z; ++z)
            for (int y = 0; y < shape.y; ++y)
                for (int x = 0; x < shape.x; ++x, ++next) {
                    REQUIRE(volume.primitive_id({x, y, z}) == next);
                    REQUIRE(volume.cell_at(next) == glm::ivec3(x, y, z));
                }
        REQUIRE(volume.cell_count() == next);
    }
}
