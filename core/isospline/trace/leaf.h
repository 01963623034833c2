// The blocks of a surface at one level that rays may cross, all made, each with all that a ray needs of it.
#pragma once

#include "isospline/brick/block.h"
#include "isospline/brick/bricks.h"
#include "isospline/math/box.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// A block in one cache line. It belongs to a volume whose coefficients are in memory.
struct alignas(64) Leaf {
    glm::ivec3 first_cell() const { return {first[0], first[1], first[2]}; }

    Block block;
    std::array<std::uint16_t, 3> first; ///< its first cell
    const float* coefficients;          ///< of its first cell
};
static_assert(sizeof(Leaf) == 64);

/// All leaves of the bricks of one level.
class Leaves {
public:
    /// Two levels of two-scale subdivision (paper §5) remove cells. A cell stays unless its fine coefficients have one
    /// sign by more than rounding, so that the crossings of rays do not depend on it. The volume must outlive the
    /// object. Throws Cancelled if `progress` returns false.
    Leaves(const Volume& volume, const Bricks& bricks, const Progress& progress = {});

    std::size_t size() const { return leaves_.size(); }
    const Leaf& operator[](std::size_t index) const { return leaves_[index]; }
    int degree() const { return degree_; }
    double threshold() const { return threshold_; }
    std::ptrdiff_t row_stride() const { return row_stride_; }
    std::ptrdiff_t slice_stride() const { return slice_stride_; }
    std::size_t memory() const { return leaves_.capacity() * sizeof(Leaf); }

private:
    std::vector<Leaf> leaves_;
    int degree_;
    double threshold_;
    std::ptrdiff_t row_stride_, slice_stride_;
};

/// The box, in lattice space, of the parts of a leaf's cells that are in their slabs.
Box bounds_of(const Leaf& leaf);

} // namespace isospline
