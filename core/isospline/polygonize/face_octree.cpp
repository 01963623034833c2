#include "isospline/polygonize/face_octree.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace isospline {

FaceOctree::FaceOctree(const Box& bounds, std::size_t item_count, double least_edge)
    : lower_(bounds.empty() ? glm::dvec3(0.0) : bounds.lower), edge_(least_edge), least_edge_(least_edge), nodes_(1),
      next_(item_count, none), node_of_(item_count, none)
{
    const glm::dvec3 size = bounds.empty() ? glm::dvec3(0.0) : bounds.size();
    while (edge_ < std::max({size.x, size.y, size.z}))
        edge_ *= 2.0;
}

void FaceOctree::insert(std::uint32_t item, const Box& box)
{
    const glm::dvec3 size = box.size(), center = box.center();
    const double extent = std::max({size.x, size.y, size.z, least_edge_});
    std::uint32_t index = 0;
    glm::dvec3 lower = lower_;
    ++nodes_[0].count;
    for (double edge = 0.5 * edge_; edge >= extent; edge *= 0.5) {
        unsigned child = 0;
        for (int axis = 0; axis < 3; ++axis)
            if (center[axis] >= lower[axis] + edge) {
                lower[axis] += edge;
                child |= 1u << axis;
            }
        std::uint32_t below = nodes_[index].children[child];
        if (below == none) {
            below = static_cast<std::uint32_t>(nodes_.size());
            nodes_.emplace_back().parent = index;
            nodes_[index].children[child] = below;
        }
        index = below;
        ++nodes_[index].count;
    }
    next_[item] = nodes_[index].first;
    nodes_[index].first = item;
    node_of_[item] = index;
}

void FaceOctree::remove(std::uint32_t item)
{
    std::uint32_t* link = &nodes_[node_of_[item]].first;
    while (*link != item)
        link = &next_[*link];
    *link = next_[item];
    for (std::uint32_t node = node_of_[item]; node != none; node = nodes_[node].parent)
        --nodes_[node].count;
    node_of_[item] = none;
}

FaceOctree octree_of(const LabeledMesh& mesh, const std::function<bool(const Box&)>& is_chosen)
{
    Box bounds;
    for (const glm::dvec3& vertex : mesh.vertices)
        bounds.extend(vertex);
    FaceOctree octree(bounds, mesh.faces.size(), 0.125);
    for (std::size_t i = 0; i < mesh.faces.size(); ++i)
        if (const Box box = box_of(mesh.vertices, mesh.faces[i]); is_chosen(box))
            octree.insert(static_cast<std::uint32_t>(i), box);
    return octree;
}

FaceOctree octree_of(const std::vector<Box>& boxes, double least_edge)
{
    Box bounds;
    for (const Box& box : boxes)
        bounds.extend(box);
    FaceOctree octree(bounds, boxes.size(), least_edge);
    for (std::size_t i = 0; i < boxes.size(); ++i)
        octree.insert(static_cast<std::uint32_t>(i), boxes[i]);
    return octree;
}

} // namespace isospline
