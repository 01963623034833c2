#include "isospline/brick/bricks.h"

#include "isospline/brick/signs.h"
#include "isospline/util/fork.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

namespace isospline {

MadeBrick::MadeBrick(const glm::ivec3& first, CoefficientBox coefficients, std::uint64_t blocks,
                     const BrickCells& uncut)
    : first_(first), coefficients_(std::move(coefficients))
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
    return sizeof(MadeBrick) + coefficients_.copied_bytes +
           static_cast<std::size_t>(std::popcount(blocks_)) * sizeof(Slot);
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

void BrickPin::release()
{
    delete std::exchange(own_, nullptr);
    std::exchange(readers_, nullptr)->fetch_sub(1, std::memory_order_release);
}

Bricks::Bricks(const Volume& volume, const BrickRanges& ranges, double threshold, const CellSet& kept,
               const std::vector<HalfSpace>& clip_lattice, const Progress& progress)
    : volume_(volume), ranges_(ranges), budget_(volume.budget()), threshold_(threshold), kept_(kept),
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
        for (unsigned rest = bricks; rest != 0; rest &= rest - 1u) {
            const int child = std::countr_zero(rest);
            const Brick brick = place(octet, child);
            const auto cuts = [&](const HalfSpace& half_space) { return is_outside(brick, half_space); };
            if (kept.has_none_of(brick) || std::any_of(clip_lattice.begin(), clip_lattice.end(), cuts))
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
    if (budget_ != nullptr) {
        readers_ = std::make_unique<std::atomic<std::uint32_t>[]>(count_);
        budget_->add(*this);
    }
}

Bricks::~Bricks()
{
    if (budget_ != nullptr) {
        budget_->remove(*this);
        budget_->count_down(made_memory_);
    }
    for (std::size_t i = 0; i < count_; ++i)
        delete bricks_[i].load(std::memory_order_relaxed);
}

BrickCells Bricks::cells(const Brick& brick) const
{
    BrickCells cells = mixed_cells(volume_.box(brick.first, brick.size), brick, volume_.degree(), threshold_);
    const BrickCells uncut = uncut_cells(brick);
    for (std::size_t z = 0; z < cells.size(); ++z)
        cells[z] &= uncut[z];
    return cells;
}

BrickCells Bricks::uncut_cells(const Brick& brick) const
{
    BrickCells cells = kept_.has_all_of(brick) ? all_cells(brick.size) : kept_.cells(brick);
    for (const HalfSpace& half_space : clip_lattice_)
        cut_by_half_space(cells, brick, half_space);
    return cells;
}

// With a budget, a thread announces itself as a reader of the brick before it looks for the brick. The budget only
// drops a brick whose count of readers it could change from zero to `being_dropped`. So neither waits for the other,
// not even in a forked process, where the other thread may not exist: a reader that finds this mark makes a brick of
// its own.
const MadeBrick& Bricks::find_or_make(std::size_t index, const Octet& octet, int child, BrickPin& pin) const
{
    if (budget_ == nullptr)
        return publish(index, make(octet, child));
    if (pin.readers_ != nullptr)
        pin.release();
    pin.readers_ = &readers_[index];
    if (pin.readers_->fetch_add(1, std::memory_order_acquire) >= being_dropped)
        return *(pin.own_ = make(octet, child).release());
    const std::uint64_t now = budget_->now();
    if (const MadeBrick* const made = bricks_[index].load(std::memory_order_acquire)) {
        if (made->last_use_.load(std::memory_order_relaxed) != now)
            made->last_use_.store(now, std::memory_order_relaxed);
        return *made;
    }
    budget_->make_room();
    return publish(index, make(octet, child));
}

std::unique_ptr<const MadeBrick> Bricks::make(const Octet& octet, int child) const
{
    const Brick brick = this->place(octet, child);
    CoefficientBox coefficients = volume_.box(brick.first, brick.size);
    // The mixed cells are found later, when their block is made.
    const std::uint64_t blocks = ranges_.has_blocks() ? blocks_in_question(octet, child)
                                                      : straddling_blocks(coefficients, brick, degree(), threshold_);
    std::unique_ptr<const MadeBrick> made(
        new MadeBrick(brick.first, std::move(coefficients), blocks, uncut_cells(brick)));
    if (budget_ != nullptr)
        made->last_use_ = budget_->now();
    return made;
}

const MadeBrick& Bricks::publish(std::size_t index, std::unique_ptr<const MadeBrick> brick) const
{
    const MadeBrick* others = nullptr;
    if (!bricks_[index].compare_exchange_strong(others, brick.get(), std::memory_order_acq_rel))
        return *others;
    const MadeBrick& made = *brick.release(); // from here on other threads may use it, even if the code below fails
    made_memory_ += made.memory();
    if (budget_ != nullptr) {
        budget_->tick();
        budget_->count_up(made.memory());
        const std::lock_guard lock(fork_safe_mutex(this));
        newly_made_.push_back(index);
    }
    return made;
}

void Bricks::list_items(std::vector<MemoryBudget::Item>& items) const
{
    std::vector<std::size_t> newly_made;
    {
        const std::lock_guard lock(fork_safe_mutex(this));
        newly_made.swap(newly_made_);
    }
    droppable_.insert(droppable_.end(), newly_made.begin(), newly_made.end());
    for (const std::size_t index : droppable_) {
        const MadeBrick& brick = *bricks_[index].load(std::memory_order_acquire);
        items.push_back({brick.last_use_.load(std::memory_order_relaxed), brick.memory()});
    }
}

void Bricks::drop_unused_since(std::uint64_t time)
{
    std::size_t dropped_memory = 0;
    const std::size_t dropped = std::erase_if(droppable_, [&](std::size_t index) {
        const MadeBrick* const brick = bricks_[index].load(std::memory_order_acquire);
        std::uint32_t none = 0;
        if (brick->last_use_.load(std::memory_order_relaxed) > time ||
            !readers_[index].compare_exchange_strong(none, being_dropped, std::memory_order_acquire))
            return false;
        dropped_memory += brick->memory();
        bricks_[index].store(nullptr, std::memory_order_relaxed);
        delete brick;
        readers_[index].fetch_sub(being_dropped, std::memory_order_release);
        return true;
    });
    made_memory_ -= dropped_memory;
    budget_->count_down(dropped_memory);
    budget_->count_dropped(dropped);
}

std::size_t Bricks::memory() const
{
    const std::size_t of_place = sizeof(bricks_[0]) + (readers_ ? sizeof(readers_[0]) : 0);
    return octets_.capacity() * sizeof(Octet) + count_ * of_place + made_memory_;
}

} // namespace isospline
