// Halving of edges by a TetrahedronMesher.
#include "isospline/polygonize/tetrahedron_mesher.h"
#include "isospline/query/surface_box.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// Edges shorter than this, in lattice units, are not halved.
constexpr double shortest_edge = 1.0 / 32.0;

constexpr std::size_t edges_of_tetrahedron[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

} // namespace

template <int Degree>
bool TetrahedronMesher<Degree>::is_too_coarse(const Tetrahedron& corners, double longest_allowed,
                                              const std::vector<Box>& boxes) const
{
    Box around;
    double longest = 0.0;
    for (const NodeId corner : corners)
        around.extend(nodes_[corner].position);
    for (const auto& [i, j] : edges_of_tetrahedron)
        longest = std::max(longest, glm::distance(nodes_[corners[i]].position, nodes_[corners[j]].position));
    if (longest <= std::max(longest_allowed, shortest_edge) ||
        std::none_of(boxes.begin(), boxes.end(), [&](const Box& box) { return box.overlaps(around); }))
        return false;
    const bool is_crossed = std::any_of(corners.begin(), corners.end(), [&](NodeId corner) {
        return nodes_[corner].is_solid != nodes_[corners[0]].is_solid;
    });
    if (is_crossed)
        return true;
    // The surface may be in the tetrahedron, although it crosses none of its edges.
    const PointInCell middle(field_.surface(), around.center());
    const SurfaceBox<Degree> part = part_of_cell(surface_box<Degree>(middle.cell, 0), around.lower - middle.cell.lower,
                                                 around.upper - middle.cell.lower);
    if (!part.has_surface())
        return false;
    const UnitSlab slab = slab_of<Degree>(part);
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const NodeId corner : corners) {
        const double at = glm::dot(slab.normal, (nodes_[corner].position - around.lower) / around.size());
        least = std::min(least, at);
        most = std::max(most, at);
    }
    return least <= slab.upper && most >= slab.lower;
}

template <int Degree>
typename TetrahedronMesher<Degree>::EdgeId TetrahedronMesher<Degree>::longest_edge(const Tetrahedron& corners,
                                                                                   const Nodes* among) const
{
    EdgeId longest = 0;
    double most = -1.0;
    for (const auto& [i, j] : edges_of_tetrahedron) {
        const EdgeId edge = edge_id(corners[i], corners[j]);
        if (among != nullptr && among->count(edge) == 0)
            continue;
        const glm::dvec3 along = nodes_[corners[j]].position - nodes_[corners[i]].position;
        const double square = glm::dot(along, along); // exact: coordinates are binary fractions
        if (std::tie(square, edge) > std::tie(most, longest)) {
            most = square;
            longest = edge;
        }
    }
    return longest;
}

template <int Degree>
void TetrahedronMesher<Degree>::halve(EdgeId edge, Nodes& middles, std::vector<std::uint32_t>& touched)
{
    if (!middles.try_emplace(edge, 0).second)
        return;
    const auto first = static_cast<NodeId>(edge >> 32), second = static_cast<NodeId>(edge);
    const glm::dvec3 middle = 0.5 * (nodes_[first].position + nodes_[second].position);
    middles[edge] = add_node(middle, false);

    // All cubes that share the edge get its middle.
    const int subdivision = field_.subdivision();
    const glm::dvec3 steps = static_cast<double>(subdivision) * middle;
    const glm::ivec3 last(glm::floor(steps)), first_cube(glm::ceil(steps) - 1.0);
    glm::ivec3 cube;
    for (cube.z = first_cube.z; cube.z <= last.z; ++cube.z)
        for (cube.y = first_cube.y; cube.y <= last.y; ++cube.y)
            for (cube.x = first_cube.x; cube.x <= last.x; ++cube.x) {
                const bool is_in_domain = cube.x >= 0 && cube.y >= 0 && cube.z >= 0 && cube.x + 1 < field_.nodes().x &&
                                          cube.y + 1 < field_.nodes().y && cube.z + 1 < field_.nodes().z;
                if (is_in_domain)
                    if (const auto number = split_cube(cube))
                        touched.push_back(*number);
            }
}

template <int Degree>
void TetrahedronMesher<Degree>::split(const Tetrahedron& corners, const Nodes& middles,
                                      std::vector<Tetrahedron>& parts) const
{
    const EdgeId edge = longest_edge(corners, &middles);
    if (edge == 0) {
        parts.push_back(corners);
        return;
    }
    for (const NodeId end : {static_cast<NodeId>(edge >> 32), static_cast<NodeId>(edge)}) {
        Tetrahedron half = corners;
        std::replace(half.begin(), half.end(), end, middles.at(edge));
        split(half, middles, parts);
    }
}

