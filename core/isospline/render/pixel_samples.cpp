#include "isospline/render/pixel_samples.h"

#include "isospline/util/error.h"

#include <algorithm>
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

/// The odd number, coprime to n, that gives the lattice whose points keep farthest apart.
std::int64_t lattice_generator(std::int64_t n)
{
    // Good generators are many; the search of large lattices ends after the first few hundred.
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

} // namespace

std::vector<PixelSample> pixel_samples(int count)
{
    if (count < 1 || count > 65536)
        throw_invalid("samples", "rays a pixel, from 1 to 65536", count);

    // A lattice of rank one: every row and every column of a count x count grid holds one point. With an odd generator
    // the points are symmetric about the centre, so that more samples do not shift the picture.
    const std::int64_t generator = lattice_generator(count);
    const auto coordinate = [&](std::int64_t halves) {
        return static_cast<double>(halves % (2 * count)) / (2.0 * count);
    };
    std::vector<PixelSample> samples{{glm::dvec2(0.5), count % 2 == 0 ? 0.0 : 1.0 / count}};
    for (std::int64_t i = 0; i < count; ++i) {
        const glm::dvec2 position(coordinate(2 * i + 1), coordinate((2 * i + 1) * generator));
        if (position != glm::dvec2(0.5))
            samples.push_back({position, 1.0 / count});
    }
    return samples;
}

} // namespace isospline
