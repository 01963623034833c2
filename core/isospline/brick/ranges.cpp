#include "isospline/brick/ranges.h"

#include "isospline/brick/block_ranges.h"
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

/// Codes are rounded outwards by this, which is more than the rounding of their computation in single precision.
constexpr float code_margin = 1e-3f;
constexpr float last_code = 255.0f;

float codes_per_unit(const BrickRanges::Range& range)
{
    const float codes = range.upper > range.lower ? last_code / (range.upper - range.lower) : 0.0f;
    return std::isfinite(codes) ? codes : 0.0f; // a range may be too small for that
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
        find_whole();
        return;
    }
    found_.resize(count);
    octets_ = found_;
    blocks_.resize(8 * count);
    slabs_.resize(8 * count);
    const auto find = [&](std::size_t begin, std::size_t end) {
        for (std::size_t index = begin; index < end; ++index)
            for (std::size_t child = 0; child < 8; ++child) {
                const Brick brick = brick_at(volume.cell_shape(),
                                             2 * at_place(shape_, index) + child_position(static_cast<int>(child)));
                Range range{infinity, -infinity};
                if (brick.size.x > 0 && brick.size.y > 0 && brick.size.z > 0) {
                    const BlockRanges blocks =
                        block_ranges(volume.box(brick.first, brick.size), brick, volume.degree());
                    range = {blocks.least, blocks.most};
                    const float scale = codes_per_unit(range);
                    BlockCodes& codes = blocks_[8 * index + child];
                    for (std::size_t i = 0; i < blocks_per_brick; ++i) {
                        const float lower = scale * (blocks.lower[i] - range.lower) - code_margin;
                        const float upper = scale * (blocks.upper[i] - range.lower) + code_margin + 1.0f;
                        codes.lower[i] = static_cast<std::uint8_t>(std::clamp(lower, 0.0f, last_code));
                        codes.upper[i] = static_cast<std::uint8_t>(std::clamp(upper, 0.0f, last_code));
                    }
                    SlabCodes& slabs = slabs_[8 * index + child];
                    slabs.lower.fill(255);
                    slabs.upper.fill(0);
                    for (std::size_t i = 0; i < blocks_per_brick; ++i)
                        for (const std::size_t slab : {i & 3u, 4 + (i >> 2 & 3u), 8 + (i >> 4)}) {
                            slabs.lower[slab] = std::min(slabs.lower[slab], codes.lower[i]);
                            slabs.upper[slab] = std::max(slabs.upper[slab], codes.upper[i]);
                        }
                }
                found_[index].lower[child] = range.lower;
                found_[index].upper[child] = range.upper;
            }
    };
    parallel_for(octets_.size(), 8, find, progress);
    find_whole();
}

void BrickRanges::find_whole()
{
    whole_ = octets_.front().brick(0);
    for (const Octet& octet : octets_) // bricks beyond the grid have ranges that change nothing
        for (std::size_t child = 0; child < 8; ++child) {
            whole_.lower = std::min(whole_.lower, octet.lower[child]);
            whole_.upper = std::max(whole_.upper, octet.upper[child]);
        }
}

unsigned BrickRanges::straddling(std::size_t octet, double threshold) const
{
    unsigned bricks = 0;
    for (std::size_t child = 0; child < 8; ++child)
        bricks |= static_cast<unsigned>(octets_[octet].brick(child).straddles(threshold)) << child;
    return bricks;
}

template <std::size_t Count>
std::uint64_t BrickRanges::straddling(const Codes<Count>& codes, const Range& range, double threshold) const
{
    const double code = (threshold - static_cast<double>(range.lower)) * static_cast<double>(codes_per_unit(range));
    const auto limit = [](double value) {
        return static_cast<std::uint8_t>(std::clamp(value, 0.0, static_cast<double>(last_code)));
    };
    const hn::CappedTag<std::uint8_t, 16> d;
    const auto most_lower = hn::Set(d, limit(std::floor(code))), least_upper = hn::Set(d, limit(std::ceil(code)));
    std::uint64_t parts = 0;
    for (std::size_t first = 0; first < Count; first += hn::Lanes(d)) {
        const auto lower = hn::Load(d, codes.lower.data() + first), upper = hn::Load(d, codes.upper.data() + first);
        std::uint8_t bits[8] = {};
        // Old versions of Highway have no Le and Ge of integers for NEON.
        const auto lower_meets = hn::Eq(hn::Min(lower, most_lower), lower);
        const auto upper_meets = hn::Eq(hn::Max(upper, least_upper), upper);
        hn::StoreMaskBits(d, hn::And(lower_meets, upper_meets), bits);
        parts |= static_cast<std::uint64_t>(bits[0] | bits[1] << 8) << first;
    }
    return parts;
}

std::uint64_t BrickRanges::straddling_blocks(std::size_t octet, int child, double threshold) const
{
    const auto at = static_cast<std::size_t>(child);
    return straddling(blocks_[8 * octet + at], octets_[octet].brick(at), threshold);
}

BrickRanges::BlockSides BrickRanges::block_sides(const glm::ivec3& position, double least, double most) const
{
    const Range range = brick(position);
    const auto code = [&](double value) {
        const double scaled = (value - static_cast<double>(range.lower)) * static_cast<double>(codes_per_unit(range));
        return std::clamp(scaled, 0.0, static_cast<double>(last_code));
    };
    return {blocks_[number_of(position)], static_cast<std::uint8_t>(std::floor(code(most))),
            static_cast<std::uint8_t>(std::ceil(code(least)))};
}

unsigned BrickRanges::straddling_slabs(std::size_t octet, int child, double threshold) const
{
    const auto at = static_cast<std::size_t>(child);
    return static_cast<unsigned>(straddling(slabs_[8 * octet + at], octets_[octet].brick(at), threshold));
}

std::uint64_t straddling_blocks(const CoefficientView& coefficients, const Brick& brick, int degree, double threshold)
{
    const BlockRanges ranges = block_ranges(coefficients, brick, degree);
    std::uint64_t blocks = 0;
    for (std::size_t i = 0; i < blocks_per_brick; ++i) {
        const BrickRanges::Range range{ranges.lower[i], ranges.upper[i]};
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
