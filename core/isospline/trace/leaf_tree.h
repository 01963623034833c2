// A tree of boxes around the leaves of a settled index, for rays that are traced one by one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// Each node has up to eight children, and their boxes on a grid of its own: two cache lines, as in the compressed wide
/// trees of Ylitie, Karras and Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017.
/// The nodes below a node lie side by side.
struct LeafTree {
    static constexpr int width = 8;
    /// A path from the root has at most so many nodes.
    static constexpr int largest_depth = 24;
    /// Marks a child that is a leaf; the other bits are its place in Leaves.
    static constexpr std::uint32_t leaf_bit = 0x80000000u;

    struct alignas(128) Node {
        /// Where the bounds of the children along an axis begin; those of the upper side come `width` later.
        static constexpr std::size_t first_bound(std::size_t axis) { return 2 * width * axis; }

        float origin[3], step[3];           ///< plane i of the grid is at origin + i * step
        std::uint8_t bounds[3 * 2 * width]; ///< planes; of a child that is not there, the upper one is below the lower
        std::uint32_t children[width];      ///< places in `nodes`, or leaves
    };

    std::size_t memory() const { return nodes.capacity() * sizeof(Node); }

    std::vector<Node> nodes; ///< at least one; the first one is the root
};

} // namespace isospline
