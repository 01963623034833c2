// Volumes of random samples between -1 and 1, for tests.
#pragma once

#include "isospline/spline/volume.h"

#include <cstddef>
#include <memory>
#include <random>
#include <vector>

namespace isospline {

inline std::shared_ptr<const Volume> noise_volume(const glm::ivec3& shape, const VolumeOptions& options = {},
                                                  unsigned seed = 1)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> noise(-1.0f, 1.0f);
    const glm::vec<3, std::size_t> size(shape);
    std::vector<float> samples(size.x * size.y * size.z);
    for (float& sample : samples)
        sample = noise(random);
    constexpr std::ptrdiff_t step = sizeof(float);
    return std::make_shared<const Volume>(
        SampleView{samples.data(), SampleType::float32, shape, {step, step * shape.x, step * shape.x * shape.y}},
        options);
}

inline std::shared_ptr<const Volume> noise_volume(const glm::ivec3& shape, int degree)
{
    VolumeOptions options;
    options.degree = degree;
    return noise_volume(shape, options);
}

} // namespace isospline
