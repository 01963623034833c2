#include "isospline/query/foot_proof.h"

#include "catch.h"
#include "volumes.h"

#include "isospline/polygonize/lattice_field.h"
#include "isospline/shell/isosurface.h"
#include "isospline/spline/degree.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

using namespace isospline;

namespace {

/// f = z in the middle of a volume.
std::shared_ptr<const Volume> ramp(int degree)
{
    const glm::ivec3 shape{9, 9, 9};
    std::vector<float> samples;
    for (int z = 0; z < 9; ++z)
        samples.insert(samples.end(), 81, static_cast<float>(z));
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    return make_volume(samples, shape, options);
}

/// Whether f has the sign that it has in the middle everywhere in a ball in the world, as far as samples show.
template <int Degree>
bool is_free_of_surface(const LatticeField<Degree>& field, const LatticeMetric& metric, const glm::dvec3& point,
                        double radius)
{
    constexpr int steps = 12;
    const bool is_above = field.value(point) >= 0.0;
    const glm::dvec3 shape(field.surface().volume().cell_shape());
    for (int k = -steps; k <= steps; ++k)
        for (int j = -steps; j <= steps; ++j)
            for (int i = -steps; i <= steps; ++i) {
                const glm::dvec3 offset = radius / steps * glm::dvec3(i, j, k);
                const glm::dvec3 at = point + metric.to_lattice * offset;
                if (glm::length(offset) < radius && at == glm::clamp(at, glm::dvec3(0.0), shape) &&
                    (field.value(at) >= 0.0) != is_above)
                    return false;
            }
    return true;
}

} // namespace

TEST_CASE("the foot on a plane is proven at once", "[query]")
{
    for (const int degree : {2, 3})
        dispatch_degree(degree, [](auto n) {
            const auto surface = Isosurface(ramp(n), 4.2).snapshot();
            const LatticeMetric metric(surface->volume().lattice_to_world());
            FootProof<n> proof(*surface, metric);
            REQUIRE(!proof.clears({4, 4, 4}, glm::dvec3(0.0), glm::dvec3(1.0))); // without a foot
            for (const double height : {-1.2, -0.3, 0.4, 1.1}) {
                const glm::dvec3 point{4.3, 4.6, 4.2 + 0.5 * (n == 2) + height};
                const auto foot = find_foot<n>(*surface, metric, point);
                REQUIRE(foot);
                REQUIRE(foot->distance == Approx(std::abs(height)).margin(1e-6));
                proof.begin(point, *foot);
                REQUIRE(proof.is_nearest());
                // What is farther than the tangent plane is cleared too.
                REQUIRE(proof.clears(foot->cell, glm::dvec3(0.0), glm::dvec3(1.0)));
                proof.clear();
                REQUIRE(!proof.clears(foot->cell, glm::dvec3(0.0), glm::dvec3(1.0)));
            }
        });
}

TEST_CASE("no point of the surface is nearer than a foot that is proven", "[query]")
{
    VolumeOptions options;
    options.spacing = {1.0, 0.7, 1.4};
    options.filter = Filter::none; // smooth noise
    for (const int degree : {1, 2, 3})
        dispatch_degree(degree, [&](auto n) {
            options.degree = n;
            const auto volume = noise_volume({14, 14, 14}, options);
            const auto surface = Isosurface(volume, 0.05).snapshot();
            const LatticeMetric metric(volume->lattice_to_world());
            const LatticeField<n> field(*surface, 1);
            FootProof<n> proof(*surface, metric);
            std::mt19937 random(5);
            std::uniform_real_distribution<double> number(2.0, 11.0);
            int proven = 0, tried = 0;
            while (tried < 4000 && proven < 120) {
                const glm::dvec3 point(number(random), number(random), number(random));
                const auto foot = find_foot<n>(*surface, metric, point);
                if (!foot)
                    continue;
                ++tried;
                proof.begin(point, *foot);
                if (!proof.is_nearest())
                    continue;
                ++proven;
                REQUIRE(is_free_of_surface<n>(field, metric, point, foot->distance * (1.0 - 1e-6)));
            }
            REQUIRE(proven > 20);
        });
}

TEST_CASE("a foot is not proven where another sheet is nearer", "[query]")
{
    // f = |z - 4| - 1.2 but for the crease: two sheets, at 2.8 and 5.2.
    std::vector<float> samples;
    for (int i = 0; i < 9 * 9 * 9; ++i)
        samples.push_back(static_cast<float>(std::abs(i / 81 - 4)));
    VolumeOptions options;
    options.filter = Filter::none;
    const auto volume = make_volume(samples, {9, 9, 9}, options);
    const auto surface = Isosurface(volume, 1.2).snapshot();
    const LatticeMetric metric(volume->lattice_to_world());
    FootProof<2> proof(*surface, metric);
    const glm::dvec3 near_lower{4.5, 4.5, 3.9}, near_upper{4.5, 4.5, 5.1}; // lattice: index + 1/2
    const auto foot_above = find_foot<2>(*surface, metric, near_upper);
    REQUIRE(foot_above);
    const auto foot_at = [&](const glm::dvec3& point) {
        return Foot::at(metric, point, foot_above->cell, foot_above->local,
                        foot_above->gradient_world * metric.to_world);
    };
    const auto far_foot = foot_at(near_lower);
    REQUIRE(far_foot);
    proof.begin(near_lower, *far_foot);
    REQUIRE(!proof.is_nearest());
    REQUIRE(!foot_at(near_lower + glm::dvec3(1e-5, 0.0, 0.0))); // not perpendicular
}
