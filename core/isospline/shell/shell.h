// The shell of the paper: the cells that may hold a part of the surface.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/brick/cutout.h"
#include "isospline/util/progress.h"

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace isospline {

class Bricks;
class CellTree;
template <typename Value>
class Lazy;
class Volume;

struct ShellOptions {
    int prune_depth = 2;      ///< levels of two-scale subdivision (paper §5), 0 to 6; 0 does not prune
    bool prune_border = true; ///< false: cells on the volume's border are not pruned, as in the paper
    Mask mask;                ///< empty: nothing is cut away
};

/// The mixed cells of a volume (paper §3), without those that pruning (§5) or a cutout removes. A coefficient that
/// equals the threshold counts as above it, as in the paper.
///
/// Cells are ordered by brick, in the order of Bricks, then by block: neighbours in memory are neighbours in space.
class Shell {
public:
    Shell();
    /// The shell of the bricks of one level of a volume.
    Shell(const Volume& volume, const Bricks& bricks, const ShellOptions& options, const Progress& progress = {});

    const std::vector<Cell>& cells() const { return cells_; }
    std::size_t count() const { return cells_.size(); }
    std::size_t memory() const { return cells_.capacity() * sizeof(Cell); }
    /// Built by the first call, from any thread, while other calls wait; copies of a shell share it. Throws Cancelled
    /// if `progress` returns false.
    const CellTree& tree(const Progress& progress = {}) const;

private:
    std::vector<Cell> cells_;
    std::shared_ptr<Lazy<CellTree>> tree_;
};

/// Removes the cells that pruning proves to hold no surface. `cells[i]` is a set of cells of `bricks[i]`.
void prune_bricks(const Volume& volume, double threshold, const ShellOptions& options, std::span<const Brick> bricks,
                  std::span<BrickCells> cells);

} // namespace isospline
