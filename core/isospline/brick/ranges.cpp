#include "isospline/brick/ranges.h"

#include "isospline/math/grid.h"
#include "isospline/spline/volume.h"
#include "isospline/util/cancellable_mutex.h"
#include "isospline/util/error.h"
#include "isospline/util/fork.h"
#include "isospline/util/parallel.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <string>

namespace isospline {

namespace hn = hwy::HWY_NAMESPACE;

namespace {

constexpr int most_coefficients = brick_size + 5; // along an axis of a brick, up to degree 5
constexpr int blocks_along = brick_size / 2;

/// The smallest and the largest coefficient of each of `Count` groups, in a form that compilers vectorise.
template <int Count>
struct Extremes {
    float lower[Count], upper[Count];

    void extend(const Extremes& other)
    {
        for (int i = 0; i < Count; ++i)
            lower[i] = other.lower[i] < lower[i] ? other.lower[i] : lower[i];
        for (int i = 0; i < Count; ++i)
            upper[i] = other.upper[i] > upper[i] ? other.upper[i] : upper[i];
    }
};

/// The extremes of the blocks along a row, of which 16 coefficients can be read. Block i has the 2 + degree
/// coefficients that begin at 2 i.
Extremes<blocks_along> extremes_of_row(const float* row, int degree)
{
    // The row as pairs: for each pair its first, its smallest and its largest coefficient.
    Extremes<8> pairs;
    float first[8];
    for (int i = 0; i < 8; ++i) {
        const float second = row[2 * i + 1];
        first[i] = row[2 * i];
        pairs.lower[i] = second < first[i] ? second : first[i];
        pairs.upper[i] = second > first[i] ? second : first[i];
    }
    Extremes<blocks_along> blocks;
    const int pair_count = (2 + degree) / 2;
    for (int i = 0; i < blocks_along; ++i) {
        blocks.lower[i] = pairs.lower[i];
        blocks.upper[i] = pairs.upper[i];
    }
    const auto extend = [&](const float* lower, const float* upper) {
        for (int i = 0; i < blocks_along; ++i) {
            blocks.lower[i] = lower[i] < blocks.lower[i] ? lower[i] : blocks.lower[i];
            blocks.upper[i] = upper[i] > blocks.upper[i] ? upper[i] : blocks.upper[i];
        }
    };
    for (int pair = 1; pair < pair_count; ++pair)
        extend(pairs.lower + pair, pairs.upper + pair);
    if (degree % 2 != 0)
        extend(first + pair_count, first + pair_count);
    return blocks;
}

/// The extremes of the blocks along one more axis, given the extremes of its `count` rows or slices of coefficients.
/// Blocks beyond the brick's end have no meaning.
template <int Count>
void extend_along(const Extremes<Count>* coefficients, int count, int degree, Extremes<Count>* blocks)
{
    for (int block = 0; 2 * block < count - degree; ++block) {
        blocks[block] = coefficients[2 * block];
        for (int i = 2 * block + 1; i < std::min(2 * block + 2 + degree, count); ++i)
            blocks[block].extend(coefficients[i]);
    }
}

/// The extremes of all blocks of a brick.
Extremes<blocks_per_brick> extremes_of_blocks(const CoefficientView& coefficients, const Brick& brick, int degree)
{
    constexpr int per_slice = blocks_along * blocks_along;
    const glm::ivec3 size = brick.size + degree;
    Extremes<per_slice> slices[most_coefficients], blocks[blocks_along];
    for (int z = 0; z < size.z; ++z) {
        Extremes<blocks_along> rows[most_coefficients], of_slice[blocks_along] = {};
        for (int y = 0; y < size.y; ++y) {
            const float* const row = coefficients.from(0, y, z).first;
            if (brick.size.x == brick_size) {
                rows[y] = extremes_of_row(row, degree);
                continue;
            }
            float padded[16];
            std::fill(std::copy_n(row, size.x, padded), padded + 16, row[size.x - 1]);
            rows[y] = extremes_of_row(padded, degree);
        }
        extend_along(rows, size.y, degree, of_slice);
        for (int block = 0; block < blocks_along; ++block) {
            std::copy_n(of_slice[block].lower, blocks_along, slices[z].lower + block * blocks_along);
            std::copy_n(of_slice[block].upper, blocks_along, slices[z].upper + block * blocks_along);
        }
    }
    extend_along(slices, size.z, degree, blocks);

    Extremes<blocks_per_brick> all;
    std::fill_n(all.lower, blocks_per_brick, std::numeric_limits<float>::max());
    std::fill_n(all.upper, blocks_per_brick, std::numeric_limits<float>::lowest());
    for (int z = 0; 2 * z < brick.size.z; ++z)
        for (int y = 0; 2 * y < brick.size.y; ++y)
            for (int x = 0; 2 * x < brick.size.x; ++x) {
                const int in_slice = x + blocks_along * y, block = in_slice + per_slice * z;
                all.lower[block] = blocks[z].lower[in_slice];
                all.upper[block] = blocks[z].upper[in_slice];
            }
    return all;
}

/// Codes are rounded outwards by this, which is more than the rounding of their computation in single precision.
constexpr float code_margin = 1e-3f;
constexpr float last_code = 255.0f;

float codes_per_unit(const BrickRanges::Range& range)
{
    return range.upper > range.lower ? last_code / (range.upper - range.lower) : 0.0f;
}

} // namespace

BrickRanges::BrickRanges(const Volume& volume, const Progress& progress) : shape_(octet_shape(volume.cell_shape()))
{
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const glm::vec<3, std::size_t> shape(shape_);
    const std::size_t count = shape.x * shape.y * shape.z;
    if (volume.source() != nullptr && !volume.source()->brick_ranges().empty()) {
        const std::span<const float> known = volume.source()->brick_ranges();
        if (known.size() != count * sizeof(Octet) / sizeof(float))
            throw_invalid("ranges", std::to_string(count) + " octets of bricks",
                          known.size() * sizeof(float) / sizeof(Octet));
        octets_ = {reinterpret_cast<const Octet*>(known.data()), count};
        return;
    }
    found_.resize(count);
    octets_ = found_;
    blocks_.resize(8 * count);
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index)
            for (std::size_t child = 0; child < 8; ++child) {
                const Brick brick = brick_at(volume.cell_shape(),
                                             2 * at_place(shape_, index) + child_position(static_cast<int>(child)));
                Range range{infinity, -infinity};
                if (brick.size.x > 0 && brick.size.y > 0 && brick.size.z > 0) {
                    const Extremes<blocks_per_brick> blocks =
                        extremes_of_blocks(volume.box(brick.first, brick.size), brick, volume.degree());
                    range = {*std::min_element(blocks.lower, std::end(blocks.lower)),
                             *std::max_element(blocks.upper, std::end(blocks.upper))};
                    const float scale = codes_per_unit(range);
                    BlockCodes& codes = blocks_[8 * index + child];
                    for (std::size_t i = 0; i < blocks_per_brick; ++i) {
                        const float lower = scale * (blocks.lower[i] - range.lower) - code_margin;
                        const float upper = scale * (blocks.upper[i] - range.lower) + code_margin + 1.0f;
                        codes.lower[i] = static_cast<std::uint8_t>(std::clamp(lower, 0.0f, last_code));
                        codes.upper[i] = static_cast<std::uint8_t>(std::clamp(upper, 0.0f, last_code));
                    }
                }
                found_[index].lower[child] = range.lower;
                found_[index].upper[child] = range.upper;
            }
    };
    parallel_for(octets_.size(), 8, find, progress);
}

