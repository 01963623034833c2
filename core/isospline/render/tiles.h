// An image in square tiles, the units of work of threads.
#pragma once

#include "isospline/util/error.h"

#include <glm/vec2.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace isospline {

/// A distance of columns and rows, 1 to 2^20; throws std::invalid_argument for another.
inline int checked_step(int step)
{
    constexpr int largest = 1 << 20; // so that tiles of steps have a size in an int
    if (step < 1)
        throw_invalid("step", "a number of at least 1", step);
    if (step > largest)
        throw_invalid("step", "a number of at most " + std::to_string(largest), step);
    return step;
}

class Tiles {
public:
    static constexpr int side = 16; ///< pixels

    /// `mask` has one number for each pixel, row by row, and 0 for those that are left out; if it is empty, none is. Of
    /// the columns and rows, only each `step`-th is in the tiles, from `first` on.
    explicit Tiles(const glm::ivec2& image_size, std::span<const std::uint8_t> mask = {}, int step = 1,
                   const glm::ivec2& first = glm::ivec2(0))
        : image_size_(image_size), first_(first), step_(step),
          count_((image_size - first + step * side - 1) / (step * side)), mask_(mask)
    {
    }

    std::size_t count() const { return static_cast<std::size_t>(count_.x) * static_cast<std::size_t>(count_.y); }

    /// The tile that a pixel is in, if no column or row is left out.
    std::size_t tile_of(const glm::ivec2& pixel) const
    {
        return static_cast<std::size_t>(pixel.y / side) * static_cast<std::size_t>(count_.x) +
               static_cast<std::size_t>(pixel.x / side);
    }

    /// Sets `pixels` to the pixels of a tile that are in the image and in the mask, in Z-order: consecutive pixels are
    /// neighbours in both directions, so that their rays form coherent packets.
    void get_pixels(std::size_t tile, std::vector<glm::ivec2>& pixels) const
    {
        const auto in_row = static_cast<std::size_t>(count_.x);
        const glm::ivec2 first = side * glm::ivec2(tile % in_row, tile / in_row);
        pixels.clear();
        for (const Place& place : z_order) {
            const glm::ivec2 pixel = first_ + step_ * glm::ivec2(first.x + place.x, first.y + place.y);
            if (pixel.x < image_size_.x && pixel.y < image_size_.y && is_in_mask(pixel))
                pixels.push_back(pixel);
        }
    }

private:
    struct Place {
        int x, y;
    };

    static constexpr auto z_order = [] {
        constexpr auto even_bits = [](int bits) {
            return (bits & 1) | (bits & 4) >> 1 | (bits & 16) >> 2 | (bits & 64) >> 3;
        };
        std::array<Place, side * side> places{};
        for (int i = 0; i < side * side; ++i)
            places[static_cast<std::size_t>(i)] = {even_bits(i), even_bits(i >> 1)};
        return places;
    }();

    bool is_in_mask(const glm::ivec2& pixel) const
    {
        const auto width = static_cast<std::size_t>(image_size_.x);
        return mask_.empty() || mask_[static_cast<std::size_t>(pixel.y) * width + static_cast<std::size_t>(pixel.x)];
    }

    glm::ivec2 image_size_, first_;
    int step_;
    glm::ivec2 count_;
    std::span<const std::uint8_t> mask_;
};

} // namespace isospline
