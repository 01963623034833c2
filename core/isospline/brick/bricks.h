// The bricks that a surface at one level may cross. Their ranges select them; each is made when a ray enters it.
#pragma once

#include "isospline/brick/block.h"
#include "isospline/brick/brick.h"
#include "isospline/brick/cell_set.h"
#include "isospline/brick/cutout.h"
#include "isospline/brick/ranges.h"
#include "isospline/math/box.h"
#include "isospline/spline/coefficient_view.h"
#include "isospline/spline/volume.h"
#include "isospline/util/memory_budget.h"
#include "isospline/util/progress.h"

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

/// The blocks of a brick at one level. A block is made when the first ray enters it. Threads never wait for it: a
/// thread that needs a block that another thread is making makes its own copy, which is the same.
class alignas(64) MadeBrick {
public:
    const glm::ivec3& first() const { return first_; } ///< cell, in the volume's lattice
    /// The coefficients of a cell, counted from the brick's first.
    CoefficientView coefficients(const glm::ivec3& cell) const { return coefficients_.from(cell.x, cell.y, cell.z); }
    /// Bit i: block i may have cells that the surface crosses.
    std::uint64_t blocks() const { return blocks_; }
    /// A block of `blocks()`. If another thread is making it, it is made in `own`.
    const Block& block(int index, int degree, double threshold, Block& own) const
    {
        Slot& slot = slots_[place_of(index)];
        if (slot.state.load(std::memory_order_acquire) == State::made)
            return slot.block;
        return make(slot, index, degree, threshold, own);
    }
    /// The address of a block that is made or will be made, for prefetching.
    const void* address_of(int block) const { return &slots_[place_of(block)]; }
    std::size_t memory() const;

private:
    friend class Bricks;
    enum class State : std::uint8_t { empty, being_written, made };
    struct alignas(64) Slot { // a cache line
        Block block;
        std::atomic<State> state = State::empty;
    };

    /// The surface may cross cells of `blocks`, except cells that are not in `uncut`.
    MadeBrick(const glm::ivec3& first, CoefficientBox coefficients, std::uint64_t blocks, const BrickCells& uncut);
    int place_of(int block) const { return std::popcount(blocks_ & ((std::uint64_t{1} << block) - 1u)); }
    const Block& make(Slot& slot, int index, int degree, double threshold, Block& own) const;

    glm::ivec3 first_;
    mutable std::atomic<std::uint64_t> last_use_ = 0; ///< in the time of the volume's budget
    CoefficientBox coefficients_;
    std::uint64_t blocks_ = 0;
    std::unique_ptr<Slot[]> slots_;                      ///< of the blocks in `blocks_`
    std::array<std::uint8_t, blocks_per_brick> uncut_{}; ///< their cells that are in the volume and not cut away
};

/// Keeps the brick that a thread reads from being dropped, until the thread asks for another one with this pin.
class BrickPin {
public:
    BrickPin() = default;
    ~BrickPin()
    {
        if (readers_ != nullptr)
            release();
    }
    BrickPin(const BrickPin&) = delete;
    BrickPin& operator=(const BrickPin&) = delete;

private:
    friend class Bricks;

    void release();

    std::atomic<std::uint32_t>* readers_ = nullptr; ///< of the brick; null without a budget
    const MadeBrick* own_ = nullptr;                ///< a brick of this thread alone
};

/// Up to eight bricks that fill a cube.
struct Octet {
    std::array<std::uint16_t, 3> first; ///< cell
    std::uint8_t bricks;                ///< bit i: the brick at child_position(i) is selected
    std::uint32_t first_brick;          ///< number of its first brick
};

/// The bricks of one level. Any number of threads may ask for bricks at the same time, and none waits for another. If
/// the volume has a budget, the least recently used bricks that no thread reads are dropped, and made again when they
/// are needed.
class Bricks final : private MemoryBudget::Holder {
public:
    /// Selects the bricks that straddle the threshold, have a cell of the set `kept` and are not wholly cut away.
    /// Arguments passed by reference must outlive the object. `clip_lattice` is in lattice space; its normals have
    /// length one. Throws std::length_error for more than 2^32 - 1 bricks.
    Bricks(const Volume& volume, const BrickRanges& ranges, double threshold, const CellSet& kept,
           const std::vector<HalfSpace>& clip_lattice, const Progress& progress = {});
    ~Bricks() override;
    Bricks(const Bricks&) = delete;
    Bricks& operator=(const Bricks&) = delete;

