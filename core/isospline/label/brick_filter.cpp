#include "isospline/label/brick_filter.h"

#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/label/brick_filter.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Filters `count` rows of eight numbers, one behind the other. The neighbours of a number are `step` numbers apart.
void Convolve(const float* HWY_RESTRICT rows, std::size_t count, std::size_t step, const std::vector<float>& weights,
              float* HWY_RESTRICT result)
{
    const hn::CappedTag<float, brick_size> d;
    for (std::size_t first = 0; first < brick_size * count; first += hn::Lanes(d)) {
        const float *const at = rows + first, *before = at, *after = at;
        auto sum = hn::Mul(hn::Set(d, weights[0]), hn::LoadU(d, at));
        for (std::size_t i = 1; i < weights.size(); ++i) {
            before -= step;
            after += step;
            sum = hn::MulAdd(hn::Set(d, weights[i]), hn::Add(hn::LoadU(d, before), hn::LoadU(d, after)), sum);
        }
        hn::StoreU(sum, d, result + first);
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(Convolve);

namespace {

/// Weights that are less are left out.
constexpr double negligible = 1e-7;
/// The radius of a Gaussian in standard deviations.
constexpr double truncation = 3.0;

/// Weights from the middle on.
using Weights = std::vector<double>;

Weights gaussian_weights(double deviation)
{
    Weights weights(static_cast<std::size_t>(std::ceil(truncation * deviation)) + 1);
    double sum = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const double at = static_cast<double>(i) / deviation;
        weights[i] = std::exp(-0.5 * at * at);
        sum += (i == 0 ? 1.0 : 2.0) * weights[i];
    }
    for (double& weight : weights)
        weight /= sum;
    return weights;
}

/// The weights of two filters one after the other.
Weights convolved(const Weights& a, const Weights& b)
{
    const auto last_a = static_cast<std::ptrdiff_t>(a.size()) - 1, last_b = static_cast<std::ptrdiff_t>(b.size()) - 1;
    Weights result(a.size() + b.size() - 1, 0.0);
    for (std::ptrdiff_t i = -last_a; i <= last_a; ++i)
        for (std::ptrdiff_t j = std::max(-last_b, -i); j <= last_b; ++j)
            result[static_cast<std::size_t>(i + j)] +=
                a[static_cast<std::size_t>(std::abs(i))] * b[static_cast<std::size_t>(std::abs(j))];
    return result;
}

std::vector<float> in_single(Weights weights)
{
    while (weights.size() > 1 && std::abs(weights.back()) <= negligible)
        weights.pop_back();
    return {weights.begin(), weights.end()};
}

/// The sample that one beyond the ends of a line of `count` samples mirrors.
std::ptrdiff_t mirrored(std::ptrdiff_t i, std::ptrdiff_t count)
{
    if (count == 1)
        return 0;
    const std::ptrdiff_t period = 2 * (count - 1), folded = std::abs(i) % period;
    return std::min(folded, period - folded);
}

/// A line of bricks along an axis. Along x, one row of voxels is filtered at a time. Along y and z, eight rows are: the
/// rows of a slice of the bricks.
class LineOfBricks {
public:
    LineOfBricks(const BrickLayout& layout, int axis, std::size_t number)
        : layout_(layout), axis_(axis), count_(layout.bricks[axis]), voxels_(layout.shape[axis])
    {
        const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
        const auto width = static_cast<std::size_t>(layout.bricks[first]);
        begin_[first] = static_cast<int>(number % width);
        begin_[second] = static_cast<int>(number / width);
    }

    bool has_computed() const
    {
        for (int number = 0; number < count_; ++number)
            if (layout_.is_computed(brick(number)))
                return true;
        return false;
    }

    void filter(const std::vector<float>& weights, const BrickField& from, BrickField& to,
                std::vector<float>& items) const
    {
        constexpr std::size_t row = brick_size, slice = row * row;
        switch (axis_) {
        case 0:
            for (std::size_t i = 0; i < slice; ++i)
                filter_rows<1>(i * row, weights, from, to, items);
            break;
        case 1:
            for (std::size_t i = 0; i < row; ++i)
                filter_rows<row, row>(i * slice, weights, from, to, items);
            break;
        default:
            for (std::size_t i = 0; i < row; ++i)
                filter_rows<row, slice>(i * row, weights, from, to, items);
        }
    }

private:
    std::size_t brick(int number) const
    {
        glm::ivec3 at = begin_;
        at[axis_] = number;
        return layout_.index(at);
    }

    /// Filters a row of a brick and those that follow it in the line. There are `Width` numbers for each voxel of the
    /// line. A brick has `Width` rows of eight numbers, `Stride` apart.
    template <std::size_t Width, std::size_t Stride = 0>
    void filter_rows(std::size_t first, const std::vector<float>& weights, const BrickField& from, BrickField& to,
                     std::vector<float>& items) const
    {
        constexpr std::size_t of_brick = Width * brick_size;
        const std::size_t margin = (weights.size() - 1) * Width;
        // The last brick may extend beyond the line.
        items.resize(static_cast<std::size_t>(count_) * of_brick + 2 * margin + brick_size);
        float* const begin = items.data() + margin;
        for (int number = 0; number < count_; ++number) {
            float* const item = begin + static_cast<std::size_t>(number) * of_brick;
            if (const float* const numbers = from.find(brick(number)); numbers != nullptr)
                for (std::size_t i = 0; i < Width; ++i)
                    std::copy_n(numbers + first + i * Stride, brick_size, item + i * brick_size);
            else
                std::fill_n(item, of_brick, from.constants[brick(number)]);
        }
        const auto voxels = static_cast<std::ptrdiff_t>(voxels_), width = static_cast<std::ptrdiff_t>(Width);
        for (auto i = static_cast<std::ptrdiff_t>(weights.size()) - 1; i > 0; --i)
            for (const std::ptrdiff_t at : {-i, voxels - 1 + i})
                std::copy_n(begin + mirrored(at, voxels) * width, Width, begin + at * width);
        for (int number = 0; number < count_; ++number) {
            const std::uint32_t place = layout_.place[brick(number)];
            if (place == BrickLayout::none || layout_.computed[place] == 0)
                continue;
            float filtered[of_brick];
            HWY_DYNAMIC_DISPATCH(Convolve)
            (begin + static_cast<std::size_t>(number) * of_brick, Width, Width, weights, filtered);
            for (std::size_t i = 0; i < Width; ++i)
                std::copy_n(filtered + i * brick_size, brick_size, to.numbers(place) + first + i * Stride);
        }
    }

    const BrickLayout& layout_;
    int axis_;
    int count_;           ///< of bricks
    int voxels_;          ///< along the line
    glm::ivec3 begin_{0}; ///< the first brick
};

/// Gives a field the numbers of another one that no filter changes.
void copy_constants(const BrickField& from, BrickField& to)
{
    to.constants = from.constants;
    for (std::size_t number = 0; number < from.layout->stored.size(); ++number)
        if (from.layout->computed[number] == 0)
            std::copy_n(from.numbers(number), numbers_of_brick, to.numbers(number));
}

/// Filters the lines of bricks along an axis from number `begin` to `end`.
void filter_lines(int axis, std::size_t begin, std::size_t end, const SeparableFilter& filter, const BrickField& from,
                  BrickField& to, std::vector<float>& items)
{
    for (std::size_t number = begin; number < end; ++number)
        if (const LineOfBricks line(*from.layout, axis, number); line.has_computed())
            line.filter(filter[static_cast<std::size_t>(axis)], from, to, items);
}

} // namespace

SeparableFilter gaussian_filter(const glm::dvec3& deviations)
{
    SeparableFilter filter;
    for (int axis = 0; axis < 3; ++axis)
        filter[static_cast<std::size_t>(axis)] = in_single(gaussian_weights(deviations[axis]));
    return filter;
}

SeparableFilter low_pass_filter(const glm::dvec3& deviations)
{
    SeparableFilter filter;
    for (int axis = 0; axis < 3; ++axis) {
        // 1 - (1 - G)^3 = 3 G - 3 G^2 + G^3.
        const Weights once = gaussian_weights(deviations[axis]), twice = convolved(once, once);
        Weights weights = convolved(twice, once);
        for (std::size_t i = 0; i < weights.size(); ++i)
            weights[i] += 3.0 * (i < once.size() ? once[i] : 0.0) - 3.0 * (i < twice.size() ? twice[i] : 0.0);
        filter[static_cast<std::size_t>(axis)] = in_single(std::move(weights));
    }
    return filter;
}

SeparableFilter interpolation_filter()
{
    // The inverse of (z + 6 + 1 / z) / 8.
    const double pole = std::sqrt(8.0) - 3.0;
    Weights weights{-8.0 * pole / (1.0 - pole * pole)};
    while (std::abs(weights.back()) > negligible)
        weights.push_back(weights.back() * pole);
    return {in_single(weights), in_single(weights), in_single(weights)};
}

void apply(const SeparableFilter& filter, const BrickField& from, BrickField& to, BrickField& between,
           const Progress& progress)
{
    copy_constants(from, to);
    copy_constants(from, between);
    // Along x and y, layer after layer, which stay in the processor's cache.
    const glm::uvec3 bricks(from.layout->bricks);
    parallel_for(
        bricks.z, 1,
        [&](std::size_t begin, std::size_t end) {
            std::vector<float> items;
            for (std::size_t layer = begin; layer < end; ++layer) {
                filter_lines(0, layer * bricks.y, (layer + 1) * bricks.y, filter, from, to, items);
                filter_lines(1, layer * bricks.x, (layer + 1) * bricks.x, filter, to, between, items);
            }
        },
        progress);
    parallel_for(
        std::size_t{bricks.x} * bricks.y, 4,
        [&](std::size_t begin, std::size_t end) {
            std::vector<float> items;
            filter_lines(2, begin, end, filter, between, to, items);
        },
        progress);
}

} // namespace isospline
#endif
