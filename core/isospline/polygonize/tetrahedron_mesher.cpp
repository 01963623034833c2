#include "isospline/polygonize/tetrahedron_mesher.h"

#include "isospline/cell/value_error.h"
#include "isospline/polygonize/cells_in_question.h"
#include "isospline/util/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace isospline {

template <int Degree>
NodeId TetrahedronMesher<Degree>::add_node(const glm::dvec3& position, bool is_of_lattice)
{
    check_count("surface", nodes_.size() + 1);
    // Where f equals the level on a whole face or edge, its rounded values have any sign.
    const PointInCell point(field_.surface(), position);
    const double largest = std::max({1.0, position.x, position.y, position.z});
    const double error = is_of_lattice ? 0.0 : value_error<Degree>(point.cell, 0x1p-51 * largest);
    const double value = field_.value(position);
    nodes_.push_back({position, field_.is_solid(std::abs(value) <= error ? 0.0 : value), is_of_lattice});
    return static_cast<NodeId>(nodes_.size() - 1);
}

template <int Degree>
NodeId TetrahedronMesher<Degree>::lattice_node(const glm::ivec3& node)
{
    const auto [found, is_new] = lattice_nodes_.try_emplace(crossing_key(node, 0), 0);
    if (is_new)
        found->second = add_node(field_.position(node), true);
    return found->second;
}

template <int Degree>
std::uint32_t TetrahedronMesher<Degree>::add_cube(const glm::ivec3& cube)
{
    const auto number = static_cast<std::uint32_t>(split_.size());
    number_of_cube_[crossing_key(cube, 0)] = number;
    SplitCube& added = split_.emplace_back(SplitCube{cube, {}});
    added.tetrahedra.reserve(6);
    static constexpr int orders[6][2] = {{0, 1}, {1, 2}, {2, 0}, {1, 0}, {2, 1}, {0, 2}}; // the last three are odd
    for (int order = 0; order < 6; ++order) {
        glm::ivec3 first = cube, second = cube;
        first[orders[order][0]] += 1;
        second[orders[order][0]] += 1;
        second[orders[order][1]] += 1;
        if (order >= 3)
            std::swap(first, second);
        added.tetrahedra.push_back(
            {lattice_node(cube), lattice_node(first), lattice_node(second), lattice_node(cube + 1)});
    }
    return number;
}

template <int Degree>
void TetrahedronMesher<Degree>::add_cut_cubes(const CellFilter& filter, const Progress& progress)
{
    if (cubes_.planes().all().empty())
        return;
    const int subdivision = field_.subdivision();
    const std::vector<BrickInQuestion> bricks = bricks_in_question(field_.surface());
    for (std::size_t i = 0; i < bricks.size(); ++i) {
        if (i % 1024 == 0)
            report(progress, static_cast<double>(i) / static_cast<double>(bricks.size()));
        const Brick& brick = bricks[i].brick;
        const BrickCells chosen = chosen_cells(filter, brick.first);
        if (chosen == BrickCells{} ||
            cubes_.kind_by_planes(brick.first * subdivision, brick.size * subdivision) != CubeKind::special)
            continue;
        for_each_cell_in_question(field_.surface(), bricks[i], chosen, [&](const glm::ivec3& cell, bool) {
            glm::ivec3 part;
            for (part.z = 0; part.z < subdivision; ++part.z)
                for (part.y = 0; part.y < subdivision; ++part.y)
                    for (part.x = 0; part.x < subdivision; ++part.x)
                        if (cubes_.kind(cell * subdivision + part) == CubeKind::special)
                            add_cube(cell * subdivision + part);
        });
    }
}

template <int Degree>
NodeId TetrahedronMesher<Degree>::cut(const HalfSpace& half_space, NodeId inner, NodeId outer)
{
    const auto [found, is_new] = cuts_.try_emplace(edge_id(inner, outer), 0);
    if (is_new) {
        const double above = distance(half_space, inner), below = distance(half_space, outer);
        const glm::dvec3 from = nodes_[inner].position, to = nodes_[outer].position;
        found->second = add_node(from + (above / (above - below)) * (to - from), false);
    }
    return found->second;
}

template <int Degree>
std::uint32_t TetrahedronMesher<Degree>::add_vertex(const glm::dvec3& position, CrossingKey key)
{
    part_.vertices.push_back(position);
    part_.keys.push_back(key);
    return static_cast<std::uint32_t>(part_.vertices.size() - 1);
}

template <int Degree>
std::uint32_t TetrahedronMesher<Degree>::vertex(NodeId node)
{
    const auto [found, is_new] = vertices_.try_emplace(node, 0);
    if (is_new)
        found->second = add_vertex(nodes_[node].position, no_key);
    return found->second;
}

template <int Degree>
std::uint32_t TetrahedronMesher<Degree>::crossing(NodeId a, NodeId b)
{
    const auto [found, is_new] = crossings_.try_emplace(edge_id(a, b), 0);
    if (!is_new)
        return found->second;
    const Node& first = nodes_[is_before(a, b) ? a : b];
    const Node& second = nodes_[is_before(a, b) ? b : a];
    if (first.is_of_lattice && second.is_of_lattice) {
        // The neighbouring cubes get it as well.
        const double steps = field_.subdivision();
        const glm::ivec3 from(glm::round(steps * first.position)), to(glm::round(steps * second.position));
        const glm::ivec3 lower = glm::min(from, to), change = glm::max(from, to) - lower;
        const int direction = change.x + 2 * change.y + 4 * change.z;
        found->second = add_vertex(field_.crossing(lower, direction), crossing_key(lower, direction));
    } else {
        found->second = add_vertex(field_.crossing(first.position, second.position), no_key);
    }
    return found->second;
}

