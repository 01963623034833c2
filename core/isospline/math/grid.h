// Indices in a grid of cells or samples, with x varying fastest, in 64 bits: exact for grids of more than 2^32.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>

namespace isospline {

/// The number of items.
constexpr std::uint64_t place_count(const glm::ivec3& shape)
{
    const glm::vec<3, std::uint64_t> size(shape);
    return size.x * size.y * size.z;
}

/// The index of (x, y, z): x + shape.x * (y + shape.y * z).
constexpr std::uint64_t place_in(const glm::ivec3& shape, const glm::ivec3& at)
{
    const glm::vec<3, std::uint64_t> size(shape), position(at);
    return position.x + size.x * (position.y + size.y * position.z);
}

/// The (x, y, z) of an index.
constexpr glm::ivec3 at_place(const glm::ivec3& shape, std::uint64_t place)
{
    const glm::vec<3, std::uint64_t> size(shape);
    const std::uint64_t row = place / size.x;
    return {static_cast<int>(place % size.x), static_cast<int>(row % size.y), static_cast<int>(row / size.y)};
}

/// Indices of places in the order of Z. Morton, 1966: the bits of x, y and z in turn, the lowest 21 of each. Places
/// with close codes are close to each other.
constexpr std::uint64_t morton_code(const glm::ivec3& at)
{
    const auto spread = [](int index) {
        std::uint64_t bits = static_cast<std::uint64_t>(index) & 0x1fffff;
        bits = (bits | bits << 32) & 0x1f00000000ffff;
        bits = (bits | bits << 16) & 0x1f0000ff0000ff;
        bits = (bits | bits << 8) & 0x100f00f00f00f00f;
        bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
        return (bits | bits << 2) & 0x1249249249249249;
    };
    return spread(at.x) | spread(at.y) << 1 | spread(at.z) << 2;
}

} // namespace isospline
