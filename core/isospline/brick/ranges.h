// Smallest and largest coefficient of every brick, and of every block as 8-bit codes.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/math/grid.h"
#include "isospline/spline/coefficient_view.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace isospline {

class Volume;

/// Bounds of the coefficients that influence the cells of each brick. B-splines are non-negative and sum to one, so the
/// same numbers bound f - offset in the brick. Computed once a volume; all levels and surfaces of the volume share
/// them.
class BrickRanges {
public:
    struct Range {
        float lower, upper;
        /// Whether both signs of (coefficient - threshold) occur. A coefficient equal to the threshold is above it.
        bool straddles(double threshold) const { return lower < threshold && upper >= threshold; }
    };

    /// The ranges of the eight bricks of an octet. Bricks beyond the grid have lower > upper.
    struct Octet {
        std::array<float, 8> lower, upper;

        Range brick(std::size_t child) const { return {lower[child], upper[child]}; }
    };

    /// Takes the ranges from the volume's source if it has them, or computes them from the coefficients.
    explicit BrickRanges(const Volume& volume, const Progress& progress = {});
    BrickRanges(const BrickRanges&) = delete;
    BrickRanges& operator=(const BrickRanges&) = delete;

    /// Octets along x, y, z.
    const glm::ivec3& shape() const { return shape_; }
    /// Octet (x, y, z) is at index x + shape.x * (y + shape.y * z).
    std::span<const Octet> octets() const { return octets_; }
    /// The range of the brick at a place in the grid of bricks.
    Range brick(const glm::ivec3& position) const
    {
        const std::size_t number = number_of(position);
        return octets_[number / 8].brick(number % 8);
    }
    /// The range of all bricks.
    const Range& whole() const { return whole_; }
    /// The bricks of an octet that straddle a threshold: bit i for child i.
    unsigned straddling(std::size_t octet, double threshold) const;
    /// The blocks that may straddle a threshold, of a brick that straddles it: bit i for block i. The ranges of blocks
    /// are rounded outwards, so a few of these blocks may not straddle it.
    std::uint64_t straddling_blocks(std::size_t octet, int child, double threshold) const;
    /// The slabs of a brick, each of 16 blocks with one x, y or z, that may straddle a threshold: bit i + 4 axis for
    /// slab i along an axis. They contain all blocks that may, and are found faster.
    unsigned straddling_slabs(std::size_t octet, int child, double threshold) const;
    /// Finds the blocks of a brick in which f - offset is above `most` everywhere, or below `least`.
    class BlockSides;
    BlockSides block_sides(const glm::ivec3& position, double least, double most) const;
    /// Whether the ranges of blocks are known too, as they are if the ranges were computed from the coefficients.
    bool has_blocks() const { return !blocks_.empty(); }
    std::size_t memory() const
    {
        return found_.capacity() * sizeof(Octet) + blocks_.capacity() * sizeof(BlockCodes) +
               slabs_.capacity() * sizeof(SlabCodes);
    }

private:
    /// Ranges of parts of a brick; 0 is the lower end of the brick's own range, 255 the upper end.
    template <std::size_t Count>
    struct Codes {
        alignas(Count) std::array<std::uint8_t, Count> lower, upper;
    };
    using BlockCodes = Codes<blocks_per_brick>;
    using SlabCodes = Codes<16>; ///< four along each axis; four more that never straddle

    template <std::size_t Count>
    std::uint64_t straddling(const Codes<Count>& codes, const Range& brick, double threshold) const;

    void find_whole();
    /// The number of the brick at a place: child c of octet i is brick 8 i + c.
    std::size_t number_of(const glm::ivec3& position) const
    {
        const glm::ivec3 octet = position / 2, child = position - 2 * octet;
        return 8 * place_in(shape_, octet) + static_cast<std::size_t>(child.x + 2 * child.y + 4 * child.z);
    }

    glm::ivec3 shape_{0};
    Range whole_;
    std::span<const Octet> octets_; ///< computed here, or owned by the volume's source
    std::vector<Octet> found_;
    std::vector<BlockCodes> blocks_; ///< of brick `child` of octet i: item 8 i + child
    std::vector<SlabCodes> slabs_;   ///< of the same bricks
};

class BrickRanges::BlockSides {
public:
    /// 1 if f is above in a block, -1 if it is below; 0 if that is not known.
    int operator[](std::size_t block) const
    {
        return static_cast<int>(codes_.lower[block] > most_lower_) -
               static_cast<int>(codes_.upper[block] < least_upper_);
    }

private:
    friend class BrickRanges;
    BlockSides(const BlockCodes& codes, std::uint8_t most_lower, std::uint8_t least_upper)
        : codes_(codes), most_lower_(most_lower), least_upper_(least_upper)
    {
    }

    const BlockCodes& codes_;
    std::uint8_t most_lower_, least_upper_; ///< codes of blocks that may not be above, or below
};

/// The blocks of a brick that straddle a threshold, by their coefficients.
std::uint64_t straddling_blocks(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold);

/// The ranges of a volume. They are computed once and shared for as long as a surface of the volume holds them. Any
/// thread may call; if several need them at a time, one computes them and the others wait.
std::shared_ptr<const BrickRanges> shared_ranges(const std::shared_ptr<const Volume>& volume,
                                                 const Progress& progress = {});

} // namespace isospline
