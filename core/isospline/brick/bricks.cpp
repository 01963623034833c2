#include "isospline/brick/bricks.h"

#include "isospline/brick/signs.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace isospline {

MadeBrick::MadeBrick(const glm::ivec3& first, const CoefficientView& coefficients, std::uint64_t blocks,
                     const BrickCells& uncut)
    : first_(first), coefficients_(coefficients)
{
    for (std::uint64_t rest = blocks; rest != 0; rest &= rest - 1u) {
        const int block = std::countr_zero(rest);
        const std::uint8_t of_block = cells_of_block(uncut, block);
        uncut_[static_cast<std::size_t>(block)] = of_block;
        blocks_ |= static_cast<std::uint64_t>(of_block != 0) << block;
    }
    slots_ = std::make_unique<Slot[]>(static_cast<std::size_t>(std::popcount(blocks_)));
}

std::size_t MadeBrick::memory() const
{
    return sizeof(MadeBrick) + static_cast<std::size_t>(std::popcount(blocks_)) * sizeof(Slot);
}

const Block& MadeBrick::make(Slot& slot, int index, int degree, double threshold, Block& own) const
{
    own = make_block(coefficients(block_position(index)), degree, threshold, uncut_[static_cast<std::size_t>(index)]);
    State empty = State::empty;
    if (slot.state.compare_exchange_strong(empty, State::being_written, std::memory_order_relaxed)) {
        slot.block = own;
        slot.state.store(State::made, std::memory_order_release);
    }
    return own;
}

Bricks::Bricks(const Volume& volume, std::shared_ptr<const CoefficientSource> source, const BrickRanges& ranges,
               double threshold, const Mask& mask, const std::vector<HalfSpace>& clip_lattice, const Progress& progress)
    : volume_(volume), source_(std::move(source)), ranges_(ranges), threshold_(threshold), mask_(mask),
      clip_lattice_(clip_lattice)
{
    // Chunks of octets, each with a list of its own.
    constexpr std::size_t chunk_size = 4096;
    const std::size_t octet_count = ranges.octets().size();
    std::vector<std::vector<Octet>> chunks((octet_count + chunk_size - 1) / chunk_size);
    const auto select = [&](std::size_t index, std::vector<Octet>& selected) {
        unsigned bricks = ranges.straddling(index, threshold);
        if (bricks == 0)
            return;
        const glm::ivec3 first = 2 * brick_size * at_place(ranges.shape(), index);
        Octet octet{{static_cast<std::uint16_t>(first.x), static_cast<std::uint16_t>(first.y),
                     static_cast<std::uint16_t>(first.z)},
                    static_cast<std::uint8_t>(bricks),
                    0};
        for (unsigned rest = clip_lattice.empty() ? 0 : bricks; rest != 0; rest &= rest - 1u) {
            const int child = std::countr_zero(rest);
            for (const HalfSpace& half_space : clip_lattice)
                if (is_outside(place(octet, child), half_space))
                    bricks &= ~(1u << child);
        }
        octet.bricks = static_cast<std::uint8_t>(bricks);
        if (bricks != 0)
            selected.push_back(octet);
    };
    parallel_for(
        chunks.size(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t chunk = begin; chunk < end; ++chunk)
                for (std::size_t i = chunk * chunk_size; i < std::min((chunk + 1) * chunk_size, octet_count); ++i)
                    select(i, chunks[chunk]);
        },
        progress);

    std::size_t selected_count = 0;
    for (const std::vector<Octet>& chunk : chunks)
        selected_count += chunk.size();
    octets_.reserve(selected_count);
    for (const std::vector<Octet>& chunk : chunks)
        for (Octet octet : chunk) {
            octet.first_brick = static_cast<std::uint32_t>(count_);
            count_ += static_cast<unsigned>(std::popcount(octet.bricks));
            octets_.push_back(octet);
        }
    if (count_ > std::numeric_limits<std::uint32_t>::max())
        throw std::length_error("volume: expected at most 4294967295 bricks of 8 x 8 x 8 cells with a part of the "
                                "surface, got " +
                                std::to_string(count_));
    bricks_ = std::make_unique<std::atomic<const MadeBrick*>[]>(count_);
}

Bricks::~Bricks()
{
    for (std::size_t i = 0; i < count_; ++i)
        delete bricks_[i].load(std::memory_order_relaxed);
}

BrickCells Bricks::cells(const Brick& brick) const
{
    BrickCells cells = mixed_cells(source_->coefficients(brick), brick, volume_.degree(), threshold_);
    if (!mask_.empty())
        cut_by_mask(cells, brick, mask_, volume_);
    for (const HalfSpace& half_space : clip_lattice_)
        cut_by_half_space(cells, brick, half_space);
    return cells;
}

const MadeBrick& Bricks::make(std::atomic<const MadeBrick*>& place, const Octet& octet, int child) const
{
    const Brick brick = this->place(octet, child);
    const glm::ivec3 octet_position = brick.first / (2 * brick_size);
    const std::uint64_t blocks =
        ranges_.straddling_blocks(place_in(ranges_.shape(), octet_position), child, threshold_);
    // Which cells have both signs is seen when their block is made; it is seen here only where some are cut away.
    const bool is_cut = !mask_.empty() || !clip_lattice_.empty();
    const BrickCells uncut = is_cut ? cells(brick) : all_cells(brick.size);
    std::unique_ptr<const MadeBrick> made(new MadeBrick(brick.first, source_->coefficients(brick), blocks, uncut));
    const MadeBrick* others = nullptr;
    if (!place.compare_exchange_strong(others, made.get(), std::memory_order_acq_rel))
        return *others;
    made_memory_ += made->memory();
    return *made.release();
}

std::size_t Bricks::memory() const
{
    return octets_.capacity() * sizeof(Octet) + count_ * sizeof(bricks_[0]) + made_memory_;
}

} // namespace isospline