unsigned BrickRanges::straddling(std::size_t octet, double threshold) const
{
    unsigned bricks = 0;
    for (std::size_t child = 0; child < 8; ++child)
        bricks |= static_cast<unsigned>(octets_[octet].brick(child).straddles(threshold)) << child;
    return bricks;
}

std::uint64_t BrickRanges::straddling_blocks(std::size_t octet, int child, double threshold) const
{
    const auto at = static_cast<std::size_t>(child);
    const Range range = octets_[octet].brick(at);
    const double code = (threshold - static_cast<double>(range.lower)) * static_cast<double>(codes_per_unit(range));
    const auto limit = [](double value) {
        return static_cast<std::uint8_t>(std::clamp(value, 0.0, static_cast<double>(last_code)));
    };
    const hn::CappedTag<std::uint8_t, 16> d;
    const auto most_lower = hn::Set(d, limit(std::floor(code))), least_upper = hn::Set(d, limit(std::ceil(code)));
    const BlockCodes& codes = blocks_[8 * octet + at];
    std::uint64_t blocks = 0;
    for (std::size_t first = 0; first < blocks_per_brick; first += hn::Lanes(d)) {
        const auto lower = hn::Load(d, codes.lower.data() + first), upper = hn::Load(d, codes.upper.data() + first);
        std::uint8_t bits[8] = {};
        // Old versions of Highway have no Le and Ge of integers for NEON.
        const auto lower_meets = hn::Eq(hn::Min(lower, most_lower), lower);
        const auto upper_meets = hn::Eq(hn::Max(upper, least_upper), upper);
        hn::StoreMaskBits(d, hn::And(lower_meets, upper_meets), bits);
        blocks |= static_cast<std::uint64_t>(bits[0] | bits[1] << 8) << first;
    }
    return blocks;
}

std::uint64_t straddling_blocks(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold)
{
    const Extremes<blocks_per_brick> extremes = extremes_of_blocks(coefficients, brick, degree);
    std::uint64_t blocks = 0;
    for (std::size_t i = 0; i < blocks_per_brick; ++i) {
        const BrickRanges::Range range{extremes.lower[i], extremes.upper[i]};
        blocks |= static_cast<std::uint64_t>(range.straddles(threshold)) << i;
    }
    return blocks;
}

std::shared_ptr<const BrickRanges> shared_ranges(const std::shared_ptr<const Volume>& volume, const Progress& progress)
{
    /// The ranges of one volume, as long as anybody holds them.
    struct Shared {
        CancellableMutex to_compute;
        std::weak_ptr<const BrickRanges> ranges;
    };
    using Known = std::map<std::weak_ptr<const Volume>, std::shared_ptr<Shared>, std::owner_less<>>;
    static Known known;
    std::shared_ptr<Shared> shared;
    {
        const std::lock_guard lock(fork_safe_mutex(&known));
        std::erase_if(known, [](const auto& each) { return each.first.expired(); });
        std::shared_ptr<Shared>& of_volume = known[volume];
        if (!of_volume)
            of_volume = std::make_shared<Shared>();
        if (auto ranges = of_volume->ranges.lock())
            return ranges;
        shared = of_volume;
    }
    const CancellableMutex::Lock lock(shared->to_compute, progress);
    {
        const std::lock_guard moment(fork_safe_mutex(&known));
        if (auto ranges = shared->ranges.lock()) // the previous thread has computed them
            return ranges;
    }
    auto ranges = std::make_shared<const BrickRanges>(*volume, progress);
    const std::lock_guard moment(fork_safe_mutex(&known));
    shared->ranges = ranges;
    return ranges;
}

} // namespace isospline
