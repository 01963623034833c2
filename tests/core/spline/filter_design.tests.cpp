#include "catch.h"

#include "isospline/spline/basis.h"
#include "isospline/spline/filter_design.h"
#include "isospline/spline/line_filter.h"

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

using namespace isospline;

namespace {

using std::numbers::pi;

/// The filter's response at an angular frequency.
double response(const RecursiveFilter& filter, double frequency)
{
    std::complex<double> feedback = 1.0;
    for (std::size_t k = 0; k < filter.feedback.size(); ++k)
        feedback -= filter.feedback[k] * std::polar(1.0, -frequency * static_cast<double>(k + 1));
    double numerator = filter.numerator.empty() ? 1.0 : filter.numerator[0];
    for (std::size_t k = 1; k < filter.numerator.size(); ++k)
        numerator += 2.0 * filter.numerator[k] * std::cos(static_cast<double>(k) * frequency);
    return filter.gain * numerator / std::norm(feedback);
}

/// The sampled B-spline's.
double sampled_bspline(int degree, double frequency)
{
    double sum = bspline(degree, 0.0).value;
    for (int k = 1; k <= degree / 2; ++k)
        sum += 2.0 * bspline(degree, k).value * std::cos(k * frequency);
    return sum;
}

} // namespace

TEST_CASE("the poles of the interpolating filters are the known ones", "[spline]")
{
    REQUIRE(design_filter(2, Filter::interpolate, 0.0).feedback.at(0) == Approx(std::sqrt(8.0) - 3.0).epsilon(1e-14));
    REQUIRE(design_filter(3, Filter::interpolate, 0.0).feedback.at(0) == Approx(std::sqrt(3.0) - 2.0).epsilon(1e-14));
    REQUIRE(design_filter(4, Filter::interpolate, 0.0).largest_pole == Approx(0.361341225900220177).epsilon(1e-13));
    REQUIRE(design_filter(5, Filter::interpolate, 0.0).largest_pole == Approx(0.430575347099973791).epsilon(1e-13));
    for (int degree = 0; degree < 2; ++degree)
        REQUIRE(design_filter(degree, Filter::interpolate, 0.0).is_identity());
    for (int degree = 0; degree <= 5; ++degree)
        REQUIRE(design_filter(degree, Filter::none, 0.0).is_identity());
}

TEST_CASE("interpolating filters invert the sampled B-spline", "[spline]")
{
    for (int degree = 0; degree <= 5; ++degree)
        for (double frequency = 0.0; frequency <= pi; frequency += 0.1)
            REQUIRE(response(design_filter(degree, Filter::interpolate, 0.0), frequency) ==
                    Approx(1.0 / sampled_bspline(degree, frequency)).epsilon(1e-12));
}

TEST_CASE("smoothing filters solve the normal equations", "[spline]")
{
    for (int degree = 0; degree <= 5; ++degree)
        for (const double smoothing : {1e-12, 1e-6, 1e-2, 0.3, 1.0, 10.0, 1e3, 1e6, 1e9}) {
            const auto filter = design_filter(degree, Filter::smoothing, smoothing);
            REQUIRE(filter.largest_pole < 1.0);
            for (double frequency = 0.0; frequency <= pi; frequency += 0.1) {
                const int order = degree / 2 + 1;
                const double b = sampled_bspline(degree, frequency);
                const double difference = std::pow(2.0 - 2.0 * std::cos(frequency), order);
                const int reach = 2 * (degree - order) + 1;
                const double roughness = difference * (reach < 0 ? 1.0 : sampled_bspline(reach, frequency));
                REQUIRE(response(filter, frequency) ==
                        Approx(b / (b * b + smoothing * roughness)).epsilon(1e-6).margin(1e-12));
            }
        }
}

TEST_CASE("indices beyond a line are mirrored at its ends or wrapped", "[spline]")
{
    using detail::inside_index;
    const std::vector<int> mirrored{2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1};
    const std::vector<int> wrapped{0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
    for (int i = 0; i < 12; ++i) {
        REQUIRE(inside_index(i - 4, 4, Boundary::mirror) == mirrored[static_cast<std::size_t>(i)]);
        REQUIRE(inside_index(i - 4, 4, Boundary::periodic) == wrapped[static_cast<std::size_t>(i)]);
        REQUIRE(inside_index(i - 4, 1, Boundary::mirror) == 0);
        REQUIRE(inside_index(i - 4, 1, Boundary::periodic) == 0);
    }
}

TEST_CASE("beyond a filter's reach its response to an impulse is forgotten")
{
    for (const Filter kind : {Filter::interpolate, Filter::smoothing})
        for (int degree = 0; degree <= 5; ++degree) {
            const RecursiveFilter filter = design_filter(degree, kind, kind == Filter::smoothing ? 3.0 : 0.0);
            const int reach = filter_reach(filter);
            // The response at k is the mean of the filter's spectrum times cos(k frequency).
            constexpr int count = 4096;
            double sum = 0.0;
            for (int i = 0; i < count; ++i) {
                const double frequency = 2.0 * pi * i / count;
                sum += response(filter, frequency) * std::cos((reach + 1) * frequency) / count;
            }
            CAPTURE(degree, reach);
            if (filter.is_identity())
                CHECK(reach == 0);
            else
                CHECK(std::abs(sum) < 0x1p-38);
        }
    CHECK(filter_reach(design_filter(2, Filter::interpolate, 0.0)) == 16);
    CHECK(filter_reach(design_filter(3, Filter::interpolate, 0.0)) == 22);
    CHECK(filter_reach(design_filter(3, Filter::none, 0.0)) == 0);
}

TEST_CASE("the norm of a filter is what it multiplies the worst line by", "[spline]")
{
    // The closed form of one pole z: gain |z| / (1 - |z|)^2 = 2 and 3 for degrees 2 and 3 (Unser et al. 1993).
    REQUIRE(norm_of(design_filter(1, Filter::interpolate, 0.0)).whole == Approx(1.0).epsilon(1e-12));
    REQUIRE(norm_of(design_filter(2, Filter::interpolate, 0.0)).whole == Approx(2.0).epsilon(1e-12));
    REQUIRE(norm_of(design_filter(3, Filter::interpolate, 0.0)).whole == Approx(3.0).epsilon(1e-12));
    REQUIRE(norm_of(design_filter(2, Filter::none, 0.0)).whole == Approx(1.0).epsilon(1e-12));
    for (const double smoothing : {0.1, 1.0, 100.0})
        for (int degree = 1; degree <= 3; ++degree)
            REQUIRE(norm_of(design_filter(degree, Filter::smoothing, smoothing)).whole >= 1.0 - 1e-9);
}
