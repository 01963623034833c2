// The bricks of a label map in which the surface of a label can be, and where several labels meet.
#pragma once

#include "isospline/label/brick_field.h"
#include "isospline/label/label_field.h"
#include "isospline/util/parallel.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// The labels in each brick of a map.
class LabelBricks {
public:
    /// One number for each brick, 0 for those that do not count.
    using Chosen = std::vector<std::uint8_t>;
    /// Bricks near to which three labels or more are, and these labels.
    struct Meetings {
        Chosen bricks;
        std::vector<std::int32_t> labels; ///< sorted
    };

    /// The map must outlive it.
    explicit LabelBricks(const LabelMap& labels);

    /// Bricks within a reach, in voxels along x, y, z, of faces between a label and others. If some bricks are chosen,
    /// only these and bricks near to them are computed.
    BrickLayout layout_around(std::int32_t label, const glm::ivec3& reach, const Chosen* chosen = nullptr) const;
    /// The stored bricks within a reach of which three labels or more are.
    Meetings meetings(const BrickLayout& layout, const glm::ivec3& reach) const;
    /// Chosen bricks, and those within a reach of them.
    Chosen widened(const Chosen& chosen, const glm::ivec3& reach) const;

private:
    bool is_surely_inside(const glm::ivec3& at, std::int32_t label) const;
    /// Whether a voxel of a label has a face in common with another label.
    bool has_face(const glm::ivec3& voxel, std::int32_t label) const;

    LabelMap labels_;
    glm::ivec3 bricks_;                               ///< along x, y, z
    std::vector<std::vector<std::int32_t>> in_brick_; ///< sorted
};

/// The numbers of a map's labels: `number_of(label)`. Bricks that are not stored have that of their first voxel.
template <typename NumberOf>
BrickField field_of(const LabelMap& labels, const BrickLayout& layout, const NumberOf& number_of)
{
    BrickField field(layout, 0.0f);
    parallel_for(layout.place.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t brick = begin; brick < end; ++brick) {
            const auto [first, size] = brick_at(layout.shape, at_place(layout.bricks, brick));
            field.constants[brick] = number_of(labels.at(first));
            if (layout.place[brick] == BrickLayout::none)
                continue;
            float* const numbers = field.numbers(layout.place[brick]);
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y)
                    for (int x = 0; x < size.x; ++x)
                        numbers[x + brick_size * (y + brick_size * z)] =
                            number_of(labels.at(first + glm::ivec3(x, y, z)));
        }
    });
    return field;
}

/// The numbers of all voxels; x varies fastest.
std::vector<float> dense(const BrickField& field);

/// The sum over all voxels of stored bricks of products of two fields.
double sum_of_products(const BrickField& a, const BrickField& b);

} // namespace isospline
