#include "catch.h"

#include "isospline/spline/samples.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

using namespace isospline;

namespace {

template <typename Sample>
SampleView view_of(const std::vector<Sample>& samples, SampleType type, const glm::ivec3& shape)
{
    constexpr std::ptrdiff_t size = sizeof(Sample);
    return {samples.data(), type, shape, {size, size * shape.x, size * shape.x * shape.y}};
}

template <typename Sample>
void check_type(SampleType type)
{
    const glm::ivec3 shape(131, 3, 2);
    std::vector<Sample> samples(131 * 3 * 2);
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<Sample>((i * 37) % 120);
    samples[200] = std::numeric_limits<Sample>::lowest();
    samples[777] = static_cast<Sample>(125);
    auto view = view_of(samples, type, shape);

    const auto check = [&] {
        const auto range = sample_range(view);
        REQUIRE(range.minimum == static_cast<double>(std::numeric_limits<Sample>::lowest()));
        REQUIRE(range.maximum == 125.0);
        std::vector<float> row(100);
        read_row(view, {7, 2, 1}, 100, 60.0, 0.5, row.data());
        for (std::size_t i = 0; i < row.size(); ++i) {
            const auto sample = static_cast<double>((((3 + 2) * 131 + 7 + i) * 37) % 120);
            if ((3 + 2) * 131 + 7 + i != 777)
                REQUIRE(row[i] == static_cast<float>(0.5 * (sample - 60.0)));
        }
    };
    check();

    // The same in the other byte order.
    for (Sample& sample : samples) {
        auto* const bytes = reinterpret_cast<std::byte*>(&sample);
        std::reverse(bytes, bytes + sizeof(Sample));
    }
    view.byte_swapped = true;
    check();
}

} // namespace

TEST_CASE("samples of every type and both byte orders are read", "[spline]")
{
    check_type<std::uint8_t>(SampleType::uint8);
    check_type<std::int8_t>(SampleType::int8);
    check_type<std::uint16_t>(SampleType::uint16);
    check_type<std::int16_t>(SampleType::int16);
    check_type<std::uint32_t>(SampleType::uint32);
    check_type<std::int32_t>(SampleType::int32);
    check_type<std::uint64_t>(SampleType::uint64);
    check_type<std::int64_t>(SampleType::int64);
    check_type<float>(SampleType::float32);
    check_type<double>(SampleType::float64);
}

TEST_CASE("every finite half-precision number is read", "[spline]")
{
    std::vector<std::uint16_t> samples(0x10000);
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<std::uint16_t>(i);
    const auto view = view_of(samples, SampleType::float16, {0x10000, 1, 1});
    std::vector<float> row(samples.size());
    read_row(view, {0, 0, 0}, 0x10000, 0.0, 1.0, row.data());
    for (std::size_t i = 0; i < row.size(); ++i) {
        const auto exponent = static_cast<int>((i >> 10) & 31u);
        const auto fraction = static_cast<double>(i & 1023u);
        const double sign = i < 0x8000 ? 1.0 : -1.0;
        if (exponent == 31)
            REQUIRE((fraction == 0.0 ? std::isinf(row[i]) : std::isnan(row[i])));
        else if (exponent == 0)
            REQUIRE(static_cast<double>(row[i]) == sign * std::ldexp(fraction, -24));
        else
            REQUIRE(static_cast<double>(row[i]) == sign * std::ldexp(1024.0 + fraction, exponent - 25));
    }
}

TEST_CASE("samples are read with any strides", "[spline]")
{
    std::vector<std::int16_t> samples(5 * 70 * 4);
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<std::int16_t>(i);
    // x varies slowest and runs backwards, y varies fastest.
    const SampleView view{samples.data() + 69 * 20, SampleType::int16, {70, 4, 5}, {-40, 2, 8}};
    std::vector<float> row(70);
    read_row(view, {0, 3, 2}, 70, 0.0, 1.0, row.data());
    for (std::size_t x = 0; x < row.size(); ++x)
        REQUIRE(row[x] == static_cast<float>((69 - x) * 20 + 3 + 2 * 4));
    REQUIRE(sample_range(view).minimum == 0.0);
    REQUIRE(sample_range(view).maximum == 1399.0);
}

TEST_CASE("large offsets do not cost digits", "[spline]")
{
    std::vector<double> samples(64);
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = 1e12 + static_cast<double>(i) / 64.0;
    std::vector<float> row(64);
    read_row(view_of(samples, SampleType::float64, {64, 1, 1}), {0, 0, 0}, 64, 1e12, 1.0, row.data());
    for (std::size_t i = 0; i < row.size(); ++i)
        REQUIRE(row[i] == static_cast<float>(i) / 64.0f);
}
