// Items of a mesh by their place.
#pragma once

#include "isospline/math/box.h"
#include "isospline/polygonize/mesh_part.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace isospline {

/// A loose octree (T. Ulrich, "Loose octrees", Game Programming Gems, 2000). An item is in one node: the smallest whose
/// cube holds the centre of the item's box and is as large as the box. So the box reaches out of the cube by at most
/// half of an edge. Any number of threads may visit items at the same time.
class FaceOctree {
public:
    /// For items numbered below `item_count` that are inside `bounds`. Cubes have an edge of at least `least_edge`.
    FaceOctree(const Box& bounds, std::size_t item_count, double least_edge);

    void insert(std::uint32_t item, const Box& box);
    void remove(std::uint32_t item);
    /// Calls `visit(item)` for the items of nodes that `box` meets, a superset of the items whose boxes it meets, until
    /// it returns false. Returns whether it never did.
    template <typename Visit>
    bool visit(const Box& box, const Visit& visit) const
    {
        return nodes_[0].count == 0 || visit_node(0, lower_, edge_, box, visit);
    }

private:
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    struct Node {
        std::array<std::uint32_t, 8> children{none, none, none, none, none, none, none, none};
        std::uint32_t parent = none;
        std::uint32_t first = none; ///< of a linked list of items
        std::uint32_t count = 0;    ///< items in the node and below
    };

    template <typename Visit>
    bool visit_node(std::uint32_t index, const glm::dvec3& lower, double edge, const Box& box, const Visit& visit) const
    {
        const Node& node = nodes_[index];
        const double margin = 0.5 * edge;
        if (node.count == 0 || !Box{lower - margin, lower + edge + margin}.meets(box))
            return true;
        for (std::uint32_t item = node.first; item != none; item = next_[item])
            if (!visit(item))
                return false;
        for (int child = 0; child < 8; ++child)
            if (const std::uint32_t below = node.children[static_cast<std::size_t>(child)]; below != none) {
                const glm::dvec3 corner(child & 1, child >> 1 & 1, child >> 2);
                if (!visit_node(below, lower + margin * corner, margin, box, visit))
                    return false;
            }
        return true;
    }

    glm::dvec3 lower_;
    double edge_, least_edge_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> next_, node_of_;
};

/// The octree of the faces of a mesh whose boxes are chosen.
FaceOctree octree_of(const LabeledMesh& mesh, const std::function<bool(const Box&)>& is_chosen);
/// The octree of boxes.
FaceOctree octree_of(const std::vector<Box>& boxes, double least_edge);

} // namespace isospline
