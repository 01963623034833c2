#include "catch.h"

#include "isospline/math/linear_program.h"
#include "isospline/math/linear_system.h"

#include <optional>
#include <random>

using namespace isospline;

namespace {

using Variables = std::array<double, 4>;

double product(const Variables& a, const Variables& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/// The largest objective at the points where four of the constraints are equations and the others hold.
std::optional<double> best_vertex(const Variables& objective, const std::vector<LinearConstraint<4>>& constraints)
{
    std::optional<double> best;
    const std::size_t count = constraints.size();
    for (std::size_t a = 0; a < count; ++a)
        for (std::size_t b = a + 1; b < count; ++b)
            for (std::size_t c = b + 1; c < count; ++c)
                for (std::size_t d = c + 1; d < count; ++d) {
                    LinearSystem<4> system;
                    std::size_t row = 0;
                    for (const std::size_t i : {a, b, c, d}) {
                        const auto& [normal, offset] = constraints[i];
                        system[row++] = {normal[0], normal[1], normal[2], normal[3], offset};
                    }
                    if (!solve(system, 4, 1e-9))
                        continue;
                    const Variables z{system[0][4], system[1][4], system[2][4], system[3][4]};
                    bool holds = true;
                    for (const auto& [normal, offset] : constraints)
                        holds = holds && product(normal, z) <= offset + 1e-9;
                    if (holds && !(best && *best >= product(objective, z)))
                        best = product(objective, z);
                }
    return best;
}

} // namespace

TEST_CASE("linear programs have the best vertex as solution", "[math]")
{
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> random(-1.0, 1.0);
    int solved = 0, impossible = 0;
    for (int program = 0; program < 400; ++program) {
        const Variables lower{-1.0, -0.5, -1.0, 0.0}, upper{1.0, 1.0, 0.25, 2.0};
        Variables objective;
        for (double& each : objective)
            each = random(engine);
        std::vector<LinearConstraint<4>> constraints(program % 7), all;
        for (auto& [normal, offset] : constraints) {
            for (double& each : normal)
                each = program % 3 ? random(engine) : std::round(2.0 * random(engine)); // parallel and axis-aligned too
            offset = random(engine);
        }
        all = constraints;
        for (std::size_t k = 0; k < 4; ++k) {
            all.push_back({{}, upper[k]});
            all.back().normal[k] = 1.0;
            all.push_back({{}, -lower[k]});
            all.back().normal[k] = -1.0;
        }
        Variables z;
        const auto expected = best_vertex(objective, all);
        REQUIRE(maximize<4>(objective, constraints, lower, upper, z) == expected.has_value());
        ++(expected ? solved : impossible);
        if (!expected)
            continue;
        REQUIRE(std::abs(product(objective, z) - *expected) < 1e-8);
        for (const auto& [normal, offset] : all)
            REQUIRE(product(normal, z) <= offset + 1e-8);
    }
    REQUIRE(solved > 200);
    REQUIRE(impossible > 20);
}
