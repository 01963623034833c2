// Where the coefficients of bricks come from: memory, or a store that loads what rays enter.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/spline/coefficient_view.h"
#include "isospline/spline/volume.h"

#include <memory>
#include <utility>

namespace isospline {

/// Gives the coefficients of a volume brick by brick.
class CoefficientSource {
public:
    virtual ~CoefficientSource() = default;
    /// Of one brick. May be called by any number of threads at a time, several times for one brick, with the same
    /// numbers each time; what it returns stays valid as long as the source lives. An exception ends the query that
    /// asked.
    virtual CoefficientView coefficients(const Brick& brick) const = 0;
};

/// The coefficients in a volume's memory.
class VolumeSource final : public CoefficientSource {
public:
    explicit VolumeSource(std::shared_ptr<const Volume> volume) : volume_(std::move(volume)) {}

    CoefficientView coefficients(const Brick& brick) const override
    {
        return {volume_->cell_coefficients(brick.first.x, brick.first.y, brick.first.z), volume_->row_stride(),
                volume_->slice_stride()};
    }

private:
    std::shared_ptr<const Volume> volume_;
};

} // namespace isospline
