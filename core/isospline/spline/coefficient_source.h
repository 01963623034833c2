// A source of coefficients that are not in the volume's memory.
#pragma once

#include <glm/vec3.hpp>

#include <cstddef>
#include <span>

namespace isospline {

class MemoryBudget;

/// Provides the coefficients of a volume box by box, as a store that loads only what rays need.
class CoefficientSource {
public:
    virtual ~CoefficientSource() = default;
    /// Copies the coefficients of a box of samples inside the volume. The coefficient of sample first + (x, y, z) goes
    /// to to[x + y * row_stride + z * slice_stride]. Any number of threads may call this at the same time, and every
    /// call gives the same numbers. An exception ends the query that made the call.
    virtual void copy(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
                      std::ptrdiff_t slice_stride) const = 0;
    /// The ranges of the volume's bricks in the layout of BrickRanges::Octet; empty if they are not known.
    virtual std::span<const float> brick_ranges() const { return {}; }
    /// The budget of the other data that is held for the volume, or null.
    virtual MemoryBudget* budget() const { return nullptr; }
    /// Bytes held by the source itself.
    virtual std::size_t memory() const { return 0; }
};

} // namespace isospline
