// A source of coefficients that counts the requested bricks, for tests.
#pragma once

#include "isospline/brick/ranges.h"
#include "isospline/spline/coefficient_source.h"
#include "isospline/spline/volume.h"
#include "isospline/util/memory_budget.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace isospline {

/// Provides the coefficients of a volume in memory. While `refuse` is set, it throws `Refusal` instead.
class CountingSource final : public CoefficientSource {
public:
    struct Refusal {};

    /// With a budget in bytes, or without one.
    explicit CountingSource(std::shared_ptr<const Volume> volume, std::size_t limit = 0)
        : volume_(std::move(volume)), ranges_(*volume_), budget_(limit), has_budget_(limit > 0)
    {
    }

    void copy(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
              std::ptrdiff_t slice_stride) const override
    {
        if (delay)
            delay();
        const std::lock_guard lock(mutex_);
        if (refuse)
            throw Refusal();
        // The part of a brick's box that is in the volume has more than the coefficients of a cell.
        constexpr int most_of_cell = 4;
        if (std::min({size.x, size.y, size.z}) > most_of_cell) {
            ++asked_;
            const glm::ivec3 brick = (first + volume_->padding()) / brick_size;
            bricks_.insert({brick.x, brick.y, brick.z});
        }
        volume_->copy(first, size, to, row_stride, slice_stride);
    }

    std::span<const float> brick_ranges() const override
    {
        const auto octets = ranges_.octets();
        return {octets.front().lower.data(), octets.size_bytes() / sizeof(float)};
    }

    MemoryBudget* budget() const override { return has_budget_ ? &budget_ : nullptr; }

    /// The first cells of requested bricks.
    std::vector<glm::ivec3> bricks() const
    {
        const std::lock_guard lock(mutex_);
        std::vector<glm::ivec3> bricks;
        for (const auto& at : bricks_)
            bricks.push_back(brick_size * glm::ivec3(at[0], at[1], at[2]));
        return bricks;
    }
    /// The number of requests for a brick.
    std::size_t asked() const
    {
        const std::lock_guard lock(mutex_);
        return asked_;
    }

    bool refuse = false;
    std::function<void()> delay; ///< called at the begin of each request; it may wait, as a slow disk does

private:
    const std::shared_ptr<const Volume> volume_;
    const BrickRanges ranges_;
    mutable MemoryBudget budget_;
    const bool has_budget_;
    mutable std::mutex mutex_;
    mutable std::size_t asked_ = 0;
    mutable std::set<std::array<int, 3>> bricks_;
};

/// The volume of a source.
inline std::shared_ptr<const Volume> volume_of(const std::shared_ptr<const CountingSource>& source,
                                               const Volume& volume)
{
    return std::make_shared<const Volume>(volume.options(), volume.summary(), source);
}

} // namespace isospline
