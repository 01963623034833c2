#include "isospline/render/interleaved.h"

#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace isospline {

namespace {

/// Of one smooth surface: the smallest cosine of the angle between normals, and the largest slope from point to point.
constexpr float least_cosine = 0.8f, largest_slope = 0.4f;
/// Light below this tells nothing of shadows.
constexpr float least_light = 1e-6f;
/// Rows that a thread takes at once.
constexpr std::size_t row_count = 8;

/// Calls `visit(neighbour, weight, is_beside)` for the pixels of the block around a pixel, row by row. They are numbers
/// in the picture; there is nothing outside of it.
template <typename Visit>
void visit_block(const glm::ivec2& size, const glm::ivec2& pixel, const Visit& visit)
{
    constexpr std::array<float, 2 * block_reach + 1> weights{0.125f, 0.25f, 0.25f, 0.25f, 0.125f};
    for (int down = std::max(-block_reach, -pixel.y); down <= std::min(block_reach, size.y - 1 - pixel.y); ++down)
        for (int right = std::max(-block_reach, -pixel.x); right <= std::min(block_reach, size.x - 1 - pixel.x);
             ++right)
            visit(static_cast<std::size_t>(pixel.y + down) * static_cast<std::size_t>(size.x) +
                      static_cast<std::size_t>(pixel.x + right),
                  weights[static_cast<std::size_t>(down + block_reach)] *
                      weights[static_cast<std::size_t>(right + block_reach)],
                  std::abs(down) + std::abs(right) == 1);
}

/// Calls `visit(pixel, its number)` for all pixels, in parallel.
template <typename Visit>
void visit_pixels(const glm::ivec2& size, const Progress& progress, const Visit& visit)
{
    parallel_for(
        static_cast<std::size_t>(size.y), row_count,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t y = begin; y < end; ++y)
                for (int x = 0; x < size.x; ++x)
                    visit(glm::ivec2(x, y), y * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(x));
        },
        progress);
}

struct Neighbour {
    std::size_t pixel;
    float weight;
};
constexpr std::size_t block_size = (2 * block_reach + 1) * (2 * block_reach + 1);

/// A sum with weights.
struct Mean {
    void add(float number, float weight)
    {
        sum += weight * number;
        total += weight;
    }
    float or_else(float other) const { return total > 0.0f ? sum / total : other; }

    float sum = 0.0f, total = 0.0f;
};

/// The part of a light that arrives at the pixels of a picture, and whether it is known: 1 or 0.
struct LightOfPixels {
    std::vector<float> part, known;
};

LightOfPixels light_of_pixels(const PicturesOfLight& pictures)
{
    const auto light = [](const glm::vec4& color) { return color.r + color.g + color.b; };
    const std::size_t count = pictures.lit->color.size();
    LightOfPixels result{std::vector<float>(count), std::vector<float>(count)};
    for (std::size_t i = 0; i < count; ++i) {
        const float unhidden = light(pictures.unhidden->color[i]);
        if (!(unhidden > least_light))
            continue;
        result.part[i] = light(pictures.lit->color[i]) / unhidden;
        result.known[i] = 1.0f;
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

} // namespace

std::vector<std::vector<float>> seen_parts(std::span<const PicturesOfLight> lights, const Image& guides,
                                           const Progress& progress)
{
    std::vector<LightOfPixels> given;
    std::vector<std::vector<float>> results;
    for (const PicturesOfLight& pictures : lights) {
        given.push_back(light_of_pixels(pictures));
        results.emplace_back(guides.pixel_count());
    }
    // The centre of a pixel with a part of a surface may miss it: such pixels are edges, too.
    std::vector<std::uint8_t> is_edge(guides.pixel_count());
    visit_pixels(guides.size, part_of(progress, 0.0, 0.5), [&](const glm::ivec2& pixel, std::size_t here) {
        bool beside_another = guides.geometry_ids[here] == invalid_id;
        std::array<Neighbour, block_size> alike;
        std::size_t count = 0;
        if (!beside_another)
            visit_block(guides.size, pixel, [&](std::size_t there, float weight, bool is_beside) {
                if (are_alike(guides, here, there))
                    alike[count++] = {there, weight};
                else
                    beside_another |= is_beside && guides.geometry_ids[there] != invalid_id;
            });
        for (std::size_t i = 0; i < given.size() && !beside_another; ++i) {
            Mean mean;
            for (const auto& [there, weight] : std::span(alike).first(count))
                mean.add(given[i].part[there], weight * given[i].known[there]);
            results[i][here] = mean.or_else(1.0f);
        }
        is_edge[here] = beside_another;
    });
    visit_pixels(guides.size, part_of(progress, 0.5, 1.0), [&](const glm::ivec2& pixel, std::size_t here) {
        for (std::size_t i = 0; i < given.size() && is_edge[here]; ++i) {
            Mean mean;
            visit_block(guides.size, pixel, [&](std::size_t there, float weight, bool) {
                if (is_edge[there])
                    mean.add(given[i].part[there], weight * given[i].known[there]);
            });
            results[i][here] = mean.or_else(0.0f);
        }
    });
    return results;
}

std::vector<float> mean_on_plane(const glm::ivec2& size, std::span<const float> numbers, std::span<const float> weights,
                                 const Progress& progress)
{
    std::vector<float> means(numbers.size());
    visit_pixels(size, progress, [&](const glm::ivec2& pixel, std::size_t here) {
        Mean mean;
        visit_block(size, pixel,
                    [&](std::size_t there, float weight, bool) { mean.add(numbers[there], weight * weights[there]); });
        means[here] = mean.or_else(0.0f);
    });
    return means;
}

} // namespace isospline
