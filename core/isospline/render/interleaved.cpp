#include "isospline/render/interleaved.h"

#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>

namespace isospline {

namespace {

/// Of one smooth surface: the smallest cosine of the angle between normals, and the largest slope from point to point.
constexpr float least_cosine = 0.8f, largest_slope = 0.4f;
/// Light below this tells nothing of shadows.
constexpr float least_light = 1e-6f;
/// The square roots of brightness, which are about what is seen, differ by more than this in uneven pixels.
constexpr float least_contrast = 0.04f;
/// Parts of a light that differ by less than the first from one side of a coarse block to the other change slowly, and
/// by more than the second, fast.
constexpr float slow_change = 0.15f, fast_change = 0.3f;
/// The same for a ground, of which the darkest shadows take away about half of the light.
constexpr float slow_on_plane = 0.03f, fast_on_plane = 0.06f;
/// Rows that a thread takes at once.
constexpr std::size_t row_count = 8;

constexpr std::array<glm::ivec2, 4> four_sides{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

/// A picture's pixels and their numbers, row by row.
class Pixels {
public:
    explicit Pixels(const glm::ivec2& size, const glm::ivec2& first = glm::ivec2(0)) : size_(size), first_(first) {}

    std::size_t count() const { return static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y); }
    bool contains(const glm::ivec2& pixel) const
    {
        return pixel.x >= 0 && pixel.y >= 0 && pixel.x < size_.x && pixel.y < size_.y;
    }
    std::size_t number(const glm::ivec2& pixel) const { return Window{glm::ivec2(0), size_}.number(pixel); }

    /// Calls `visit(pixel, its number)` for all pixels, in parallel.
    template <typename Visit>
    void visit(const Progress& progress, const Visit& visit_pixel) const
    {
        parallel_for(
            static_cast<std::size_t>(size_.y), row_count,
            [&](std::size_t begin, std::size_t end) {
                for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
                    for (int x = 0; x < size_.x; ++x)
                        visit_pixel(glm::ivec2(x, y), number({x, y}));
            },
            progress);
    }

    /// Calls `visit(neighbour, weight)` for the pixels of the block around a pixel, row by row: those whose columns and
    /// rows in the whole picture are multiples of the step. They are numbers in the picture; there is nothing outside.
    template <typename Visit>
    void visit_block(const glm::ivec2& pixel, int step, const Visit& visit_pixel) const
    {
        const int reach = fine_reach * step;
        const auto weight = [reach](int offset) { return std::abs(offset) == reach ? 0.125f : 0.25f; };
        const glm::ivec2 least = glm::max(pixel - reach, 0), most = glm::min(pixel + reach, size_ - 1);
        const glm::ivec2 begin = least + (step - (first_ + least) % step) % step;
        for (int y = begin.y; y <= most.y; y += step)
            for (int x = begin.x; x <= most.x; x += step)
                visit_pixel(number({x, y}), weight(x - pixel.x) * weight(y - pixel.y));
    }

private:
    glm::ivec2 size_, first_;
};

Pixels pixels_of(const Image& image)
{
    return Pixels(image.size, image.first);
}

/// A sum with weights.
struct Mean {
    void add(float number, float weight)
    {
        sum += weight * number;
        total += weight;
    }
    void add(const Mean& other)
    {
        sum += other.sum;
        total += other.total;
    }
    float or_else(float other) const { return total > 0.0f ? sum / total : other; }

