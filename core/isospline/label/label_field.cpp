#include "isospline/label/label_field.h"

#include "isospline/label/brick_field.h"
#include "isospline/label/brick_filter.h"
#include "isospline/label/label_bricks.h"
#include "isospline/label/partial_volumes.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

namespace isospline {

namespace {

/// The least and the largest magnitude of a sample. The least one keeps the centres of voxels on their side.
constexpr float least_sample = 0.005f, most_sample = 1.0f;
/// Rounds of smoothing, each followed by a correction of the volume; corrections without smoothing after them.
constexpr int rounds = 4, corrections = 3;
/// Low-pass filters in a round.
constexpr int filters = 3;
/// The standard deviation in which volume is preserved, relative to that of the smoothing.
constexpr double volume_scale = 2.0;
/// Filtered zeros have at most this magnitude.
constexpr float rounding_of_filters = 1e-6f;
/// The reach around a surface in which the field has samples of its own, in standard deviations of the smoothing.
constexpr double reach_scale = 4.0;
/// The largest correction of a sample, and the least derivative of a volume.
constexpr float largest_correction = 0.5f, least_slope = 1e-3f;
/// Divisions of a voxel in corrections, and to enclose a volume: as many as this number of boxes allows.
constexpr int few_divisions = 2, most_divisions = 12;
constexpr double box_budget = 2e7;
/// The error of a volume at which the search for it ends, and the number of its steps. From a large error on, surfaces
/// between two labels are moved, too.
constexpr double small_error = 5e-4, large_error = 3e-3, largest_step = 0.2;
constexpr int most_steps = 8;

/// Calls `body(i)` with the place of each number of computed bricks.
template <typename Body>
void for_each_computed(const BrickLayout& layout, const Body& body)
{
    parallel_for(layout.stored.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number)
            if (layout.computed[number] != 0)
                for (std::size_t i = number * numbers_of_brick; i < (number + 1) * numbers_of_brick; ++i)
                    body(i);
    });
}

/// A sample with a magnitude within limits, on the side of its voxel.
float kept(float sample, float sign)
{
    return sign * std::clamp(sample * sign, least_sample, most_sample);
}

/// 1 in a label, and another number elsewhere.
BrickField indicator(const LabelMap& labels, const BrickLayout& layout, std::int32_t label, float elsewhere)
{
    return field_of(labels, layout, [=](std::int32_t at) { return at == label ? 1.0f : elsewhere; });
}

/// The smoothing of one map.
struct Filters {
    explicit Filters(const glm::dvec3& deviations)
        : blur(gaussian_filter(deviations)), smooth(low_pass_filter(deviations)),
          spread(gaussian_filter(volume_scale * deviations)), to_coefficients(interpolation_filter())
    {
    }

    SeparableFilter blur, smooth, spread, to_coefficients;
};

/// What the fields of a map's labels are made from.
struct Given {
    glm::ivec3 blur_reach() const { return {filters.blur[0].size(), filters.blur[1].size(), filters.blur[2].size()}; }

    LabelMap labels;
    LabelBricks bricks;
    Filters filters;
};

/// The blurred indicator of a label less the largest one of the others.
BrickField contrast(const Given& given, std::int32_t label, const BrickField& signs, const Progress& progress)
{
    const BrickLayout& layout = *signs.layout;
    BrickField field(layout, 0.0f), between(layout, 0.0f);
    apply(given.filters.blur, signs, field, between, progress); // 1 where the others have 0, and -1 where they have 1
    const LabelBricks::Meetings meetings = given.bricks.meetings(layout, given.blur_reach());
    const LabelBricks::Chosen around = given.bricks.widened(meetings.bricks, given.blur_reach());
    BrickLayout where_labels_meet = layout;
    for (std::size_t number = 0; number < layout.stored.size(); ++number)
        where_labels_meet.computed[number] &= around[layout.stored[number]];
    BrickField largest(where_labels_meet, 0.0f), other = largest, memory = largest;
    for (const std::int32_t rival : meetings.labels) {
        if (rival == label)
            continue;
        apply(given.filters.blur, indicator(given.labels, where_labels_meet, rival, 0.0f), other, memory, progress);
        for_each_computed(where_labels_meet,
                          [&](std::size_t i) { largest.data[i] = std::max(largest.data[i], other.data[i]); });
    }
    for (std::size_t number = 0; number < layout.stored.size(); ++number)
        if (layout.computed[number] != 0 && meetings.bricks[layout.stored[number]] != 0)
            for (std::size_t i = number * numbers_of_brick; i < (number + 1) * numbers_of_brick; ++i)
                if (const float own = 0.5f * (field.data[i] + 1.0f); own > rounding_of_filters)
                    field.data[i] = own - largest.data[i];
    return field;
}

