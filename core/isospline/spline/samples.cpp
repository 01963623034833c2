#include "isospline/spline/samples.h"

#include "isospline/util/parallel.h"

#include <half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <sstream>
#include <type_traits>

namespace isospline {

namespace {

float to_number(half sample)
{
    return sample;
}

template <typename Sample>
Sample to_number(Sample sample)
{
    return sample;
}

template <typename Sample>
using Number = decltype(to_number(Sample{}));

/// The type in which the offset is subtracted: float32 if it holds every sample exactly.
template <typename Sample>
using Difference =
    std::conditional_t<(std::is_integral_v<Sample> && sizeof(Sample) > 2) || sizeof(Sample) == 8, double, float>;

template <typename Function>
decltype(auto) with_sample_type(SampleType type, Function function)
{
    switch (type) {
    case SampleType::uint8:
        return function(std::uint8_t{});
    case SampleType::int8:
        return function(std::int8_t{});
    case SampleType::uint16:
        return function(std::uint16_t{});
    case SampleType::int16:
        return function(std::int16_t{});
    case SampleType::uint32:
        return function(std::uint32_t{});
    case SampleType::int32:
        return function(std::int32_t{});
    case SampleType::uint64:
        return function(std::uint64_t{});
    case SampleType::int64:
        return function(std::int64_t{});
    case SampleType::float16:
        return function(half{});
    case SampleType::float32:
        return function(float{});
    case SampleType::float64:
        break;
    }
    return function(double{});
}

template <typename Sample>
Sample load(const std::byte* address, bool byte_swapped)
{
    std::array<std::byte, sizeof(Sample)> bytes;
    std::memcpy(bytes.data(), address, sizeof(Sample));
    if (byte_swapped)
        std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<Sample>(bytes);
}

constexpr int chunk_size = 64;

/// Calls `function(pointer, count)` for the samples along one line, in chunks of at most chunk_size. Samples that are
/// not contiguous, aligned and in this machine's byte order are copied to a small buffer first.
template <typename Sample, typename Function>
void for_each_chunk(const std::byte* line, int count, std::ptrdiff_t stride, bool byte_swapped, Function function)
{
    const bool direct = stride == sizeof(Sample) && (!byte_swapped || sizeof(Sample) == 1) &&
                        std::bit_cast<std::uintptr_t>(line) % alignof(Sample) == 0;
    std::array<Sample, chunk_size> buffer;
    for (int begin = 0; begin < count; begin += chunk_size) {
        const int size = std::min(chunk_size, count - begin);
        const std::byte* const address = line + begin * stride;
        if (direct) {
            function(reinterpret_cast<const Sample*>(address), size);
            continue;
        }
        for (int i = 0; i < size; ++i)
            buffer[static_cast<std::size_t>(i)] = load<Sample>(address + i * stride, byte_swapped);
        function(buffer.data(), size);
    }
}

/// Smallest and largest of many numbers: one pair a lane, so that compilers vectorise the loop over a full chunk.
template <typename Sample>
struct RangeLanes {
    Number<Sample> lower[chunk_size];
    Number<Sample> upper[chunk_size];
    Number<Sample> not_finite[chunk_size] = {}; ///< become NaN

    RangeLanes()
    {
        std::fill(std::begin(lower), std::end(lower), std::numeric_limits<Number<Sample>>::max());
        std::fill(std::begin(upper), std::end(upper), std::numeric_limits<Number<Sample>>::lowest());
    }

