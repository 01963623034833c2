#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/shell/prune.cpp"
#include <hwy/foreach_target.h>

#include "isospline/shell/prune.h"
#include "isospline/shell/prune_blocks-inl.h"
#include "isospline/spline/degree.h"
#include "isospline/spline/volume.h"

#include <algorithm>
#include <bit>
#include <type_traits>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// Prunes cells that are added one by one. Each level of subdivision has a queue. As soon as a queue can fill all
/// lanes, a batch of it is processed, so that queues stay short.
template <int Degree, typename Real>
class Pruner {
    using B = Blocks<Degree, Real>;
    using Lanes = typename B::Lanes;
    static constexpr int coarse = B::coarse, fine = B::fine;
    static constexpr std::size_t coarse_count = coarse * coarse * coarse;
    static constexpr std::size_t fine_count = fine * fine * fine;
    static constexpr std::size_t children = 8;

public:
    /// Fills `kept` with the cells whose fine coefficients certainly have both signs, and `undecided` with the cells
    /// where rounding may hide this. A cell can be in both.
    Pruner(double threshold, int depth, std::vector<BrickCells>& kept, std::vector<BrickCells>& undecided)
        : threshold_(static_cast<Real>(threshold)),
          threshold_rest_(static_cast<Real>(threshold - static_cast<double>(threshold_))),
          tolerance_(std::is_same_v<Real, float> ? static_cast<Real>(rounding(depth)) : Real(0)),
          queues_(static_cast<std::size_t>(depth)), kept_(kept), undecided_(undecided)
    {
    }

    void add(std::size_t cell, const Volume& volume, const glm::ivec3& position)
    {
        Queue& queue = queues_[0];
        float own[64];
        const CoefficientView view = volume.cell(position, own);
        Real* out = queue.coefficients.data() + queue.size;
        for (int z = 0; z < coarse; ++z)
            for (int y = 0; y < coarse; ++y)
                for (int x = 0; x < coarse; ++x, out += Queue::capacity)
                    *out = static_cast<Real>(*view.from(x, y, z).first);
        queue.cells[queue.size++] = cell;
        work(hn::Lanes(Lanes()));
    }

    /// Processes everything that is queued.
    void finish() { work(1); }

private:
    /// Coefficients that wait to be subdivided, each array of a cell or of one of its sub-cells.
    struct Queue {
        /// A batch begins as soon as the lanes can be filled. It adds up to eight children a lane to the next queue.
        static constexpr std::size_t capacity = (children + 1) * B::most_lanes;
        std::size_t size = 0;
        std::vector<Real> coefficients = std::vector<Real>(coarse_count * capacity + B::most_lanes);
        std::vector<Real> tolerances = std::vector<Real>(capacity + B::most_lanes);
        std::size_t cells[capacity];
    };

    /// Bound of the rounding of fine coefficients and of values of f in float32, relative to a cell's largest
    /// coefficient, in units of 2^-24: 2 for the difference from the threshold, 3 an axis for each subdivision, 4 an
    /// axis for f at the corners.
    static double rounding(int depth) { return (2 + 9 * depth + 12) * 0x1p-24; }

    /// Processes batches, the deepest level first, until no queue holds `enough` items.
    void work(std::size_t enough)
    {
        for (std::size_t level = queues_.size(); level-- > 0;)
            if (queues_[level].size >= enough) {
                batch(level);
                level = queues_.size();
            }
    }

    static bool has(const std::vector<BrickCells>& sets, std::size_t cell)
    {
        return (sets[cell / 512][cell / 64 % 8] >> cell % 64 & 1) != 0;
    }

    static void insert(std::vector<BrickCells>& sets, std::size_t cell)
    {
        sets[cell / 512][cell / 64 % 8] |= std::uint64_t(1) << cell % 64;
    }

