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
class Volume;

struct ShellOptions {
    int prune_depth = 2;      ///< levels of two-scale subdivision (paper §5), 0 to 6; 0 does not prune
    bool prune_border = true; ///< the paper leaves the cells on the volume's border unpruned: false
    Mask mask;                ///< empty: nothing is cut away
};

/// The cells of a volume whose coefficients, less the threshold, do not all have one sign (paper §3), less those that
/// pruning (§5) or a cutout removes. A coefficient that equals the threshold counts as above it, as in the paper.
///
/// Cells are ordered by brick of 8 x 8 x 8 cells, as Bricks numbers them, then by block of 2 x 2 x 2 cells: neighbours
/// in memory are neighbours in space.
class Shell {
public:
    Shell();
    /// Of the bricks of one level of a volume.
    Shell(const Volume& volume, const Bricks& bricks, const ShellOptions& options, const Progress& progress = {});

    const std::vector<Cell>& cells() const { return cells_; }
    std::size_t count() const { return cells_.size(); }
    std::size_t memory() const { return cells_.capacity() * sizeof(Cell); }
    /// Built by the first call, which may come from any thread; copies of a shell have it in common.
    const CellTree& tree() const;

private:
    struct LazyTree;

    std::vector<Cell> cells_;
    std::shared_ptr<LazyTree> tree_;
};

/// Takes the cells of bricks out that pruning shows to hold no surface, sets `cells[i]` being of `bricks[i]`.
void prune_bricks(const Volume& volume, double threshold, const ShellOptions& options, std::span<const Brick> bricks,
                  std::span<BrickCells> cells);

} // namespace isospline
