#include "catch.h"

#include "isospline/spline/basis.h"
#include "isospline/spline/cell_weights-inl.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <random>

using namespace isospline;

namespace {

template <int Degree>
void check_cell_basis()
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 100; ++trial) {
        const double s = trial == 0 ? 0.0 : trial == 1 ? 1.0 : unit(random);
        const auto basis = scalar::cell_basis<Degree>(s);
        double sum = 0.0, slope = 0.0, curvature = 0.0;
        for (int j = 0; j <= Degree; ++j) {
            const auto at = static_cast<std::size_t>(j);
            const double x = s + 0.5 * (Degree - 1) - j;
            // beta^0 is halved at its jumps, where a cell's weight is its limit from inside.
            if (Degree > 1 || (s > 0.0 && s < 1.0)) {
                REQUIRE(basis.values[at] == Approx(bspline(Degree, x).value).margin(1e-14));
                REQUIRE(basis.first[at] == Approx(bspline(Degree, x).derivative).margin(1e-14));
            }
            REQUIRE(basis.values[at] >= 0.0);
            if (Degree > 2) {
                const double h = 1e-4;
                const double difference = bspline(Degree, x + h).derivative - bspline(Degree, x - h).derivative;
                REQUIRE(basis.second[at] == Approx(difference / (2.0 * h)).margin(1e-3));
            }
            sum += basis.values[at];
            slope += basis.first[at];
            curvature += basis.second[at];
        }
        REQUIRE(sum == Approx(1.0).epsilon(1e-14));
        REQUIRE(slope == Approx(0.0).margin(1e-14));
        REQUIRE(curvature == Approx(0.0).margin(1e-14));
    }
}

/// At the face of two cells, x being 0 in the one behind it.
template <int Degree, typename Number>
void check_shared_weights()
{
    const auto value = [](Number weight) {
        if constexpr (std::is_same_v<Number, double>)
            return weight;
        else
            return hwy::HWY_NAMESPACE::GetLane(weight);
    };
    const auto before = scalar::cell_weights<Degree>(scalar::number<Number>(1.0));
    const auto behind = scalar::cell_weights<Degree>(scalar::number<Number>(0.0));
    REQUIRE(value(before[0]) == 0);
    REQUIRE(value(behind[Degree]) == 0);
    for (std::size_t j = 0; j < Degree; ++j)
        REQUIRE(value(before[j + 1]) == value(behind[j]));
}

} // namespace

TEST_CASE("the weights of a cell are B-splines, not negative, and sum to one", "[spline]")
{
    check_cell_basis<0>();
    check_cell_basis<1>();
    check_cell_basis<2>();
    check_cell_basis<3>();
    check_cell_basis<4>();
    check_cell_basis<5>();
}

TEST_CASE("cells that share a face have the same weights for shared coefficients, bit for bit", "[spline]")
{
    using Single = hwy::HWY_NAMESPACE::Vec<hwy::HWY_NAMESPACE::CappedTag<float, 1>>;
    check_shared_weights<1, double>();
    check_shared_weights<2, double>();
    check_shared_weights<3, double>();
    check_shared_weights<1, Single>();
    check_shared_weights<2, Single>();
    check_shared_weights<3, Single>();
}

TEST_CASE("Bernstein coefficients of a cell are those of the same spline", "[spline]")
{
    std::mt19937 random(4);
    std::normal_distribution<double> value;
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const auto check = [&]<int Degree>() {
        std::array<double, Degree + 1> c;
        for (double& coefficient : c)
            coefficient = value(random);
        auto b = scalar::bernstein_of_bspline<Degree>(c);
        const double s = unit(random);
        const auto weights = scalar::cell_weights<Degree>(s);
        double spline = 0.0;
        for (std::size_t j = 0; j <= Degree; ++j)
            spline += weights[j] * c[j];
        for (std::size_t level = Degree; level > 0; --level)
            for (std::size_t i = 0; i < level; ++i)
                b[i] = (1.0 - s) * b[i] + s * b[i + 1];
        REQUIRE(b[0] == Approx(spline).margin(1e-14));
    };
    for (int repetition = 0; repetition < 100; ++repetition) {
        check.operator()<1>();
        check.operator()<2>();
        check.operator()<3>();
    }
}
