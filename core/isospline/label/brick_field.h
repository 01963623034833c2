// Numbers at the voxels near the surface of a label, in bricks. Other bricks have one number for all voxels.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/math/grid.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// Numbers of a brick. Voxel (x, y, z) of a brick has number x + 8 y + 64 z.
inline constexpr std::size_t numbers_of_brick = std::size_t{brick_size} * brick_size * brick_size;

/// The bricks that have a number for each voxel.
struct BrickLayout {
    explicit BrickLayout(const glm::ivec3& voxels)
        : shape(voxels), bricks(brick_shape(voxels)), place(place_count(bricks), none)
    {
    }

    static constexpr std::uint32_t none = ~std::uint32_t{0};

    /// The index of the brick at a place in the grid of bricks.
    std::size_t index(const glm::ivec3& at) const { return place_in(bricks, at); }
    void store(std::size_t brick, bool is_computed)
    {
        place[brick] = static_cast<std::uint32_t>(stored.size());
        stored.push_back(static_cast<std::uint32_t>(brick));
        computed.push_back(is_computed ? 1 : 0);
    }
    bool is_computed(std::size_t brick) const { return place[brick] != none && computed[place[brick]] != 0; }
    /// Where a stored brick is. The size is less than 8 where the volume ends.
    Brick brick(std::size_t number) const { return brick_at(shape, at_place(bricks, stored[number])); }

    glm::ivec3 shape;                   ///< in voxels along x, y, z
    glm::ivec3 bricks;                  ///< along x, y, z
    std::vector<std::uint32_t> place;   ///< of each brick among the stored ones, or none
    std::vector<std::uint32_t> stored;  ///< the indices of bricks
    std::vector<std::uint8_t> computed; ///< for each stored brick, whether filters and the like compute its numbers
};

/// Numbers at voxels. Those of a stored brick that are beyond the volume mean nothing, but are finite.
struct BrickField {
    /// The layout must outlive the field.
    BrickField(const BrickLayout& of, float value)
        : layout(&of), constants(of.place.size(), value), data(of.stored.size() * numbers_of_brick, value)
    {
    }

    float* numbers(std::size_t stored) { return data.data() + stored * numbers_of_brick; }
    const float* numbers(std::size_t stored) const { return data.data() + stored * numbers_of_brick; }
    /// The numbers of a brick, or null if it is not stored.
    const float* find(std::size_t brick) const
    {
        return layout->place[brick] == BrickLayout::none ? nullptr : numbers(layout->place[brick]);
    }

    const BrickLayout* layout;
    std::vector<float> constants; ///< for each brick, the number of its voxels if it is not stored
    std::vector<float> data;
};

} // namespace isospline