struct OwnField {
    BrickField field, signs;
    std::size_t crossed; ///< voxels, about
};

/// The field of a label against all others together.
OwnField own_field(const Given& given, const BrickLayout& layout, std::int32_t label, const Progress& progress)
{
    const Filters& by = given.filters;
    const BrickField signs = indicator(given.labels, layout, label, -1.0f);
    BrickField field = contrast(given, label, signs, only_cancelling(progress));
    BrickField other(layout, 0.0f), between = other, parts = other, slopes = other;
    const auto keep_sides = [&] {
        for_each_computed(layout, [&](std::size_t i) { field.data[i] = kept(field.data[i], signs.data[i]); });
    };
    keep_sides();
    std::size_t crossed = 0;
    for (int step = 0; step < rounds + corrections; ++step) {
        for (int i = 0; step < rounds && i < filters; ++i) {
            apply(by.smooth, field, other, between, only_cancelling(progress));
            std::swap(field, other);
            keep_sides();
        }
        // Newton's method for the volume near each voxel.
        apply(by.to_coefficients, field, other, between, only_cancelling(progress));
        crossed = find_partial_volumes(other, few_divisions, parts, slopes, only_cancelling(progress)).crossed;
        for_each_computed(layout,
                          [&](std::size_t i) { parts.data[i] = (signs.data[i] > 0.0f ? 1.0f : 0.0f) - parts.data[i]; });
        std::fill(parts.constants.begin(), parts.constants.end(), 0.0f);
        apply(by.spread, parts, other, between, only_cancelling(progress));
        std::swap(parts, other);
        apply(by.spread, slopes, other, between, only_cancelling(progress));
        for_each_computed(layout, [&](std::size_t i) {
            const float correction = parts.data[i] / std::max(other.data[i], least_slope);
            field.data[i] += std::clamp(correction, -largest_correction, largest_correction);
        });
        keep_sides();
        report(progress, (step + 1.0) / (rounds + corrections));
    }
    return {std::move(field), signs, crossed};
}

} // namespace

struct LabelField::Impl {
    Impl(const LabelMap& labels, std::int32_t label, std::int32_t background, const glm::dvec3& deviations,
         const Progress& progress);

    void subtract_rivals(const Given& given, std::int32_t label, const Progress& progress);
    /// The volume in voxels, and its derivatives.
    double enclosed_by(const BrickField& field, BrickField& parts, BrickField& slopes, const Progress& progress) const;
    /// Adds a multiple of weights, so that the volume is the goal. Returns the relative error that is left.
    double move(const BrickField& weights, double goal, const Progress& progress);

    glm::ivec3 reach; ///< in voxels
    BrickLayout layout;
    BrickField signs, field, anywhere, beside_background;
    bool has_background = false;
    std::size_t voxel_count = 0;
    int divisions = few_divisions;
};

LabelField::Impl::Impl(const LabelMap& labels, std::int32_t label, std::int32_t background,
                       const glm::dvec3& deviations, const Progress& progress)
    : reach(glm::ceil(reach_scale * deviations)), layout(labels.shape), signs(layout, 0.0f), field(layout, 0.0f),
      anywhere(layout, 0.0f), beside_background(layout, 0.0f)
{
    const Given given{labels, LabelBricks(labels), Filters(deviations)};
    layout = given.bricks.layout_around(label, reach);
    OwnField own = own_field(given, layout, label, part_of(progress, 0.0, 0.3));
    field = std::move(own.field);
    signs = std::move(own.signs);
    const double boxes = std::cbrt(box_budget / static_cast<double>(std::max<std::size_t>(own.crossed, 1)));
    divisions = static_cast<int>(std::clamp(boxes, 2.0 * few_divisions, double{most_divisions}));
    voxel_count = static_cast<std::size_t>(std::count(labels.values, labels.values + place_count(labels.shape), label));
    subtract_rivals(given, label, part_of(progress, 0.3, 1.0));

    // The part of what is beside the label that is background.
    anywhere = BrickField(layout, 1.0f);
    const auto spread_of = [&](const BrickField& from) {
        BrickField to(layout, 0.0f), between = to;
        apply(given.filters.spread, from, to, between, only_cancelling(progress));
        return to;
    };
    beside_background = spread_of(indicator(labels, layout, background, 0.0f));
    const BrickField inside = spread_of(signs);
    for_each_computed(
        layout, [&](std::size_t i) { beside_background.data[i] /= std::max(0.5f * (1.0f - inside.data[i]), 1e-6f); });
    has_background = std::any_of(beside_background.data.begin(), beside_background.data.end(),
                                 [](float part) { return part > 0.5f; });
}

