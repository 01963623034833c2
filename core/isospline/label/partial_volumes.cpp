#include "isospline/label/partial_volumes.h"

#include "isospline/util/parallel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isospline/label/partial_volumes.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#ifndef ISOSPLINE_LABEL_PARTIAL_VOLUMES_BOXES
#define ISOSPLINE_LABEL_PARTIAL_VOLUMES_BOXES
namespace isospline {

namespace {

/// The rows of coefficients around a brick, and the numbers from one to the next.
constexpr std::size_t rows_around = brick_size + 2, row_of_around = 16;
using CoefficientsAround = std::array<float, rows_around * rows_around * row_of_around>;

/// Voxels of a brick in rows of eight: bit x of row y + 8 z.
using VoxelBits = std::array<std::uint8_t, std::size_t{brick_size} * brick_size>;

/// Gradients below this one, in values per voxel, count as this one.
constexpr float least_gradient = 1e-3f;

/// The weights of three coefficients along an axis for the boxes of a voxel: of the mean value in a box, and of the
/// difference between its ends.
struct BoxWeights {
    std::array<float, 3> mean, difference;
};

} // namespace

} // namespace isospline
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Voxels = hn::CappedTag<float, brick_size>;
using V = hn::Vec<Voxels>;

HWY_INLINE V weighted(const std::array<float, 3>& weights, V a, V b, V c)
{
    const Voxels d;
    return hn::MulAdd(hn::Set(d, weights[0]), a,
                      hn::MulAdd(hn::Set(d, weights[1]), b, hn::Mul(hn::Set(d, weights[2]), c)));
}

// The parts of the voxels with these coefficients, and their derivatives.
HWY_INLINE void sum_boxes(const V (&coefficients)[3][3][3], const BoxWeights* HWY_RESTRICT boxes, std::size_t divisions,
                          V& part, V& derivative)
{
    const Voxels d;
    part = derivative = hn::Zero(d);
    for (std::size_t x = 0; x < divisions; ++x) {
        V mean_x[3][3], slope_x[3][3];
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j) {
                const V(&row)[3] = coefficients[k][j];
                mean_x[k][j] = weighted(boxes[x].mean, row[0], row[1], row[2]);
                slope_x[k][j] = weighted(boxes[x].difference, row[0], row[1], row[2]);
            }
        for (std::size_t y = 0; y < divisions; ++y) {
            V mean[3], along_x[3], along_y[3];
            for (int k = 0; k < 3; ++k) {
                mean[k] = weighted(boxes[y].mean, mean_x[k][0], mean_x[k][1], mean_x[k][2]);
                along_x[k] = weighted(boxes[y].mean, slope_x[k][0], slope_x[k][1], slope_x[k][2]);
                along_y[k] = weighted(boxes[y].difference, mean_x[k][0], mean_x[k][1], mean_x[k][2]);
            }
            for (std::size_t z = 0; z < divisions; ++z) {
                const auto along_z = [&](const std::array<float, 3>& weights, const V(&of_slices)[3]) HWY_ATTR {
                    return weighted(weights, of_slices[0], of_slices[1], of_slices[2]);
                };
                const V value = along_z(boxes[z].mean, mean);
                const V slope =
                    hn::Add(hn::Add(hn::Abs(along_z(boxes[z].mean, along_x)), hn::Abs(along_z(boxes[z].mean, along_y))),
                            hn::Abs(along_z(boxes[z].difference, mean)));
                const V inverse = hn::Div(hn::Set(d, 1.0f), hn::Max(slope, hn::Set(d, least_gradient)));
                const V position = hn::MulAdd(value, inverse, hn::Set(d, 0.5f));
                const V clamped = hn::Min(hn::Max(position, hn::Zero(d)), hn::Set(d, 1.0f));
                part = hn::Add(part, clamped);
                derivative = hn::Add(derivative, hn::IfThenElseZero(hn::Eq(position, clamped), inverse));
            }
        }
    }
    const V share = hn::Set(d, 1.0f / static_cast<float>(divisions * divisions * divisions));
    part = hn::Mul(part, share);
    derivative = hn::Mul(derivative, share);
}

