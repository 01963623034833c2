// The shell: the cells that may hold a part of the surface.
#pragma once

#include "isospline/shell/cutout.h"
#include "isospline/spline/volume.h"
#include "isospline/util/progress.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <tuple>
#include <vector>

namespace isospline {

class CellTree;
class ValueBounds;

/// The indices of a cell; a volume has at most 65535 cells along an axis.
struct Cell {
    std::uint16_t x, y, z;
    bool operator==(const Cell&) const = default;
};

/// The order of cells within a brick of the shell.
inline bool is_before_in_brick(const Cell& a, const Cell& b)
{
    return std::tuple(a.z / 2, a.y / 2, a.x / 2, a.z, a.y, a.x) < std::tuple(b.z / 2, b.y / 2, b.x / 2, b.z, b.y, b.x);
}

struct ShellOptions {
    int prune_depth = 2;      ///< levels of two-scale subdivision (paper §5), 0 to 6; 0 does not prune
    bool prune_border = true; ///< the paper leaves the cells on the volume's border unpruned: false
    Mask mask;                ///< empty: nothing is cut away
};

/// The cells of a volume whose coefficients, less the threshold, do not all have one sign (paper §3), less those that
/// pruning (§5) or a cutout removes. A coefficient that equals the threshold counts as above it, as in the paper.
///
/// Cells are ordered by brick of 8 x 8 x 8 cells, then by block of 2 x 2 x 2, then z, y, x: neighbours in memory are
/// neighbours in space.
class Shell {
public:
    Shell();
    /// `threshold` is level - volume.offset(); `clip_lattice` is in lattice space, its normals have length one, and it
    /// removes cells wholly outside. Throws std::invalid_argument for a depth outside of 0-6.
    Shell(const Volume& volume, const ValueBounds& bounds, double threshold, const ShellOptions& options,
          const std::vector<HalfSpace>& clip_lattice, const Progress& progress = {});

    const std::vector<Cell>& cells() const { return cells_; }
    std::size_t count() const { return cells_.size(); }
    /// The box of all cells, in lattice space; empty where there are none.
    const Box& bounds() const { return bounds_; }
    std::size_t memory() const { return cells_.capacity() * sizeof(Cell); }
    /// Built by the first call, which may come from any thread; copies of a shell have it in common.
    const CellTree& tree() const;

private:
    struct LazyTree;

    std::vector<Cell> cells_;
    Box bounds_;
    std::shared_ptr<LazyTree> tree_;
};

} // namespace isospline
