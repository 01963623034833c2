// The bricks that a surface at one level may cross: selected at once by their ranges, each made when a ray enters it.
#pragma once

#include "isospline/brick/block.h"
#include "isospline/brick/brick.h"
#include "isospline/brick/cutout.h"
#include "isospline/brick/ranges.h"
#include "isospline/brick/source.h"
#include "isospline/math/box.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

/// What is known of the cells of a brick at one level. Blocks are made when the first ray enters them. Whoever comes
/// first makes a block; others that come before it is there make it for themselves, and nobody waits: it is the same
/// whoever makes it.
class alignas(64) MadeBrick {
public:
    const glm::ivec3& first() const { return first_; } ///< cell, in the volume's lattice
    /// The coefficients of a cell, counted from the brick's first.
    CoefficientView coefficients(const glm::ivec3& cell) const { return coefficients_.from(cell.x, cell.y, cell.z); }
    /// Bit i: block i may have cells that the surface crosses.
    std::uint64_t blocks() const { return blocks_; }
    /// A block that may. Where another thread is about to make it, it is made in `own`.
    const Block& block(int index, int degree, double threshold, Block& own) const
    {
        Slot& slot = slots_[place_of(index)];
        if (slot.state.load(std::memory_order_acquire) == State::made)
            return slot.block;
        return make(slot, index, degree, threshold, own);
    }
    /// Where a block is, or will be, for prefetching.
    const void* address_of(int block) const { return &slots_[place_of(block)]; }
    std::size_t memory() const;

private:
    friend class Bricks;
    enum class State : std::uint8_t { empty, being_written, made };
    struct alignas(64) Slot { // a line of the cache
        Block block;
        std::atomic<State> state = State::empty;
    };

    /// `blocks` may have cells that the surface crosses, but for those that are not in `uncut`.
    MadeBrick(const glm::ivec3& first, const CoefficientView& coefficients, std::uint64_t blocks,
              const BrickCells& uncut);
    int place_of(int block) const { return std::popcount(blocks_ & ((std::uint64_t{1} << block) - 1u)); }
    const Block& make(Slot& slot, int index, int degree, double threshold, Block& own) const;

    glm::ivec3 first_;
    CoefficientView coefficients_;
    std::uint64_t blocks_ = 0;
    std::unique_ptr<Slot[]> slots_;                      ///< of these blocks
    std::array<std::uint8_t, blocks_per_brick> uncut_{}; ///< their cells that are in the volume and not cut away
};

/// Up to eight bricks that fill a cube.
struct Octet {
    std::array<std::uint16_t, 3> first; ///< cell
    std::uint8_t bricks;                ///< bit i: the brick at child_position(i) is selected
    std::uint32_t first_brick;          ///< number of its first brick
};

/// The bricks of one level. Any number of threads may ask for bricks at a time.
class Bricks {
public:
    /// Selects the bricks that straddle the threshold and are not wholly cut away. What is passed by reference must
    /// outlive the object. `clip_lattice` is in lattice space, its normals have length one. Throws std::length_error
    /// for more than 2^32 - 1 bricks.
    Bricks(const Volume& volume, std::shared_ptr<const CoefficientSource> source, const BrickRanges& ranges,
           double threshold, const Mask& mask, const std::vector<HalfSpace>& clip_lattice,
           const Progress& progress = {});
    ~Bricks();
    Bricks(const Bricks&) = delete;
    Bricks& operator=(const Bricks&) = delete;

    int degree() const { return volume_.degree(); }
    double threshold() const { return threshold_; }
    /// In the order of the volume's lattice.
    const std::vector<Octet>& octets() const { return octets_; }
    /// Bricks are numbered from 0 in the order of octets, then of children.
    std::size_t count() const { return count_; }
    /// The number of an octet's brick that is selected.
    static std::size_t number(const Octet& octet, int child)
    {
        return octet.first_brick + static_cast<unsigned>(std::popcount(octet.bricks & ((1u << child) - 1u)));
    }
    /// The brick, made by the first call.
    const MadeBrick& brick(const Octet& octet, int child) const
    {
        std::atomic<const MadeBrick*>& place = bricks_[number(octet, child)];
        if (const MadeBrick* const made = place.load(std::memory_order_acquire))
            return *made;
        return make(place, octet, child);
    }
    /// The brick, where it has been made, or null.
    const MadeBrick* made(const Octet& octet, int child) const
    {
        return bricks_[number(octet, child)].load(std::memory_order_acquire);
    }
    /// The cells of a brick whose coefficients have both signs and which are not cut away.
    BrickCells cells(const Brick& brick) const;
    Brick place(const Octet& octet, int child) const
    {
        return brick_at(volume_.cell_shape(), glm::ivec3(octet.first[0], octet.first[1], octet.first[2]) / brick_size +
                                                  child_position(child));
    }
    /// Bytes held at the moment: it grows as bricks are made.
    std::size_t memory() const;

private:
    const MadeBrick& make(std::atomic<const MadeBrick*>& place, const Octet& octet, int child) const;

    const Volume& volume_;
    std::shared_ptr<const CoefficientSource> source_;
    const BrickRanges& ranges_;
    double threshold_;
    const Mask& mask_;
    const std::vector<HalfSpace>& clip_lattice_;
    std::vector<Octet> octets_;
    std::size_t count_ = 0;
    std::unique_ptr<std::atomic<const MadeBrick*>[]> bricks_;
    mutable std::atomic<std::size_t> made_memory_ = 0;
};

} // namespace isospline