template <int Degree>
void TetrahedronMesher<Degree>::refine(const std::vector<Box>& boxes, double longest_allowed, const Progress& progress)
{
    struct MetCube {
        std::vector<Box> boxes;
        std::vector<std::uint8_t> is_fine; ///< for each tetrahedron
    };
    std::map<std::uint32_t, MetCube> met; // by the numbers of cubes
    const double steps = field_.subdivision();
    for (const Box& box : boxes) {
        const glm::ivec3 most = field_.nodes() - 2;
        const glm::ivec3 first = glm::clamp(glm::ivec3(glm::floor(steps * box.lower)), glm::ivec3(0), most);
        const glm::ivec3 last = glm::clamp(glm::ivec3(glm::ceil(steps * box.upper)) - 1, first, most);
        glm::ivec3 cube;
        for (cube.z = first.z; cube.z <= last.z; ++cube.z)
            for (cube.y = first.y; cube.y <= last.y; ++cube.y)
                for (cube.x = first.x; cube.x <= last.x; ++cube.x)
                    if (const auto number = split_cube(cube))
                        met[*number].boxes.push_back(box);
    }
    std::vector<std::pair<const std::uint32_t, MetCube>*> all;
    for (auto& each : met)
        all.push_back(&each);
    Nodes middles;
    std::vector<std::uint32_t> touched;
    while (true) {
        parallel_for(
            all.size(), 4,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    auto& [number, cube] = *all[i];
                    const std::vector<Tetrahedron>& tetrahedra = split_[number].tetrahedra;
                    cube.is_fine.resize(tetrahedra.size(), 0);
                    for (std::size_t j = 0; j < tetrahedra.size(); ++j)
                        if (cube.is_fine[j] == 0)
                            cube.is_fine[j] = !is_too_coarse(tetrahedra[j], longest_allowed, cube.boxes);
                }
            },
            only_cancelling(progress));
        middles.clear();
        touched.clear();
        for (const auto* each : all)
            for (std::size_t j = 0; j < each->second.is_fine.size(); ++j)
                if (each->second.is_fine[j] == 0)
                    halve(longest_edge(split_[each->first].tetrahedra[j], nullptr), middles, touched);
        if (middles.empty())
            return;
        std::sort(touched.begin(), touched.end());
        touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
        // Most tetrahedra have no two corners at which halved edges end.
        std::vector<std::uint8_t> is_end(nodes_.size(), 0);
        for (const auto& [edge, middle] : middles)
            is_end[edge >> 32] = is_end[edge & 0xffffffff] = 1;
        parallel_for(touched.size(), 64, [&](std::size_t begin, std::size_t end) {
            std::vector<Tetrahedron> parts;
            std::vector<std::uint8_t> are_fine;
            for (std::size_t i = begin; i < end; ++i) {
                const auto found = met.find(touched[i]);
                std::vector<std::uint8_t>* const is_fine = found != met.end() ? &found->second.is_fine : nullptr;
                parts.clear();
                are_fine.clear();
                std::vector<Tetrahedron>& tetrahedra = split_[touched[i]].tetrahedra;
                for (std::size_t j = 0; j < tetrahedra.size(); ++j) {
                    const std::size_t before = parts.size();
                    if (std::count_if(tetrahedra[j].begin(), tetrahedra[j].end(),
                                      [&](NodeId corner) { return is_end[corner] != 0; }) < 2)
                        parts.push_back(tetrahedra[j]);
                    else
                        split(tetrahedra[j], middles, parts);
                    if (is_fine != nullptr)
                        are_fine.resize(parts.size(), parts.size() == before + 1 ? (*is_fine)[j] : 0);
                }
                tetrahedra = parts;
                if (is_fine != nullptr)
                    *is_fine = are_fine;
            }
        });
    }
}

/// The number of a cube that is split into tetrahedra, after it is split if it was plain; nothing for other cubes.
template <int Degree>
std::optional<std::uint32_t> TetrahedronMesher<Degree>::split_cube(const glm::ivec3& cube)
{
    if (const auto found = number_of_cube_.find(crossing_key(cube, 0)); found != number_of_cube_.end())
        return found->second;
    if (cubes_.kind(cube) != CubeKind::plain || !field_.surface().kept_cells().contains(cube / field_.subdivision()))
        return std::nullopt;
    cubes_.refine(cube);
    return add_cube(cube);
}

template void TetrahedronMesher<1>::refine(const std::vector<Box>&, double, const Progress&);
template void TetrahedronMesher<2>::refine(const std::vector<Box>&, double, const Progress&);
template void TetrahedronMesher<3>::refine(const std::vector<Box>&, double, const Progress&);

} // namespace isospline
