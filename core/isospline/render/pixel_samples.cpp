#include "isospline/render/pixel_samples.h"

#include "isospline/math/frame.h"
#include "isospline/util/error.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace isospline {

namespace {

/// Square of the smallest distance between two points (i, i k mod n) of a lattice on the torus of n x n.
std::int64_t separation(std::int64_t n, std::int64_t k)
{
    std::int64_t smallest = n * n;
    for (std::int64_t i = 1; i <= n / 2; ++i) {
        const std::int64_t step = i * k % n;
        const std::int64_t y = std::min(step, n - step);
        smallest = std::min(smallest, i * i + y * y);
    }
    return smallest;
}

/// The odd number, coprime to n, whose lattice has the largest minimum distance of points.
std::int64_t lattice_generator(std::int64_t n)
{
    // There are many good generators; the search in large lattices ends after a few hundred.
    std::int64_t best = 1;
    std::int64_t best_separation = 0;
    for (std::int64_t k = 1; k < std::min<std::int64_t>(2 * n, 1024); k += 2) {
        if (std::gcd(k, n) != 1)
            continue;
        const std::int64_t found = separation(n, k);
        if (found > best_separation) {
            best = k;
            best_separation = found;
        }
    }
    return best;
}

/// A point of the unit square from a pixel: pcg2d of M. Jarzynski, M. Olano, "Hash Functions for GPU Rendering",
/// Journal of Computer Graphics Techniques 9(3), 2020.
glm::dvec2 hash(glm::ivec2 pixel)
{
    constexpr std::uint32_t multiplier = 1664525u;
    std::uint32_t x = static_cast<std::uint32_t>(pixel.x) * multiplier + 1013904223u;
    std::uint32_t y = static_cast<std::uint32_t>(pixel.y) * multiplier + 1013904223u;
    for (int round = 0; round < 2; ++round) {
        x += y * multiplier;
        y += x * multiplier;
        x ^= x >> 16;
        y ^= y >> 16;
    }
    return glm::dvec2(x, y) * 0x1p-32;
}

} // namespace

std::vector<PixelSample> pixel_samples(int count, bool with_lens)
{
    if (count < 1 || count > 65536)
        throw_invalid("samples", "rays a pixel, from 1 to 65536", count);

    // A lattice of rank one: every row and every column of a count x count grid holds one point. With an odd generator
    // the points are symmetric about the centre, so that more samples do not shift the picture.
    const std::int64_t generator = lattice_generator(count);
    const auto coordinate = [&](std::int64_t halves) {
        return static_cast<double>(halves % (2 * count)) / (2.0 * count);
    };
    const bool has_centre = count % 2 == 1 && !with_lens;
    std::vector<PixelSample> samples{{glm::dvec2(0.5), has_centre ? 1.0 / count : 0.0, std::nullopt}};
    // Positions on the lens: the additive recurrence of the plastic number, whose terms are well separated.
    const glm::dvec2 lens_step(0.7548776662466927, 0.5698402909980532);
    for (std::int64_t i = 0; i < count; ++i) {
        PixelSample sample{{coordinate(2 * i + 1), coordinate((2 * i + 1) * generator)}, 1.0 / count, std::nullopt};
        if (has_centre && sample.position == glm::dvec2(0.5))
            continue;
        if (with_lens)
            sample.lens = glm::fract((static_cast<double>(i) + 0.5) * lens_step);
        samples.push_back(sample);
    }
    return samples;
}

glm::dvec2 lens_position(const glm::dvec2& lens, glm::ivec2 pixel)
{
    return to_disc(glm::fract(lens + hash(pixel)));
}

} // namespace isospline