    /// Subdivides the last items of a queue, as many as there are lanes.
    void batch(std::size_t level)
    {
        // Sub-cells of cells that are known to stay need no work.
        Queue& queue = queues_[level];
        while (queue.size > 0 && has(kept_, queue.cells[queue.size - 1]))
            --queue.size;
        const Lanes lanes;
        const std::size_t lane_count = queue.size < hn::Lanes(lanes) ? queue.size : hn::Lanes(lanes);
        queue.size -= lane_count;
        const std::size_t* cells = queue.cells + queue.size;

        // Subtract the threshold, which needs two float32 to be exact.
        HWY_ALIGN Real block[coarse_count * B::most_lanes];
        const Real* coefficients = queue.coefficients.data() + queue.size;
        auto tolerance = hn::LoadU(lanes, queue.tolerances.data() + queue.size);
        if (level == 0) {
            auto largest = hn::Zero(lanes);
            for (std::size_t i = 0; i < coarse_count; ++i) {
                const auto coefficient = hn::LoadU(lanes, coefficients + i * Queue::capacity);
                const auto difference =
                    hn::Sub(hn::Sub(coefficient, hn::Set(lanes, threshold_)), hn::Set(lanes, threshold_rest_));
                largest = hn::Max(largest, hn::Abs(difference));
                hn::Store(difference, lanes, block + i * hn::Lanes(lanes));
            }
            tolerance = hn::Mul(largest, hn::Set(lanes, tolerance_));
        } else {
            for (std::size_t i = 0; i < coarse_count; ++i)
                hn::Store(hn::LoadU(lanes, coefficients + i * Queue::capacity), lanes, block + i * hn::Lanes(lanes));
        }

        // Fine coefficients.
        HWY_ALIGN Real along_x[coarse * coarse * fine * B::most_lanes];
        HWY_ALIGN Real along_y[coarse * fine * fine * B::most_lanes];
        HWY_ALIGN Real finer[fine_count * B::most_lanes];
        B::template subdivide<coarse * coarse, 1>(block, along_x);
        B::template subdivide<coarse, fine>(along_x, along_y);
        B::template subdivide<1, fine * fine>(along_y, finer);

        // At the last level their signs decide. Neighbouring sub-cells share coefficients, so both signs occur among
        // all coefficients exactly if they occur in one of the sub-cells.
        if (level + 1 == queues_.size()) {
            const Signs mixed = signs_of_all<fine_count>(finer, tolerance);
            for (std::size_t lane = 0; lane < lane_count; ++lane) {
                if (mixed.surely_mixed >> lane & 1)
                    insert(kept_, cells[lane]);
                else if (mixed.maybe_mixed >> lane & 1)
                    insert(undecided_, cells[lane]);
            }
            return;
        }

        // If f itself has both signs, the cell holds the surface; no subdivision could change that.
        HWY_ALIGN Real values_x[fine * fine * 3 * B::most_lanes];
        HWY_ALIGN Real values_y[fine * 3 * 3 * B::most_lanes];
        HWY_ALIGN Real values[3 * 3 * 3 * B::most_lanes];
        B::template corner_values<fine * fine, 1>(finer, values_x);
        B::template corner_values<fine, 3>(values_x, values_y);
        B::template corner_values<1, 3 * 3>(values_y, values);
        unsigned open = (1u << lane_count) - 1u;
        const unsigned crossed = signs_of_all<3 * 3 * 3>(values, tolerance).surely_mixed & open;
        open &= ~crossed;
        for (std::size_t lane = 0; lane < lane_count; ++lane)
            if (crossed >> lane & 1)
                insert(kept_, cells[lane]);
        if (open == 0)
            return;

        // Sub-cells that may have both signs go on to the next level.
        HWY_ALIGN Real lower[children * B::most_lanes];
        HWY_ALIGN Real upper[children * B::most_lanes];
        extremes_of_children<false>(finer, lower);
        extremes_of_children<true>(finer, upper);
        std::size_t cell_of_lane[B::most_lanes];
        for (std::size_t lane = 0; lane < lane_count; ++lane)
            cell_of_lane[lane] = cells[lane];
        for (std::size_t child = 0; child < children; ++child) {
            const std::size_t at = child * hn::Lanes(lanes);
            const unsigned mixed =
                signs(lanes, hn::Load(lanes, lower + at), hn::Load(lanes, upper + at), tolerance).maybe_mixed & open;
            if (mixed != 0)
                push(queues_[level + 1], cell_of_lane, tolerance, finer, child, mixed);
        }
    }

    template <std::size_t Count>
    static HWY_INLINE Signs signs_of_all(const Real* HWY_RESTRICT block, hn::Vec<Lanes> tolerance)
    {
        const Lanes lanes;
        auto lower = hn::Load(lanes, block);
        auto upper = lower;
        for (std::size_t i = 1; i < Count; ++i) {
            const auto value = hn::Load(lanes, block + i * hn::Lanes(lanes));
            lower = hn::Min(lower, value);
            upper = hn::Max(upper, value);
        }
        return signs(lanes, lower, upper, tolerance);
    }

    template <bool Largest>
    static HWY_INLINE void extremes_of_children(const Real* HWY_RESTRICT finer, Real* HWY_RESTRICT extremes)
    {
        HWY_ALIGN Real along_x[fine * fine * 2 * B::most_lanes];
        HWY_ALIGN Real along_y[fine * 2 * 2 * B::most_lanes];
        B::template extremes_of_halves<fine * fine, 1, Largest>(finer, along_x);
        B::template extremes_of_halves<fine, 2, Largest>(along_x, along_y);
        B::template extremes_of_halves<1, 2 * 2, Largest>(along_y, extremes);
    }

