// A tree of boxes over the cells of a shell, for nearest point queries.
#pragma once

#include "isospline/math/box.h"
#include "isospline/shell/shell.h"
#include "isospline/util/progress.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// A binary tree whose leaves are blocks of 2 x 2 x 2 cells. Each inner node is split at the median of its blocks along
/// its longest axis.
class CellTree {
public:
    struct Node {
        std::array<std::uint16_t, 3> lower, upper; ///< corners of the box of all cells, lattice space
        std::uint32_t first; ///< of a leaf: first row of Shell::cells(); otherwise the second child; the first child is
                             ///< the next node
        std::uint32_t count; ///< number of consecutive cells of a leaf; 0 for an inner node

        Box box() const { return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}}; }
    };

    /// `cells` are in the order of a shell. Throws Cancelled if `progress` returns false.
    explicit CellTree(const std::vector<Cell>& cells, const Progress& progress = {});

    /// The root is the first node; a shell without cells has no nodes.
    const std::vector<Node>& nodes() const { return nodes_; }
    std::size_t memory() const { return nodes_.capacity() * sizeof(Node); }

private:
    std::vector<Node> nodes_;
};

} // namespace isospline
