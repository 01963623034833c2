// A source of coefficients that keeps copies of its own and the bricks that it was asked for, for tests.
#pragma once

#include "isospline/brick/source.h"

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace isospline {

/// Copies a brick where it is first asked for, each row no longer than what must be readable of it; the volume may
/// change after that. Throws `Refusal` instead while `refuse` is set.
class CountingSource final : public CoefficientSource {
public:
    struct Refusal {};

    explicit CountingSource(std::shared_ptr<const Volume> volume) : volume_(std::move(volume)) {}

    CoefficientView coefficients(const Brick& brick) const override
    {
        const std::lock_guard lock(mutex_);
        if (refuse)
            throw Refusal();
        ++asked_;
        auto [place, is_new] = copies_.try_emplace({brick.first.x, brick.first.y, brick.first.z});
        // Four floats are readable from the beginning of every row of a cell.
        const glm::ivec3 size = brick.size + glm::ivec3(3, volume_->degree(), volume_->degree());
        if (is_new) {
            const float* first = volume_->cell_coefficients(brick.first.x, brick.first.y, brick.first.z);
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y) {
                    const float* row = first + y * volume_->row_stride() + z * volume_->slice_stride();
                    place->second.insert(place->second.end(), row, row + size.x);
                }
        }
        return {place->second.data(), size.x, std::ptrdiff_t{size.x} * size.y};
    }

    /// The first cells of bricks that were asked for.
    std::vector<glm::ivec3> bricks() const
    {
        const std::lock_guard lock(mutex_);
        std::vector<glm::ivec3> bricks;
        for (const auto& [first, copy] : copies_)
            bricks.emplace_back(first[0], first[1], first[2]);
        return bricks;
    }
    /// How often it was asked.
    std::size_t asked() const
    {
        const std::lock_guard lock(mutex_);
        return asked_;
    }

    bool refuse = false;

private:
    const std::shared_ptr<const Volume> volume_;
    mutable std::mutex mutex_;
    mutable std::size_t asked_ = 0;
    mutable std::map<std::array<int, 3>, std::vector<float>> copies_; ///< by the brick's first cell
};

} // namespace isospline