    int degree() const { return volume_.degree(); }
    double threshold() const { return threshold_; }
    MemoryBudget* budget() const { return budget_; }
    /// In the order of the volume's lattice.
    const std::vector<Octet>& octets() const { return octets_; }
    /// Bricks are numbered from 0 in the order of octets, then of children.
    std::size_t count() const { return count_; }
    /// The number of a selected brick of an octet.
    static std::size_t number(const Octet& octet, int child)
    {
        return octet.first_brick + static_cast<unsigned>(std::popcount(octet.bricks & ((1u << child) - 1u)));
    }
    /// A brick; the first call makes it. The reference is valid until the pin is used again or destroyed.
    const MadeBrick& brick(const Octet& octet, int child, BrickPin& pin) const
    {
        const std::size_t index = number(octet, child);
        if (const MadeBrick* const made = bricks_[index].load(std::memory_order_acquire))
            if (budget_ == nullptr)
                return *made;
        return find_or_make(index, octet, child, pin);
    }
    /// The address of a brick, or null if it is not made yet; for prefetching, because the brick may be dropped.
    const void* address_of(const Octet& octet, int child) const
    {
        return bricks_[number(octet, child)].load(std::memory_order_relaxed);
    }
    /// The mixed cells of a brick that are kept and not cut away.
    BrickCells cells(const Brick& brick) const;
    /// The blocks of a brick whose ranges straddle the threshold, or all blocks if no ranges of blocks are known: bit i
    /// for block i. The clip or the mask may have cut away some of them.
    std::uint64_t blocks_in_question(const Octet& octet, int child) const
    {
        return ranges_.has_blocks() ? ranges_.straddling_blocks(range_of(octet), child, threshold_) : ~std::uint64_t{0};
    }
    /// The slabs of four by four blocks that hold the blocks in question: bit i + 4 axis for slab i along an axis.
    unsigned slabs_in_question(const Octet& octet, int child) const
    {
        return ranges_.has_blocks() ? ranges_.straddling_slabs(range_of(octet), child, threshold_) : 0xfffu;
    }
    Brick place(const Octet& octet, int child) const
    {
        return brick_at(volume_.cell_shape(), glm::ivec3(octet.first[0], octet.first[1], octet.first[2]) / brick_size +
                                                  child_position(child));
    }
    /// The cells of an octet, which are fewer than 16 along an axis where the grid ends.
    glm::ivec3 size(const Octet& octet) const
    {
        const glm::ivec3 first(octet.first[0], octet.first[1], octet.first[2]);
        return glm::min(volume_.cell_shape() - first, glm::ivec3(2 * brick_size));
    }
    /// Bytes held at the moment: it grows as bricks are made.
    std::size_t memory() const;

private:
    /// The place of an octet's ranges.
    std::size_t range_of(const Octet& octet) const
    {
        return place_in(ranges_.shape(), glm::ivec3(octet.first[0], octet.first[1], octet.first[2]) / (2 * brick_size));
    }

    /// A count of readers is at least this while the brick is deleted.
    static constexpr std::uint32_t being_dropped = 1u << 31;

    const MadeBrick& find_or_make(std::size_t index, const Octet& octet, int child, BrickPin& pin) const;
    std::unique_ptr<const MadeBrick> make(const Octet& octet, int child) const;
    /// Shares a brick with other threads; returns theirs if another thread was faster.
    const MadeBrick& publish(std::size_t index, std::unique_ptr<const MadeBrick> brick) const;
    void list_items(std::vector<MemoryBudget::Item>& items) const override;
    void drop_unused_since(std::uint64_t time) override;
    /// The cells of a brick that are kept and not cut away.
    BrickCells uncut_cells(const Brick& brick) const;

    const Volume& volume_;
    const BrickRanges& ranges_;
    MemoryBudget* budget_;
    double threshold_;
    const CellSet& kept_;
    const std::vector<HalfSpace>& clip_lattice_;
    std::vector<Octet> octets_;
    std::size_t count_ = 0;
    std::unique_ptr<std::atomic<const MadeBrick*>[]> bricks_;
    mutable std::atomic<std::size_t> made_memory_ = 0;
    // If there is a budget:
    std::unique_ptr<std::atomic<std::uint32_t>[]> readers_; ///< threads that read each brick
    mutable std::vector<std::size_t> newly_made_;           ///< under the fork-safe mutex of this object
    mutable std::vector<std::size_t> droppable_; ///< bricks made before; used by one call of the budget at a time
};

} // namespace isospline