template <int Degree>
void TetrahedronMesher<Degree>::add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c, FaceLabel label)
{
    part_.faces.push_back({a, b, c});
    part_.labels.push_back(label);
}

template <int Degree>
void TetrahedronMesher<Degree>::march(Tetrahedron corners)
{
    sort_corners(corners, [&](NodeId node) { return nodes_[node].is_solid ? 1 : 0; });
    const auto [a, b, c, d] = corners;
    const auto solid =
        std::count_if(corners.begin(), corners.end(), [&](NodeId node) { return nodes_[node].is_solid; });
    if (solid == 1) {
        add_face(crossing(a, b), crossing(a, c), crossing(a, d), on_isosurface);
    } else if (solid == 2) {
        const std::uint32_t ac = crossing(a, c), ad = crossing(a, d), bd = crossing(b, d), bc = crossing(b, c);
        add_face(ac, ad, bd, on_isosurface);
        add_face(ac, bd, bc, on_isosurface);
    } else if (solid == 3) {
        add_face(crossing(a, d), crossing(b, d), crossing(c, d), on_isosurface);
    }
}

template <int Degree>
void TetrahedronMesher<Degree>::add_caps(const Tetrahedron& corners)
{
    for (const auto& face : tetrahedron_faces) {
        std::array<NodeId, 3> at{corners[face[0]], corners[face[1]], corners[face[2]]};
        const auto on_plane = [&](FaceLabel index) {
            const HalfSpace& half_space = cubes_.planes().all()[index];
            return std::all_of(at.begin(), at.end(), [&](NodeId node) { return side(half_space, node) == 0; });
        };
        const auto cutting = std::find_if(cutting_.begin(), cutting_.end(), on_plane);
        if (cutting == cutting_.end() || !cubes_.planes().has_caps(*cutting))
            continue;
        const FaceLabel label = 1 + *cutting;
        const auto is_solid = [&](NodeId node) { return nodes_[node].is_solid; };
        const auto solid = std::count_if(at.begin(), at.end(), is_solid);
        if (solid == 0)
            continue;
        // The corner with the different sign comes first.
        while (solid < 3 && (is_solid(at[0]) != (solid == 1) || is_solid(at[1]) == (solid == 1)))
            std::rotate(at.begin(), at.begin() + 1, at.end());
        const auto [a, b, c] = at;
        if (solid == 3) {
            add_face(vertex(a), vertex(b), vertex(c), label);
        } else if (solid == 1) {
            add_face(vertex(a), crossing(a, b), crossing(a, c), label);
        } else {
            const std::uint32_t ab = crossing(a, b), ac = crossing(a, c), of_b = vertex(b), of_c = vertex(c);
            add_face(ab, of_b, of_c, label);
            add_face(ab, of_c, ac, label);
        }
    }
}

template <int Degree>
void TetrahedronMesher<Degree>::clip_and_march(const Tetrahedron& corners)
{
    whole_.assign(1, corners);
    cutting_.clear();
    for (std::size_t i = 0; i < cubes_.planes().all().size(); ++i) {
        const HalfSpace& half_space = cubes_.planes().all()[i];
        const auto side_of_node = [&](NodeId node) { return side(half_space, node); };
        if (std::all_of(corners.begin(), corners.end(), [&](NodeId node) { return side_of_node(node) > 0; }))
            continue;
        cutting_.push_back(static_cast<FaceLabel>(i));
        left_.clear();
        for (const Tetrahedron& tetrahedron : whole_)
            cut_tetrahedron(
                tetrahedron, side_of_node, [&](NodeId inner, NodeId outer) { return cut(half_space, inner, outer); },
                [this](NodeId a, NodeId b) { return is_before(a, b); },
                [&](const Tetrahedron& part) { left_.push_back(part); });
        whole_.swap(left_);
    }
    for (const Tetrahedron& tetrahedron : whole_) {
        march(tetrahedron);
        if (!cutting_.empty() && cubes_.planes().have_caps())
            add_caps(tetrahedron);
    }
}

template <int Degree>
MeshPart TetrahedronMesher<Degree>::march(const CellFilter& filter, const Progress& progress)
{
    crossings_.clear();
    vertices_.clear();
    part_ = {};
    for (std::size_t i = 0; i < split_.size(); ++i) {
        if (i % 16384 == 0)
            report(progress, static_cast<double>(i) / static_cast<double>(split_.size()));
        if (!is_chosen(filter, split_[i].at / field_.subdivision()))
            continue;
        for (const Tetrahedron& corners : split_[i].tetrahedra)
            clip_and_march(corners);
    }
    return std::move(part_);
}

template void TetrahedronMesher<1>::add_cut_cubes(const CellFilter&, const Progress&);
template std::uint32_t TetrahedronMesher<1>::add_cube(const glm::ivec3&);
template NodeId TetrahedronMesher<1>::add_node(const glm::dvec3&, bool);
template MeshPart TetrahedronMesher<1>::march(const CellFilter&, const Progress&);
template void TetrahedronMesher<2>::add_cut_cubes(const CellFilter&, const Progress&);
template std::uint32_t TetrahedronMesher<2>::add_cube(const glm::ivec3&);
template NodeId TetrahedronMesher<2>::add_node(const glm::dvec3&, bool);
template MeshPart TetrahedronMesher<2>::march(const CellFilter&, const Progress&);
template void TetrahedronMesher<3>::add_cut_cubes(const CellFilter&, const Progress&);
template std::uint32_t TetrahedronMesher<3>::add_cube(const glm::ivec3&);
template NodeId TetrahedronMesher<3>::add_node(const glm::dvec3&, bool);
template MeshPart TetrahedronMesher<3>::march(const CellFilter&, const Progress&);

} // namespace isospline