    /// Appends sub-cell `child`, bits x, y, z, of the fine coefficients of some lanes.
    static HWY_INLINE void push(Queue& queue, const std::size_t* cells, hn::Vec<Lanes> tolerance,
                                const Real* HWY_RESTRICT finer, std::size_t child, unsigned some)
    {
        // Store whole vectors, although only the first lanes count. There is room for them: see `capacity`.
        const Lanes lanes;
        const std::size_t lane_count = hn::Lanes(lanes);
        const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(some), static_cast<std::uint8_t>(some >> 8)};
        const auto mask = hn::LoadMaskBits(lanes, bytes);
        const Real* corner = finer + ((child & 1) + fine * ((child >> 1 & 1) + fine * (child >> 2))) * lane_count;
        Real* out = queue.coefficients.data() + queue.size;
        for (std::size_t z = 0; z < coarse; ++z)
            for (std::size_t y = 0; y < coarse; ++y)
                for (std::size_t x = 0; x < coarse; ++x, out += Queue::capacity) {
                    const auto coefficients = hn::Load(lanes, corner + (x + fine * (y + fine * z)) * lane_count);
                    hn::StoreU(hn::Compress(coefficients, mask), lanes, out);
                }
        hn::StoreU(hn::Compress(tolerance, mask), lanes, queue.tolerances.data() + queue.size);
        for (unsigned rest = some; rest != 0; rest &= rest - 1u)
            queue.cells[queue.size++] = cells[std::countr_zero(rest)];
    }

    Real threshold_, threshold_rest_;
    Real tolerance_; ///< relative to the largest coefficient of a cell
    std::vector<Queue> queues_;
    std::vector<BrickCells>& kept_;
    std::vector<BrickCells>& undecided_;
};

template <int Degree, typename Real>
void prune_cells(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
                 std::span<const BrickCells> cells, std::vector<BrickCells>& kept, std::vector<BrickCells>& undecided)
{
    Pruner<Degree, Real> pruner(threshold, depth, kept, undecided);
    for (std::size_t i = 0; i < bricks.size(); ++i)
        for_each_cell(cells[i], [&](int x, int y, int z) {
            const auto cell = static_cast<std::size_t>(x + brick_size * (y + brick_size * z));
            pruner.add(512 * i + cell, volume, bricks[i].first + glm::ivec3(x, y, z));
        });
    pruner.finish();
}

template <int Degree>
void prune_degree(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
                  std::span<BrickCells> cells)
{
    std::vector<BrickCells> kept(bricks.size()), undecided(bricks.size());
    prune_cells<Degree, float>(volume, threshold, depth, bricks, cells, kept, undecided);

    // Repeat in float64 what float32 could not decide.
    bool any_undecided = false;
    for (std::size_t i = 0; i < bricks.size(); ++i)
        for (std::size_t z = 0; z < undecided[i].size(); ++z) {
            undecided[i][z] &= ~kept[i][z];
            any_undecided = any_undecided || undecided[i][z] != 0;
        }
    if (any_undecided) {
        std::vector<BrickCells> none(bricks.size());
        prune_cells<Degree, double>(volume, threshold, depth, bricks, undecided, kept, none);
    }
    for (std::size_t i = 0; i < bricks.size(); ++i)
        cells[i] = kept[i];
}

void prune(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
           std::span<BrickCells> cells)
{
    dispatch_degree(volume.degree(),
                    [&](auto degree) { prune_degree<degree>(volume, threshold, depth, bricks, cells); });
}

void prune_beyond_rounding(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
                           std::span<BrickCells> cells)
{
    std::vector<BrickCells> kept(bricks.size());
    dispatch_degree(volume.degree(), [&](auto degree) {
        prune_cells<degree, float>(volume, threshold, depth, bricks, cells, kept, kept);
    });
    std::copy(kept.begin(), kept.end(), cells.begin());
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(prune);
HWY_EXPORT(prune_beyond_rounding);

void prune(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
           std::span<BrickCells> cells)
{
    HWY_DYNAMIC_DISPATCH(prune)(volume, threshold, depth, bricks, cells);
}

void prune_beyond_rounding(const Volume& volume, double threshold, int depth, std::span<const Brick> bricks,
                           std::span<BrickCells> cells)
{
    HWY_DYNAMIC_DISPATCH(prune_beyond_rounding)(volume, threshold, depth, bricks, cells);
}

} // namespace isospline
#endif
