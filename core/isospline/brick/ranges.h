// Smallest and largest coefficient of every brick of cells.
#pragma once

#include "isospline/brick/brick.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace isospline {

class Volume;

/// Bounds of the coefficients that reach the cells of each brick. B-splines are non-negative and sum to one, so these
/// bound f - offset in the brick too. Computed once a volume; all levels and all surfaces of the volume share them.
class BrickRanges {
public:
    struct Range {
        float lower, upper;
        /// Whether both signs of (coefficient - threshold) occur, a coefficient equal to the threshold being above.
        bool straddles(double threshold) const { return lower < threshold && upper >= threshold; }
    };

    /// Of the eight bricks of an octet; of those beyond the grid, lower > upper.
    struct Octet {
        std::array<float, 8> lower, upper;

        Range brick(std::size_t child) const { return {lower[child], upper[child]}; }
    };

    explicit BrickRanges(const Volume& volume);

    /// Octets along x, y, z.
    const glm::ivec3& shape() const { return shape_; }
    /// Octet (x, y, z) is at index x + shape.x * (y + shape.y * z).
    const std::vector<Octet>& octets() const { return octets_; }
    /// The bricks of an octet that straddle a threshold: bit i for child i.
    unsigned straddling(std::size_t octet, double threshold) const;
    std::size_t memory() const { return octets_.capacity() * sizeof(Octet); }

private:
    glm::ivec3 shape_{0};
    std::vector<Octet> octets_;
};

} // namespace isospline
