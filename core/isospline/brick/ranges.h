// Smallest and largest coefficient of every brick of cells, and, in codes, of every block.
#pragma once

#include "isospline/brick/brick.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
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
    /// The blocks of a brick that straddles a threshold which may straddle it too: bit i for block i. Some that do not
    /// may be among them, as the ranges of blocks are rounded outwards.
    std::uint64_t straddling_blocks(std::size_t octet, int child, double threshold) const;
    std::size_t memory() const { return octets_.capacity() * sizeof(Octet) + blocks_.capacity() * sizeof(BlockCodes); }

private:
    /// The ranges of a brick's blocks, from 0 at the lower to 255 at the upper end of the brick's own.
    struct BlockCodes {
        alignas(64) std::array<std::uint8_t, blocks_per_brick> lower, upper;
    };

    glm::ivec3 shape_{0};
    std::vector<Octet> octets_;
    std::vector<BlockCodes> blocks_; ///< of brick `child` of octet i: item 8 i + child
};

/// The ranges of a volume: those that a surface of it has already, as long as one does. Any thread may call.
std::shared_ptr<const BrickRanges> shared_ranges(const std::shared_ptr<const Volume>& volume);

} // namespace isospline