    void include(const Sample* samples, int count)
    {
        if (count == chunk_size)
            include_lanes<chunk_size>(samples, chunk_size);
        else
            include_lanes<0>(samples, count);
    }

private:
    template <int FixedCount>
    void include_lanes(const Sample* samples, int variable_count)
    {
        const int count = FixedCount > 0 ? FixedCount : variable_count;
        for (int i = 0; i < count; ++i) {
            const auto number = to_number(samples[i]);
            lower[i] = number < lower[i] ? number : lower[i];
            upper[i] = number > upper[i] ? number : upper[i];
        }
        if constexpr (!std::is_integral_v<Number<Sample>>)
            for (int i = 0; i < count; ++i)
                not_finite[i] += to_number(samples[i]) * 0;
    }
};

const std::byte* address_of(const SampleView& samples, const glm::ivec3& index)
{
    return static_cast<const std::byte*>(samples.data) + index.x * samples.strides[0] + index.y * samples.strides[1] +
           index.z * samples.strides[2];
}

template <typename Sample>
NonFiniteSample first_non_finite(const SampleView& samples)
{
    glm::ivec3 index;
    for (index.z = 0; index.z < samples.shape.z; ++index.z)
        for (index.y = 0; index.y < samples.shape.y; ++index.y)
            for (index.x = 0; index.x < samples.shape.x; ++index.x) {
                const auto sample = load<Sample>(address_of(samples, index), samples.byte_swapped);
                const auto value = static_cast<double>(to_number(sample));
                if (!std::isfinite(value))
                    return NonFiniteSample(index, value);
            }
    return NonFiniteSample(index, std::numeric_limits<double>::quiet_NaN());
}

template <typename Sample>
SampleRange range_of(const SampleView& samples, const Progress& progress)
{
    // Lines follow the axis with the smallest stride, slabs are across the axis with the largest one.
    std::array<int, 3> axes{0, 1, 2};
    std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) {
        return std::abs(samples.strides[static_cast<std::size_t>(a)]) <
               std::abs(samples.strides[static_cast<std::size_t>(b)]);
    });
    const auto line_stride = samples.strides[static_cast<std::size_t>(axes[0])];

    SampleRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    bool finite = true;
    std::mutex merging;
    const auto body = [&](std::size_t begin, std::size_t end) {
        RangeLanes<Sample> lanes;
        for (auto slab = static_cast<int>(begin); slab < static_cast<int>(end); ++slab)
            for (int row = 0; row < samples.shape[axes[1]]; ++row) {
                glm::ivec3 index{0};
                index[axes[1]] = row;
                index[axes[2]] = slab;
                for_each_chunk<Sample>(address_of(samples, index), samples.shape[axes[0]], line_stride,
                                       samples.byte_swapped,
                                       [&](const Sample* chunk, int count) { lanes.include(chunk, count); });
            }
        const std::lock_guard lock(merging);
        const auto lower = *std::min_element(std::begin(lanes.lower), std::end(lanes.lower));
        const auto upper = *std::max_element(std::begin(lanes.upper), std::end(lanes.upper));
        range.minimum = std::min(range.minimum, static_cast<double>(lower));
        range.maximum = std::max(range.maximum, static_cast<double>(upper));
        for (const auto lane : lanes.not_finite)
            finite = finite && lane == 0;
    };
    parallel_for(static_cast<std::size_t>(samples.shape[axes[2]]), 1, body, progress);
    if (!finite)
        throw first_non_finite<Sample>(samples);
    return range;
}

} // namespace

NonFiniteSample::NonFiniteSample(const glm::ivec3& at, double found)
    : std::invalid_argument([&] {
          std::ostringstream message;
          message << "data: expected finite numbers, got " << found << " at index (x, y, z) = (" << at.x << ", " << at.y
                  << ", " << at.z << ")";
          return message.str();
      }()),
      index(at), value(found)
{
}

SampleRange sample_range(const SampleView& samples, const Progress& progress)
{
    return with_sample_type(samples.type, [&]<typename Sample>(Sample) { return range_of<Sample>(samples, progress); });
}

void read_row(const SampleView& samples, const glm::ivec3& first, int count, double offset, double scale, float* row)
{
    with_sample_type(samples.type, [&]<typename Sample>(Sample) {
        using Real = Difference<Sample>;
        const auto subtrahend = static_cast<Real>(offset);
        const auto factor = static_cast<Real>(scale);
        for_each_chunk<Sample>(address_of(samples, first), count, samples.strides[0], samples.byte_swapped,
                               [&](const Sample* chunk, int size) {
                                   for (int i = 0; i < size; ++i)
                                       row[i] = static_cast<float>(
                                           (static_cast<Real>(to_number(chunk[i])) - subtrahend) * factor);
                                   row += size;
                               });
    });
}

} // namespace isospline
