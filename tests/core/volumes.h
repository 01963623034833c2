// Volumes of given and of random samples, for tests.
#pragma once

#include "isospline/spline/volume.h"

#include <cstddef>
#include <memory>
#include <random>
#include <vector>

namespace isospline {

/// The samples are in the order of memory, x fastest.
inline std::shared_ptr<const Volume> make_volume(const std::vector<float>& samples, const glm::ivec3& shape,
                                                 const VolumeOptions& options = {})
{
    constexpr std::ptrdiff_t step = sizeof(float);
    return std::make_shared<const Volume>(
        SampleView{samples.data(), SampleType::float32, shape, {step, step * shape.x, step * shape.x * shape.y}},
        options);
}

/// The samples are sample(x, y, z), in the order of memory.
template <typename Sample>
std::shared_ptr<const Volume> sampled_volume(const Sample& sample, const glm::ivec3& shape,
                                             const VolumeOptions& options = {})
{
    std::vector<float> samples;
    for (int z = 0; z < shape.z; ++z)
        for (int y = 0; y < shape.y; ++y)
            for (int x = 0; x < shape.x; ++x)
                samples.push_back(static_cast<float>(sample(x, y, z)));
    return make_volume(samples, shape, options);
}

/// Samples between -1 and 1.
inline std::shared_ptr<const Volume> noise_volume(const glm::ivec3& shape, const VolumeOptions& options = {},
                                                  unsigned seed = 1)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> noise(-1.0f, 1.0f);
    const glm::vec<3, std::size_t> size(shape);
    std::vector<float> samples(size.x * size.y * size.z);
    for (float& sample : samples)
        sample = noise(random);
    return make_volume(samples, shape, options);
}

inline std::shared_ptr<const Volume> noise_volume(const glm::ivec3& shape, int degree)
{
    VolumeOptions options;
    options.degree = degree;
    return noise_volume(shape, options);
}

/// Integers from 0 to 3, so that many samples equal a level.
inline std::shared_ptr<const Volume> integer_volume(const glm::ivec3& shape, int degree)
{
    std::mt19937 random(7);
    std::uniform_int_distribution<int> value(0, 3);
    const glm::vec<3, std::size_t> size(shape);
    std::vector<float> samples(size.x * size.y * size.z);
    for (float& sample : samples)
        sample = static_cast<float>(value(random));
    VolumeOptions options;
    options.degree = degree;
    return make_volume(samples, shape, options);
}

} // namespace isospline
