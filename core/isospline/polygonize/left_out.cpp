#include "isospline/polygonize/left_out.h"

#include "isospline/math/affine.h"
#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/face_octree.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace isospline {

std::vector<LeftOut> join_boxes(const std::vector<Box>& boxes, const LabeledMesh& mesh,
                                const glm::dmat4& lattice_to_world)
{
    if (boxes.empty())
        return {};
    // Number connected boxes alike.
    Box bounds;
    for (const Box& box : boxes)
        bounds.extend(box);
    FaceOctree of_boxes(bounds, boxes.size(), 1.0 / 256.0);
    for (std::size_t i = 0; i < boxes.size(); ++i)
        of_boxes.insert(static_cast<std::uint32_t>(i), boxes[i]);
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> part_of_box(boxes.size(), none), queue;
    std::vector<Box> parts;
    for (std::uint32_t first = 0; first < boxes.size(); ++first) {
        if (part_of_box[first] != none)
            continue;
        const auto part = static_cast<std::uint32_t>(parts.size());
        parts.emplace_back();
        part_of_box[first] = part;
        queue.assign(1, first);
        while (!queue.empty()) {
            const Box box = boxes[queue.back()];
            queue.pop_back();
            parts[part].extend(box);
            constexpr double margin = 1e-9;
            const Box around{box.lower - margin, box.upper + margin};
            of_boxes.visit(around, [&](std::uint32_t other) {
                if (boxes[other].meets(around) && part_of_box[other] == none) {
                    part_of_box[other] = part;
                    queue.push_back(other);
                }
                return true;
            });
        }
    }

    // The distance of a box from the mesh is at most that of its middle, and half of its diagonal.
    const LatticeMetric metric(lattice_to_world);
    const FaceOctree of_faces = octree_of(mesh, [](const Box&) { return true; });
    std::vector<double> distances(parts.size(), 0.0);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const glm::dvec3 middle = boxes[i].center(), middle_world = metric.to_world * middle;
        double least = std::numeric_limits<double>::infinity();
        for (double reach = metric.shortest_edge; !mesh.faces.empty() && least > reach; reach *= 2.0) {
            const glm::dvec3 around = box_of_ball(metric, reach);
            of_faces.visit({middle - around, middle + around}, [&](std::uint32_t index) {
                const glm::uvec3& face = mesh.faces[index];
                least = std::min(least,
                                 glm::distance(middle_world, closest_point_of_triangle(
                                                                 middle_world, metric.to_world * mesh.vertices[face.x],
                                                                 metric.to_world * mesh.vertices[face.y],
                                                                 metric.to_world * mesh.vertices[face.z])));
                return true;
            });
        }
        double half_diagonal = 0.0;
        for (int corner = 0; corner < 4; ++corner)
            half_diagonal = std::max(
                half_diagonal, 0.5 * metric.length(boxes[i].size() * glm::dvec3(1.0, (corner & 1) != 0 ? 1.0 : -1.0,
                                                                                (corner >> 1) != 0 ? 1.0 : -1.0)));
        double& distance = distances[part_of_box[i]];
        distance = std::max(distance, least + half_diagonal);
    }

    std::vector<LeftOut> left_out;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const glm::dvec3 size = parts[i].size();
        left_out.push_back({transform_point(lattice_to_world, parts[i].center()),
                            {size.x * glm::length(metric.to_world[0]), size.y * glm::length(metric.to_world[1]),
                             size.z * glm::length(metric.to_world[2])},
                            distances[i]});
    }
    return left_out;
}

} // namespace isospline
