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

/// Statistics of the rays.
struct HopStatistics {
    std::uint64_t hops = 0;            ///< from one cell to the next
    std::uint64_t strides = 0;         ///< across the rest of an empty brick
    std::uint64_t evaluated_cells = 0; ///< cells of the shell that a ray met
    double length = 0.0;               ///< of all hops and strides, in cells

    /// The average length of a hop or stride, in cells; 0 without any.
    ///
    /// The paper observes "about 0.653" and leaves the exact value to the reader. Hops end on the faces of the cells,
    /// so a line's hops are its chords of unit cubes. By Cauchy's formula, the mean chord of a convex body over uniform
    /// isotropic lines is 4 V / S = 4 * 1 / 6 = 2/3. Parallel lines of direction d give the mean
    /// V / (area of the shadow) = 1 / (|dx| + |dy| + |dz|), between 1/sqrt(3) along a diagonal and 1 along an axis. As
    /// with Buffon's needle, the mean over directions follows from the mean number of crossings, |dx| + |dy| + |dz|,
    /// which is 3/2. A picture has few directions, and so an average between these, such as 0.653.
    double mean_hop_length() const;

    HopStatistics& operator+=(const HopStatistics& other);
};

struct VoxelHopperOptions {
    bool strides = false; ///< cross bricks without shell cells in one step (the octree remark of §3)
};

/// Traces an isosurface by hopping from cell to cell through the dense binary array b of its shell, one byte a cell.
///
/// Cells and the root finder are those of the isosurface, so hits are the same as in a scene, with geometry id 0.
class VoxelHopper {
public:
    /// Throws std::invalid_argument for no surface, and for one with caps.
    explicit VoxelHopper(std::shared_ptr<const IsosurfaceSnapshot> surface, const VoxelHopperOptions& options = {});
    ~VoxelHopper();

    /// The first crossing of each ray within its [t_near, t_far], on the caller's thread alone. Throws
    /// std::invalid_argument for a ray that is not finite or has no direction, and if there is not one hit for each
    /// ray.
    HopStatistics cast_rays(std::span<const Ray> rays, std::span<Hit> hits) const;

    /// The bytes of this object, without the surface.
    std::size_t memory() const;

private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
};

} // namespace isospline
