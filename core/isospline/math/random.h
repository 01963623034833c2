// Random numbers as a function of a counter: any thread can compute any of them at any time, and gets the same number.
#pragma once

#include <glm/vec2.hpp>

#include <array>
#include <cstdint>

namespace isospline {

/// pcg4d: M. Jarzynski, M. Olano, "Hash functions for GPU rendering", Journal of Computer Graphics Techniques 9(3),
/// 2020. Maps four words to four well-mixed words.
inline std::array<std::uint32_t, 4> pcg4d(std::array<std::uint32_t, 4> v)
{
    const auto mix = [&v] {
        v[0] += v[1] * v[3];
        v[1] += v[2] * v[0];
        v[2] += v[0] * v[1];
        v[3] += v[1] * v[2];
    };
    for (std::uint32_t& word : v)
        word = word * 1664525u + 1013904223u;
    mix();
    for (std::uint32_t& word : v)
        word ^= word >> 16;
    mix();
    return v;
}

/// A number in [0, 1), from 32 random bits.
inline double to_unit_interval(std::uint32_t bits)
{
    return bits * 0x1p-32;
}

/// The random numbers of one sample of one pixel: independent of those of all others, the same in every run.
class RandomSequence {
public:
    RandomSequence(const glm::ivec2& pixel, std::uint32_t sample, std::uint32_t seed = 0)
        : key_{static_cast<std::uint32_t>(pixel.x), static_cast<std::uint32_t>(pixel.y), sample, seed}
    {
    }

    /// The next number, in [0, 1).
    double next()
    {
        if (used_ == 4) {
            // Seed and count are hashed into one word, so that consecutive seeds share no numbers.
            const std::uint32_t stream = pcg4d({key_[3], count_++, 0x9e3779b9u, 0})[0];
            words_ = pcg4d({key_[0], key_[1], key_[2], stream});
            used_ = 0;
        }
        return to_unit_interval(words_[used_++]);
    }

    glm::dvec2 next2()
    {
        const double x = next();
        return {x, next()};
    }

private:
    std::array<std::uint32_t, 4> key_, words_{};
    std::uint32_t count_ = 0;
    std::size_t used_ = 4;
};

} // namespace isospline