/// Where three labels meet, takes half the difference between the field and the largest of the others.
void LabelField::Impl::subtract_rivals(const Given& given, std::int32_t label, const Progress& progress)
{
    LabelBricks::Meetings meetings = given.bricks.meetings(layout, 2 * reach);
    std::erase(meetings.labels, label);
    BrickField largest(layout, -most_sample);
    for (std::size_t i = 0; i < meetings.labels.size(); ++i) {
        const auto count = static_cast<double>(meetings.labels.size()), done = static_cast<double>(i);
        const BrickLayout around = given.bricks.layout_around(meetings.labels[i], reach, &meetings.bricks);
        const BrickField rival =
            own_field(given, around, meetings.labels[i], part_of(progress, done / count, (done + 1.0) / count)).field;
        for (std::size_t number = 0; number < layout.stored.size(); ++number) {
            const std::size_t brick = layout.stored[number];
            const float* const numbers = rival.find(brick);
            if (numbers == nullptr && rival.constants[brick] < 0.0f)
                continue; // no rival is nearby
            float* const to = largest.numbers(number);
            for (std::size_t place = 0; place < numbers_of_brick; ++place)
                to[place] = std::max(to[place], numbers != nullptr ? numbers[place] : rival.constants[brick]);
        }
    }
    for (std::size_t number = 0; number < layout.stored.size(); ++number)
        if (meetings.bricks[layout.stored[number]] != 0)
            for (std::size_t i = number * numbers_of_brick; i < (number + 1) * numbers_of_brick; ++i)
                field.data[i] = 0.5f * (field.data[i] - largest.data[i]);
}

double LabelField::Impl::enclosed_by(const BrickField& given, BrickField& parts, BrickField& slopes,
                                     const Progress& progress) const
{
    BrickField coefficients(layout, 0.0f);
    apply(interpolation_filter(), given, coefficients, parts, only_cancelling(progress));
    return find_partial_volumes(coefficients, divisions, parts, slopes, only_cancelling(progress)).voxels;
}

/// The secant method.
double LabelField::Impl::move(const BrickField& weights, double goal, const Progress& progress)
{
    const BrickField before = field;
    BrickField moved = before, parts(layout, 0.0f), slopes(layout, 0.0f);
    double offset = 0.0, step = 0.0, best = std::numeric_limits<double>::infinity();
    std::optional<double> last;
    for (int i = 0; i < most_steps; ++i) {
        if (offset != 0.0)
            for_each_computed(layout, [&](std::size_t at) {
                moved.data[at] = kept(before.data[at] + static_cast<float>(offset) * weights.data[at], signs.data[at]);
            });
        const double error = enclosed_by(moved, parts, slopes, progress) / goal - 1.0;
        if (std::abs(error) < std::abs(best)) {
            best = error;
            field = moved;
        }
        if (std::abs(error) < small_error)
            break;
        const double slope = last ? (error - *last) / step : sum_of_products(slopes, weights) / goal;
        if (!(slope > 0.0))
            break;
        last = error;
        step = std::clamp(-error / slope, -largest_step, largest_step);
        offset += step;
    }
    return best;
}

LabelField::LabelField(const LabelMap& labels, std::int32_t label, std::int32_t background,
                       const glm::dvec3& deviations, const Progress& progress)
    : impl_(std::make_unique<Impl>(labels, label, background, deviations, progress))
{
}

LabelField::~LabelField() = default;

const glm::ivec3& LabelField::shape() const
{
    return impl_->layout.shape;
}

std::size_t LabelField::voxel_count() const
{
    return impl_->voxel_count;
}

double LabelField::enclose(double voxels, const Progress& progress)
{
    double error = std::numeric_limits<double>::infinity();
    if (impl_->has_background)
        error = impl_->move(impl_->beside_background, voxels, progress);
    if (!(std::abs(error) < large_error))
        error = impl_->move(impl_->anywhere, voxels, progress);
    return error;
}

std::vector<float> LabelField::samples() const
{
    return dense(impl_->field);
}

} // namespace isospline
