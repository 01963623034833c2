#include "isospline/polygonize/tolerance_search.h"

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// The share of the faces at which a step aims.
constexpr double aim = 0.93;
/// The largest factor by which a step divides or multiplies the tolerance. Finer meshes cost more.
constexpr double most_finer = 8.0, most_coarser = 64.0, least_step = 1.05;

} // namespace

ToleranceSearch::ToleranceSearch(std::size_t faces, double first, double finest, double coarsest)
    : faces_(std::log(static_cast<double>(faces))), finest_(std::log(finest)), coarsest_(std::log(coarsest)),
      next_(first)
{
}

bool ToleranceSearch::add(std::size_t count)
{
    const Trial trial{std::log(*next_), std::log(static_cast<double>(std::max<std::size_t>(count, 1)))};
    if (last_) {
        const double slope = (trial.count - last_->count) / (trial.tolerance - last_->tolerance);
        slope_ = std::clamp(slope, -2.5, -0.3);
    }
    last_ = trial;
    const bool is_few = trial.count <= faces_;
    (is_few ? few_ : many_) = trial;
    const std::optional<double> next = after(trial);
    next_ = next ? std::optional(std::exp(*next)) : std::nullopt;
    return is_few;
}

std::optional<double> ToleranceSearch::after(const Trial& trial)
{
    if (few_ && few_->count >= faces_ + std::log(enough))
        return std::nullopt;
    if (few_ && many_) {
        if (few_->tolerance - many_->tolerance < std::log(least_step))
            return std::nullopt;
        return interpolated();
    }
    const double next = std::clamp(extrapolated(trial), finest_, coarsest_);
    if (std::abs(next - trial.tolerance) < 1e-6) // at an end
        return std::nullopt;
    return next;
}

double ToleranceSearch::extrapolated(const Trial& trial) const
{
    const double step = (faces_ + std::log(aim) - trial.count) / slope_;
    if (few_)
        return trial.tolerance - std::clamp(-step, std::log(least_step), std::log(most_finer));
    return trial.tolerance + std::clamp(step, std::log(least_step), std::log(most_coarser));
}

double ToleranceSearch::interpolated()
{
    double share = 0.5;
    if (++interpolations_ % 3 != 0)
        share = std::clamp((faces_ + std::log(aim) - many_->count) / (few_->count - many_->count), 0.1, 0.9);
    return many_->tolerance + share * (few_->tolerance - many_->tolerance);
}

} // namespace isospline
