// Plain voxel hopping (paper §3): the baseline that scenes are compared with.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace isospline {

/// What rays went through on their way.
struct HopStatistics {
    std::uint64_t hops = 0;            ///< from one cell to the next
    std::uint64_t strides = 0;         ///< across what is left of an empty brick
    std::uint64_t evaluated_cells = 0; ///< cells of the shell that a ray met
    double length = 0.0;               ///< of all hops and strides, in cells

    /// Length of the average hop or stride, in cells; 0 where there was none.
    ///
    /// The paper observes "about 0.653" and leaves the exact value to the reader. Hops end on the faces of the cells,
    /// so that a line's hops are its chords of unit cubes. By Cauchy's formula the mean chord of a convex body is
    /// 4 V / S over lines that are uniform and isotropic: 4 * 1 / 6 = 2/3. Parallel lines of direction d alone give
    /// V / (area of the shadow) = 1 / (|dx| + |dy| + |dz|), between 1/sqrt(3) along a diagonal and 1 along an axis; as
    /// with Buffon's needle, the mean over directions is that of the crossings, |dx| + |dy| + |dz|, which is 3/2. A
    /// picture looks along few directions, hence an average of its own, such as 0.653.
    double mean_hop_length() const;

    HopStatistics& operator+=(const HopStatistics& other);
};

struct VoxelHopperOptions {
    bool strides = false; ///< cross bricks without a shell cell at once (the octree remark of §3)
};

/// Traces an isosurface by hopping from cell to cell through the dense binary array b of its shell, one byte a cell.
///
/// Cells, and the root finder in a cell, are the isosurface's own: the same hits as in a scene, with geometry id 0.
class VoxelHopper {
public:
    /// Throws std::invalid_argument for a surface with capped cuts.
    explicit VoxelHopper(std::shared_ptr<const IsosurfaceSnapshot> surface, const VoxelHopperOptions& options = {});
    ~VoxelHopper();

    /// First crossing of each ray within its [t_near, t_far]; one thread, the caller's. Throws std::invalid_argument
    /// for a ray that is not finite or has no direction.
    HopStatistics cast_rays(std::span<const Ray> rays, std::span<Hit> hits) const;

    /// Bytes held by this object, the surface not counted.
    std::size_t memory() const;

private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
};

} // namespace isospline