void FindParts(const CoefficientsAround& around, const std::vector<BoxWeights>& boxes, float* HWY_RESTRICT parts,
               float* HWY_RESTRICT derivatives, VoxelBits& crossed)
{
    const Voxels d;
    for (std::size_t row = 0; row < crossed.size(); ++row) {
        crossed[row] = 0;
        const std::size_t y = row % brick_size, z = row / brick_size;
        for (std::size_t x = 0; x < brick_size; x += hn::Lanes(d)) {
            V coefficients[3][3][3];
            V least = hn::Set(d, 1e38f), most = hn::Set(d, -1e38f);
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t j = 0; j < 3; ++j)
                    for (std::size_t i = 0; i < 3; ++i) {
                        const std::size_t place = ((z + k) * rows_around + y + j) * row_of_around + x + i;
                        coefficients[k][j][i] = hn::LoadU(d, around.data() + place);
                        least = hn::Min(least, coefficients[k][j][i]);
                        most = hn::Max(most, coefficients[k][j][i]);
                    }
            const auto is_crossed = hn::And(hn::Lt(least, hn::Zero(d)), hn::Gt(most, hn::Zero(d)));
            V part = hn::IfThenElseZero(hn::Ge(least, hn::Zero(d)), hn::Set(d, 1.0f)), derivative = hn::Zero(d);
            if (!hn::AllFalse(d, is_crossed)) {
                V found, slope;
                sum_boxes(coefficients, boxes.data(), boxes.size(), found, slope);
                part = hn::IfThenElse(is_crossed, found, part);
                derivative = hn::IfThenElseZero(is_crossed, slope);
                std::uint8_t bits[8] = {};
                hn::StoreMaskBits(d, is_crossed, bits);
                crossed[row] |= static_cast<std::uint8_t>(bits[0] << x);
            }
            hn::StoreU(part, d, parts + row * brick_size + x);
            hn::StoreU(derivative, d, derivatives + row * brick_size + x);
        }
    }
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace isospline {

HWY_EXPORT(FindParts);

namespace {

std::vector<BoxWeights> weights_of_boxes(int divisions)
{
    // The three B-splines of degree 2 at an offset from a voxel's centre, and their integrals from 0.
    const auto basis = [](double t) {
        return std::array<double, 3>{0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
    };
    const auto integral = [](double t) {
        const double before = 0.5 - t, after = 0.5 + t;
        return std::array<double, 3>{-before * before * before / 6.0, 0.75 * t - t * t * t / 3.0,
                                     after * after * after / 6.0};
    };
    std::vector<BoxWeights> boxes(static_cast<std::size_t>(divisions));
    for (std::size_t box = 0; box < boxes.size(); ++box) {
        const double low = static_cast<double>(box) / divisions - 0.5,
                     high = static_cast<double>(box + 1) / divisions - 0.5;
        for (std::size_t i = 0; i < 3; ++i) {
            boxes[box].mean[i] = static_cast<float>((integral(high)[i] - integral(low)[i]) * divisions);
            boxes[box].difference[i] = static_cast<float>(basis(high)[i] - basis(low)[i]);
        }
    }
    return boxes;
}

/// The coefficients of a brick's voxels and their neighbours, mirrored at the ends of the volume.
void read_around(const BrickField& coefficients, const Brick& brick, CoefficientsAround& around)
{
    const BrickLayout& layout = *coefficients.layout;
    struct Place {
        int brick;
        std::size_t in_brick;
    };
    std::array<std::array<Place, rows_around>, 3> places{};
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < rows_around; ++i) {
            const int last = layout.shape[axis] - 1, at = brick.first[axis] + static_cast<int>(i) - 1;
            const int mirrored = std::clamp(at < 0 ? -at : at > last ? 2 * last - at : at, 0, last);
            places[static_cast<std::size_t>(axis)][i] = {mirrored / brick_size,
                                                         static_cast<std::size_t>(mirrored % brick_size)};
        }
    for (std::size_t k = 0; k < rows_around; ++k)
        for (std::size_t j = 0; j < rows_around; ++j) {
            const Place &y = places[1][j], &z = places[2][k];
            float* const row = around.data() + (k * rows_around + j) * row_of_around;
            const auto copy = [&](std::size_t i, std::size_t count) {
                const Place& x = places[0][i];
                const std::size_t index = layout.index({x.brick, y.brick, z.brick});
                if (const float* const numbers = coefficients.find(index); numbers != nullptr)
                    std::copy_n(numbers + x.in_brick + brick_size * (y.in_brick + brick_size * z.in_brick), count,
                                row + i);
                else
                    std::fill_n(row + i, count, coefficients.constants[index]);
            };
            if (brick.size.x == brick_size) {
                copy(0, 1);
                copy(1, brick_size);
                copy(rows_around - 1, 1);
            } else {
                for (std::size_t i = 0; i < rows_around; ++i)
                    copy(i, 1);
            }
        }
}

} // namespace

PartialVolume find_partial_volumes(const BrickField& coefficients, int divisions, BrickField& parts,
                                   BrickField& derivatives, const Progress& progress)
{
    const BrickLayout& layout = *coefficients.layout;
    const std::vector<BoxWeights> boxes = weights_of_boxes(divisions);
    std::vector<PartialVolume> of_bricks(layout.stored.size());
    parallel_for(
        layout.stored.size(), 16,
        [&](std::size_t begin, std::size_t end) {
            CoefficientsAround around{};
            VoxelBits crossed;
            for (std::size_t number = begin; number < end; ++number) {
                if (layout.computed[number] == 0)
                    continue;
                const Brick brick = layout.brick(number);
                read_around(coefficients, brick, around);
                float* const of_brick = parts.numbers(number);
                HWY_DYNAMIC_DISPATCH(FindParts)(around, boxes, of_brick, derivatives.numbers(number), crossed);
                const unsigned in_row = (1u << brick.size.x) - 1u;
                for (int z = 0; z < brick.size.z; ++z)
                    for (int y = 0; y < brick.size.y; ++y) {
                        const auto row = static_cast<std::size_t>(y + brick_size * z);
                        of_bricks[number].crossed += static_cast<std::size_t>(std::popcount(crossed[row] & in_row));
                        for (int x = 0; x < brick.size.x; ++x)
                            of_bricks[number].voxels +=
                                static_cast<double>(of_brick[row * brick_size + static_cast<std::size_t>(x)]);
                    }
            }
        },
        progress);
    PartialVolume sum;
    for (const PartialVolume& each : of_bricks) {
        sum.voxels += each.voxels;
        sum.crossed += each.crossed;
    }
    for (std::size_t brick = 0; brick < layout.place.size(); ++brick) {
        parts.constants[brick] = coefficients.constants[brick] > 0.0f ? 1.0f : 0.0f;
        if (layout.place[brick] == BrickLayout::none && coefficients.constants[brick] > 0.0f)
            sum.voxels += static_cast<double>(place_count(brick_at(layout.shape, at_place(layout.bricks, brick)).size));
    }
    return sum;
}

} // namespace isospline
#endif