    float sum = 0.0f, total = 0.0f;
};

/// The part of a light that arrives at the pixels of a picture, and its weight in means, 0 where it is not known.
struct LightOfPixels {
    std::vector<float> part, weight;
};

/// The part of all channels, or of one. Channels have the weight of their light: the rays of a pixel that begin at
/// random surfaces tell much of a channel that is bright in others.
LightOfPixels light_of_pixels(const PicturesOfLight& pictures, std::optional<int> channel)
{
    const auto light = [channel](const glm::vec4& color) {
        return channel ? color[*channel] : color.r + color.g + color.b;
    };
    const std::size_t count = pictures.lit->color.size();
    LightOfPixels result{std::vector<float>(count), std::vector<float>(count)};
    for (std::size_t i = 0; i < count; ++i) {
        const float unhidden = light(pictures.unhidden->color[i]);
        if (!(unhidden > least_light) || pictures.lit->color[i].a == 0.0f)
            continue;
        result.part[i] = light(pictures.lit->color[i]) / unhidden;
        result.weight[i] = channel ? unhidden : 1.0f;
    }
    return result;
}

/// Whether two pixels show the same smooth surface.
bool are_alike(const Image& guides, std::size_t here, std::size_t there)
{
    const glm::vec3 apart = guides.position[there] - guides.position[here];
    const float height = glm::dot(apart, guides.normal[here]);
    return guides.geometry_ids[here] == guides.geometry_ids[there] &&
           glm::dot(guides.normal[here], guides.normal[there]) >= least_cosine &&
           height * height <= largest_slope * largest_slope * glm::dot(apart, apart);
}

/// From 0 for changes up to `slow` to 1 for those from `fast` on.
float rising(float change, float slow, float fast)
{
    return glm::clamp((change - slow) / (fast - slow), 0.0f, 1.0f);
}

} // namespace

PixelMask edges(const Image& guides, const Progress& progress)
{
    const Pixels pixels = pixels_of(guides);
    PixelMask result(pixels.count());
    pixels.visit(progress, [&](const glm::ivec2& pixel, std::size_t here) {
        result[here] = guides.geometry_ids[here] == invalid_id;
        for (const glm::ivec2& side : four_sides)
            if (!result[here] && pixels.contains(pixel + side)) {
                const std::size_t there = pixels.number(pixel + side);
                result[here] = guides.geometry_ids[there] != invalid_id && !are_alike(guides, here, there);
            }
    });
    return result;
}

PixelMask uneven_pixels(std::span<const PictureInSum> sum, const Image& guides, const PixelMask& edges,
                        const Progress& progress)
{
    const Pixels pixels = pixels_of(guides);
    std::vector<glm::vec4> shown(pixels.count());
    pixels.visit(part_of(progress, 0.0, 0.5), [&](const glm::ivec2&, std::size_t here) {
        glm::vec4 color(0.0f);
        for (const PictureInSum& each : sum)
            color += each.weight * each.picture->color[here];
        color.a = sum.front().picture->color[here].a;
        shown[here] = glm::sqrt(glm::max(color, 0.0f));
    });
    PixelMask result(pixels.count());
    pixels.visit(part_of(progress, 0.5, 1.0), [&](const glm::ivec2& pixel, std::size_t here) {
        bool is_uneven = edges[here] && guides.geometry_ids[here] != invalid_id;
        for (int down = -1; down <= 1; ++down)
            for (int right = -1; right <= 1; ++right)
                if (const glm::ivec2 neighbour = pixel + glm::ivec2(right, down); pixels.contains(neighbour)) {
                    const glm::vec4 apart = glm::abs(shown[pixels.number(neighbour)] - shown[here]);
                    is_uneven |= std::max({apart.r, apart.g, apart.b, apart.a}) > least_contrast;
                }
        result[here] = is_uneven;
    });
    return result;
}

LightParts seen_parts(const std::array<PicturesOfLight, light_count>& lights, PartsOfLight kind, const Image& guides,
                      const PixelMask& edges, const PixelMask& mask, int step, const Progress& progress)
{
    constexpr int most_channels = 3;
    const Pixels pixels = pixels_of(guides);
    std::vector<LightOfPixels> given;
    for (const PicturesOfLight& pictures : lights)
        if (kind == PartsOfLight::one)
            given.push_back(light_of_pixels(pictures, std::nullopt));
        else
            for (int channel = 0; channel < most_channels; ++channel)
                given.push_back(light_of_pixels(pictures, channel));
    const std::size_t channel_count = given.size() / light_count;
    LightParts results(given.size(), std::vector<float>(pixels.count()));
    pixels.visit(progress, [&](const glm::ivec2& pixel, std::size_t here) {
        if (!mask[here])
            return;
        std::array<Mean, light_count * most_channels> means;
        // Nothing is asked of surfaces that are too translucent to be seen.
        bool is_known = lights[0].unhidden->color[here].a == 0.0f;
        pixels.visit_block(pixel, step, [&](std::size_t there, float weight) {
            if (edges[here] ? edges[there] == 0 : !are_alike(guides, here, there))
                return;
            for (std::size_t i = 0; i < given.size(); ++i)
                means[i].add(given[i].part[there], weight * given[i].weight[there]);
            is_known |= lights[0].lit->color[there].a > 0.0f;
        });
        const float without_light = edges[here] ? 0.0f : is_known ? 1.0f : std::numeric_limits<float>::quiet_NaN();
        for (std::size_t first = 0; first < given.size(); first += channel_count) {
            Mean of_all_channels;
            for (std::size_t i = first; i < first + channel_count; ++i)
                of_all_channels.add(means[i]);
            for (std::size_t i = first; i < first + channel_count; ++i)
                results[i][here] = means[i].or_else(of_all_channels.or_else(without_light));
        }
    });
    return results;
}

std::vector<float> changes(const LightParts& parts, const Image& guides, const PixelMask& edges,
                           const Progress& progress)
{
    const Pixels pixels = pixels_of(guides);
    std::vector<float> result(pixels.count());
    pixels.visit(progress, [&](const glm::ivec2& pixel, std::size_t here) {
        if (edges[here])
            return;
        float most = 0.0f;
        for (const glm::ivec2& side : four_sides) {
            const glm::ivec2 neighbour = pixel + coarse_reach * side;
            if (!pixels.contains(neighbour))
                continue;
            const std::size_t there = pixels.number(neighbour);
            if (!edges[there] && are_alike(guides, here, there))
                for (const std::vector<float>& part : parts)
                    most = std::max(most, std::abs(part[there] - part[here]));
        }
        result[here] = std::isnan(parts[0][here]) ? 1.0f : rising(most, slow_change, fast_change);
    });
    return result;
}

std::vector<float> mean_on_plane(const glm::ivec2& size, const glm::ivec2& first, std::span<const float> numbers,
                                 std::span<const float> weights, int step, const Progress& progress)
{
    const Pixels pixels(size, first);
    std::vector<float> means(pixels.count());
    pixels.visit(progress, [&](const glm::ivec2& pixel, std::size_t here) {
        Mean mean;
        pixels.visit_block(pixel, step,
                           [&](std::size_t there, float weight) { mean.add(numbers[there], weight * weights[there]); });
        means[here] = mean.or_else(0.0f);
    });
    return means;
}

std::vector<float> changes_on_plane(const glm::ivec2& size, std::span<const float> means, const Progress& progress)
{
    const Pixels pixels(size);
    std::vector<float> result(pixels.count());
    pixels.visit(progress, [&](const glm::ivec2& pixel, std::size_t here) {
        float most = 0.0f;
        for (const glm::ivec2& side : four_sides)
            if (const glm::ivec2 neighbour = pixel + coarse_reach * side; pixels.contains(neighbour))
                most = std::max(most, std::abs(means[pixels.number(neighbour)] - means[here]));
        result[here] = rising(most, slow_on_plane, fast_on_plane);
    });
    return result;
}

PixelMask widened(const glm::ivec2& size, const PixelMask& mask, int reach, const Progress& progress)
{
    const Pixels pixels(size);
    PixelMask in_rows(pixels.count()), result(pixels.count());
    const auto widen = [&](const PixelMask& from, PixelMask& to, const glm::ivec2& direction, double begin) {
        pixels.visit(part_of(progress, begin, begin + 0.5), [&](const glm::ivec2& pixel, std::size_t here) {
            for (int offset = -reach; offset <= reach && !to[here]; ++offset)
                if (const glm::ivec2 neighbour = pixel + offset * direction; pixels.contains(neighbour))
                    to[here] = from[pixels.number(neighbour)];
        });
    };
    widen(mask, in_rows, {1, 0}, 0.0);
    widen(in_rows, result, {0, 1}, 0.5);
    return result;
}

} // namespace isospline
