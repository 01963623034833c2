#include "catch.h"

#include "isospline/spline/line_filter.h"

#include <hwy/aligned_allocator.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

using namespace isospline;
using detail::LineFilter;

namespace {

/// One line filtered by the definition, in float64: forth from far before its begin, and back from far beyond its end.
std::vector<double> filtered(const RecursiveFilter& filter, const std::vector<float>& line, Boundary boundary)
{
    const auto size = static_cast<int>(line.size());
    const int far = static_cast<int>(80.0 / -std::log(filter.largest_pole)) + 10;
    std::vector<double> values;
    for (int i = -far; i < size + far; ++i)
        values.push_back(static_cast<double>(line[static_cast<std::size_t>(detail::inside_index(i, size, boundary))]));
    for (int direction = 0; direction < 2; ++direction) {
        for (std::size_t i = 0; i < values.size(); ++i)
            for (std::size_t k = 0; k < std::min(filter.feedback.size(), i); ++k)
                values[i] += filter.feedback[k] * values[i - 1 - k];
        std::reverse(values.begin(), values.end());
    }
    std::vector<double> result;
    for (auto i = static_cast<std::size_t>(far); i < static_cast<std::size_t>(far + size); ++i) {
        double sum = filter.numerator.empty() ? values[i] : filter.numerator[0] * values[i];
        for (std::size_t k = 1; k < filter.numerator.size(); ++k)
            sum += filter.numerator[k] * (values[i - k] + values[i + k]);
        result.push_back(sum * filter.gain);
    }
    return result;
}

/// Filters a few lines both along and across memory.
void check_lines(const RecursiveFilter& filter, int size, int lines, Boundary boundary)
{
    std::mt19937 random(static_cast<unsigned>(size * 100 + lines));
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    const auto samples = static_cast<std::size_t>(size), count = static_cast<std::size_t>(lines);
    std::vector<float> along(samples * count), across(samples * count);
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t i = 0; i < samples; ++i)
            along[k * samples + i] = across[i * count + k] = unit(random);

    const auto before = along;
    const LineFilter line_filter(filter, size, boundary);
    const auto buffer = hwy::AllocateAligned<double>(line_filter.buffer_size());
    detail::filter_rows(line_filter, along.data(), size, lines, buffer.get());
    detail::filter_columns(line_filter, across.data(), lines, lines, buffer.get());

    for (std::size_t k = 0; k < count; ++k) {
        const auto begin = before.begin() + static_cast<std::ptrdiff_t>(k * samples);
        const auto expected = filtered(filter, {begin, begin + size}, boundary);
        for (std::size_t i = 0; i < samples; ++i) {
            REQUIRE(filter.gain * static_cast<double>(along[k * samples + i]) == Approx(expected[i]).margin(2e-6));
            REQUIRE(across[i * count + k] == along[k * samples + i]);
        }
    }
}

} // namespace

TEST_CASE("lines are filtered as defined, with every instruction set of the machine", "[spline]")
{
    for (auto targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
        const auto target = targets & -targets;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        INFO(hwy::TargetName(target));
        for (const auto boundary : {Boundary::mirror, Boundary::periodic})
            for (const int size : {2, 3, 4, 13, 100})
                for (const int lines : {1, 6, detail::strip_width}) {
                    for (int degree = 2; degree <= 5; ++degree)
                        check_lines(design_filter(degree, Filter::interpolate, 0.0), size, lines, boundary);
                    for (int degree = 0; degree <= 5; ++degree)
                        check_lines(design_filter(degree, Filter::smoothing, 20.0), size, lines, boundary);
                }
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}
