#include "isospline/scene/leaf_tree_builder.h"

#include "isospline/scene/embree_ray.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <vector>

namespace isospline {

namespace {

/// A node as Embree's builder makes it.
struct WideNode {
    float lower(unsigned int child, std::size_t axis) const
    {
        const RTCBounds& box = bounds[child];
        return axis == 0 ? box.lower_x : axis == 1 ? box.lower_y : box.lower_z;
    }
    float upper(unsigned int child, std::size_t axis) const
    {
        const RTCBounds& box = bounds[child];
        return axis == 0 ? box.upper_x : axis == 1 ? box.upper_y : box.upper_z;
    }

    unsigned int count = 0;
    void* children[LeafTree::width]; ///< nodes, or leaves as their number with the lowest bit set
    RTCBounds bounds[LeafTree::width];
};

void* leaf_pointer(std::uint32_t leaf)
{
    return reinterpret_cast<void*>(std::uintptr_t{leaf} << 1 | 1u);
}

bool is_leaf(const void* child)
{
    return (reinterpret_cast<std::uintptr_t>(child) & 1u) != 0;
}

std::uint32_t leaf_of(const void* child)
{
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(child) >> 1);
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned int, void* user_pointer)
{
    Device::throw_if_cancelled(user_pointer);
    void* const memory = rtcThreadLocalAlloc(allocator, sizeof(WideNode), alignof(WideNode));
    if (memory == nullptr)
        throw std::bad_alloc();
    return new (memory) WideNode;
}

void set_children(void* node, void** children, unsigned int count, void*)
{
    WideNode& wide = *static_cast<WideNode*>(node);
    wide.count = count;
    std::copy_n(children, count, wide.children);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned int count, void*)
{
    for (unsigned int i = 0; i < count; ++i)
        static_cast<WideNode*>(node)->bounds[i] = *bounds[i];
}

void* create_leaf(RTCThreadLocalAllocator, const RTCBuildPrimitive* primitives, std::size_t, void*)
{
    return leaf_pointer(primitives->primID);
}

/// Sets the boxes of a node along an axis, on the finest grid of steps that are powers of two. Each box grows by less
/// than two steps.
void set_grid(LeafTree::Node& node, std::size_t axis, const WideNode& from)
{
    double least = from.lower(0, axis), most = from.upper(0, axis);
    for (unsigned int i = 1; i < from.count; ++i) {
        least = std::min(least, double{from.lower(i, axis)});
        most = std::max(most, double{from.upper(i, axis)});
    }
    const double step = std::ldexp(1.0, std::ilogb((most - least) / 255.0) + 1);
    node.origin[axis] = static_cast<float>(least); // exact
    node.step[axis] = static_cast<float>(step);
    std::uint8_t* const lower = node.bounds + LeafTree::Node::first_bound(axis);
    std::uint8_t* const upper = lower + LeafTree::width;
    std::fill_n(lower, LeafTree::width, std::uint8_t{255});
    std::fill_n(upper, LeafTree::width, std::uint8_t{0});
    for (unsigned int i = 0; i < from.count; ++i) {
        lower[i] = static_cast<std::uint8_t>(std::floor((from.lower(i, axis) - least) / step));
        upper[i] = static_cast<std::uint8_t>(std::ceil((from.upper(i, axis) - least) / step));
    }
}

/// Sets a node of the tree and appends those below it. Throws Cancelled if `progress` returns false.
void append(const WideNode& from, std::size_t place, int depth, const Progress& progress, LeafTree& tree)
{
    constexpr std::size_t nodes_a_report = 4096;
    if (place % nodes_a_report == 0)
        report(progress, 1.0);
    if (depth > LeafTree::largest_depth)
        throw std::runtime_error("Embree built a tree of leaves that is too deep");
    LeafTree::Node node = {};
    for (std::size_t axis = 0; axis < 3; ++axis)
        set_grid(node, axis, from);
    const std::size_t first_below = tree.nodes.size();
    std::size_t below = first_below;
    for (unsigned int i = 0; i < from.count; ++i)
        node.children[i] = is_leaf(from.children[i]) ? leaf_of(from.children[i]) | LeafTree::leaf_bit
                                                     : static_cast<std::uint32_t>(below++);
    tree.nodes.resize(below);
    tree.nodes[place] = node;
    below = first_below;
    for (unsigned int i = 0; i < from.count; ++i)
        if (!is_leaf(from.children[i]))
            append(*static_cast<const WideNode*>(from.children[i]), below++, depth + 1, progress, tree);
}

} // namespace

LeafTree build_leaf_tree(const Device& device, std::size_t count, const std::function<Box(unsigned int)>& box,
                         const Progress& progress)
{
    std::vector<RTCBuildPrimitive> boxes(count);
    for (unsigned int i = 0; i < count; ++i) {
        set_bounds(box(i), boxes[i]);
        boxes[i].primID = i;
    }
    const embree::BvhHandle bvh(rtcNewBVH(device.get()));
    device.check();
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.bvh = bvh.get();
    arguments.primitives = boxes.data();
    arguments.primitiveCount = arguments.primitiveArrayCapacity = count;
    arguments.maxBranchingFactor = LeafTree::width;
    arguments.maxDepth = LeafTree::largest_depth;
    arguments.minLeafSize = arguments.maxLeafSize = 1;
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    const void* const root = device.build(arguments, progress);
    WideNode of_leaf;
    if (is_leaf(root)) {
        of_leaf.count = 1;
        of_leaf.children[0] = leaf_pointer(0);
        const RTCBuildPrimitive& only = boxes.front();
        of_leaf.bounds[0] = {only.lower_x, only.lower_y, only.lower_z, 0, only.upper_x, only.upper_y, only.upper_z, 0};
    }
    LeafTree tree;
    tree.nodes.resize(1);
    append(is_leaf(root) ? of_leaf : *static_cast<const WideNode*>(root), 0, 1, progress, tree);
    tree.nodes.shrink_to_fit();
    return tree;
}

} // namespace isospline
