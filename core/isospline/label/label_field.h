// Samples of a function whose zero set is the smooth surface of a label.
#pragma once

#include "isospline/math/grid.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

/// The labels of voxels; x varies fastest.
struct LabelMap {
    std::int32_t at(const glm::ivec3& voxel) const { return values[place_in(shape, voxel)]; }

    const std::int32_t* values;
    glm::ivec3 shape;
};

/// A function that is positive in a label and negative in all others, and whose positive part has a given volume.
///
/// Each label near this one, and the background, has a field of its own. Half the difference between this label's field
/// and the largest of the others is its field where three labels meet: at each place, one label has a positive one.
/// Where only two labels are near, their own fields differ in sign only, so this changes nothing.
///
/// A field of its own begins with the smoothed indicator of the label. Low-pass filters make it smoother, and Newton's
/// method restores the volume near each voxel. The centres of voxels keep their side.
class LabelField {
public:
    /// `deviations` are those of the smoothing, in voxels along x, y, z. A label that touches `background` is changed
    /// there to enclose a volume. The map has a voxel with the label.
    LabelField(const LabelMap& labels, std::int32_t label, std::int32_t background, const glm::dvec3& deviations,
               const Progress& progress);
    ~LabelField();
    LabelField(const LabelField&) = delete;
    LabelField& operator=(const LabelField&) = delete;

    /// Of the map, in voxels along x, y, z.
    const glm::ivec3& shape() const;
    /// The number of voxels with the label.
    std::size_t voxel_count() const;
    /// Moves the surface so that it encloses about this number of voxels. Returns the relative error that is left.
    double enclose(double voxels, const Progress& progress);
    /// The samples of all voxels; x varies fastest.
    std::vector<float> samples() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace isospline
