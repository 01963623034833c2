// Cells whose coefficients are random numbers, and rays at them.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/spline/volume.h"

#include <cstddef>
#include <random>
#include <vector>

namespace isospline {

/// A volume whose coefficients are the given samples.
inline Volume volume_of_coefficients(const std::vector<float>& samples, glm::ivec3 shape, int degree)
{
    VolumeOptions options;
    options.degree = degree;
    options.filter = Filter::none;
    const std::ptrdiff_t size = sizeof(float);
    return Volume({samples.data(), SampleType::float32, shape, {size, size * shape.x, size * shape.x * shape.y}},
                  options);
}

inline std::vector<float> random_samples(std::size_t count, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<float> value;
    std::vector<float> samples(count);
    for (float& sample : samples)
        sample = value(random);
    return samples;
}

/// Rays of many kinds at the unit cube at `lower`: through two random points near it, along axes, from inside.
inline Ray random_ray(std::mt19937& random, const glm::dvec3& lower)
{
    std::uniform_real_distribution<double> near_cell(-0.3, 1.3), within(0.0, 1.0);
    std::uniform_int_distribution<int> kind(0, 4), axis(0, 2);
    const glm::dvec3 a(near_cell(random), near_cell(random), near_cell(random));
    const glm::dvec3 b(within(random), within(random), within(random));
    Ray ray;
    ray.direction = b - a;
    ray.origin = lower + a - 3.0 * ray.direction;
    switch (kind(random)) {
    case 0: // along an axis
        ray.direction = glm::dvec3(0.0);
        ray.direction[axis(random)] = 1.0;
        ray.origin = lower + b - 3.0 * ray.direction;
        break;
    case 1: // in a plane of two axes
        ray.direction[axis(random)] = 0.0;
        ray.origin = lower + b - 3.0 * ray.direction;
        break;
    case 2: // begins inside
        ray.origin = lower + b;
        break;
    }
    return ray;
}

} // namespace isospline
