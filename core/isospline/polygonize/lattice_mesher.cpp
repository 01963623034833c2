#include "isospline/polygonize/lattice_mesher.h"

#include "isospline/polygonize/cube_loops.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

namespace isospline {

namespace {

/// Cubes along an edge of a chunk, the work of one task.
constexpr int chunk_size = 8;
constexpr int node_size = chunk_size + 1;

/// 8 x 8 x 8 cubes of the lattice, or fewer at the end of the grid.
struct Chunk {
    glm::ivec3 first, size;
};

/// Chunks of a brick.
std::vector<Chunk> chunks_of(const Brick& brick, const BrickCells& cells, int subdivision)
{
    std::vector<Chunk> chunks;
    const int cells_per_chunk = chunk_size / subdivision;
    glm::ivec3 at(0);
    for (at.z = 0; at.z < brick.size.z; at.z += cells_per_chunk)
        for (at.y = 0; at.y < brick.size.y; at.y += cells_per_chunk)
            for (at.x = 0; at.x < brick.size.x; at.x += cells_per_chunk) {
                const glm::ivec3 size = glm::min(glm::ivec3(cells_per_chunk), brick.size - at);
                bool has_cells = false;
                for (int z = at.z; z < at.z + size.z; ++z)
                    for (int y = at.y; y < at.y + size.y; ++y)
                        has_cells |= (cells[static_cast<std::size_t>(z)] >> (brick_size * y + at.x) &
                                      ((1u << size.x) - 1u)) != 0;
                if (has_cells)
                    chunks.push_back({(brick.first + at) * subdivision, size * subdivision});
            }
    return chunks;
}

/// Meshes one chunk after the other, in memory that it reuses.
template <int Degree>
class ChunkMesher {
public:
    ChunkMesher(const LatticeField<Degree>& field, const SpecialCubes& special)
        : field_(field), special_(special), metric_(field.surface().volume().lattice_to_world())
    {
        vertex_at_.fill(none);
    }

    /// `cells` are those of the brick that contains the chunk.
    MeshPart operator()(const Chunk& chunk, const Brick& brick, const BrickCells& cells);

private:
    static constexpr std::uint32_t none = 0xffffffff;

    static std::size_t place(const glm::ivec3& node)
    {
        return static_cast<std::size_t>(node.x + node_size * (node.y + node_size * node.z));
    }
    void fill_values(const Chunk& chunk);
    unsigned solid_corners(const glm::ivec3& cube) const;
    /// Bit i: the middle of face i is in the solid; for faces in `ambiguous`.
    unsigned joined_faces(const glm::ivec3& cube, unsigned ambiguous) const;
    /// Bit i: the cube behind face i is special, which splits the face.
    unsigned split_faces(const glm::ivec3& cube) const;
    /// A point of the surface in the middle of a loop.
    glm::dvec3 center_of_loop(const glm::ivec3& cube, std::span<const glm::dvec3> positions) const;
    void add_loop(const glm::ivec3& cube, std::span<const CubeEdge> loop);
    std::uint32_t vertex(const glm::ivec3& cube, CubeEdge edge);

    const LatticeField<Degree>& field_;
    const SpecialCubes& special_;
    LatticeMetric metric_;
    Chunk chunk_{};
    bool near_special_ = false;
    MeshPart part_;
    std::array<double, std::size_t{node_size} * node_size * node_size> values_;
    std::array<std::uint8_t, std::size_t{node_size} * node_size * node_size> solid_;
    std::array<std::uint32_t, std::size_t{node_size} * node_size * node_size * 8> vertex_at_;
    std::vector<std::size_t> used_;
    LoopTriangles triangles_;
};

/// The cell of a node along an axis, counted from `first_cell`, and the weights of its coefficients there. The last
/// cell has both of its ends.
template <int Degree>
struct NodeWeights {
    NodeWeights(int node, int subdivision, int cell_count, int first_cell)
        : cell(std::min(node / subdivision, cell_count - 1) - first_cell),
          weights(scalar::cell_weights<Degree>(static_cast<double>(node) / subdivision -
                                               static_cast<double>(cell + first_cell)))
    {
    }

    int cell;
    std::array<double, Degree + 1> weights;
};

/// The values at all nodes, axis by axis, with the sums of LatticeField::value() in the same order.
template <int Degree>
void ChunkMesher<Degree>::fill_values(const Chunk& chunk)
{
    constexpr auto count = static_cast<std::size_t>(Degree + 1);
    constexpr std::size_t most_rows = chunk_size + 1 + Degree;
    const Volume& volume = field_.surface().volume();
    const double threshold = field_.surface().threshold();
    const glm::ivec3 first_cell = chunk.first / field_.subdivision();
    const glm::ivec3 nodes = chunk.size + 1;
    std::array<std::vector<NodeWeights<Degree>>, 3> weights;
    glm::ivec3 rows;
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < nodes[axis]; ++i)
            weights[static_cast<std::size_t>(axis)].emplace_back(chunk.first[axis] + i, field_.subdivision(),
                                                                 volume.cell_shape()[axis], first_cell[axis]);
        rows[axis] = weights[static_cast<std::size_t>(axis)].back().cell + Degree + 1;
    }
    const CoefficientBox coefficients = volume.box(first_cell, rows - Degree);

    // Summed along y, then along z, then along x.
    double lines[most_rows][node_size][most_rows], planes[node_size][node_size][most_rows];
    for (int z = 0; z < rows.z; ++z) {
        double shifted[most_rows][most_rows];
        for (int y = 0; y < rows.y; ++y) {
            const float* const row = coefficients.from(0, y, z).first;
            for (int x = 0; x < rows.x; ++x)
                shifted[y][x] = static_cast<double>(row[x]) - threshold;
        }
        for (int y = 0; y < nodes.y; ++y) {
            const auto& [cell, w] = weights[1][static_cast<std::size_t>(y)];
            for (int x = 0; x < rows.x; ++x) {
                double sum = w[0] * shifted[cell][x];
                for (std::size_t j = 1; j < count; ++j)
                    sum = w[j] * shifted[static_cast<std::size_t>(cell) + j][x] + sum;
                lines[z][y][x] = sum;
            }
        }
    }
    for (int z = 0; z < nodes.z; ++z) {
        const auto& [cell, w] = weights[2][static_cast<std::size_t>(z)];
        for (int y = 0; y < nodes.y; ++y)
            for (int x = 0; x < rows.x; ++x) {
                double sum = 0.0;
                for (std::size_t k = 0; k < count; ++k)
                    sum = w[k] * lines[static_cast<std::size_t>(cell) + k][y][x] + sum;
                planes[z][y][x] = sum;
            }
    }
    for (int z = 0; z < nodes.z; ++z)
        for (int y = 0; y < nodes.y; ++y)
            for (int x = 0; x < nodes.x; ++x) {
                const auto& [cell, w] = weights[0][static_cast<std::size_t>(x)];
                double sum = 0.0;
                for (std::size_t i = 0; i < count; ++i)
                    sum = w[i] * planes[z][y][static_cast<std::size_t>(cell) + i] + sum;
                const std::size_t at = place({x, y, z});
                values_[at] = sum;
                solid_[at] = field_.is_solid(sum) ? 1 : 0;
            }
}

template <int Degree>
unsigned ChunkMesher<Degree>::solid_corners(const glm::ivec3& cube) const
{
    unsigned solid = 0;
    for (int corner = 0; corner < 8; ++corner)
        solid |= static_cast<unsigned>(solid_[place(cube + child_position(corner))]) << corner;
    return solid;
}

template <int Degree>
unsigned ChunkMesher<Degree>::joined_faces(const glm::ivec3& cube, unsigned ambiguous) const
{
    unsigned joined = 0;
    for (; ambiguous != 0; ambiguous &= ambiguous - 1u) {
        const int face = std::countr_zero(ambiguous);
        const auto corners = corners_of_face(face);
        const glm::ivec3 lower = chunk_.first + cube + child_position(corners[0]),
                         upper = chunk_.first + cube + child_position(corners[2]);
        const double value = field_.value(0.5 * (field_.position(lower) + field_.position(upper)));
        joined |= static_cast<unsigned>(field_.is_solid(value)) << face;
    }
    return joined;
}

template <int Degree>
unsigned ChunkMesher<Degree>::split_faces(const glm::ivec3& cube) const
{
    unsigned split = 0;
    for (int face = 0; face < 6; ++face) {
        glm::ivec3 behind = chunk_.first + cube;
        behind[face % 3] += face < 3 ? -1 : 1;
        split |= static_cast<unsigned>(special_.kind(behind) != CubeKind::plain) << face;
    }
    return split;
}

template <int Degree>
std::uint32_t ChunkMesher<Degree>::vertex(const glm::ivec3& cube, CubeEdge edge)
{
    const glm::ivec3 lower = cube + child_position(lower_corner(edge));
    const int direction = edge_direction(edge);
    const std::size_t at = 8 * place(lower) + static_cast<std::size_t>(direction);
    if (vertex_at_[at] != none)
        return vertex_at_[at];
    bool is_shared = near_special_;
    for (int axis = 0; axis < 3; ++axis)
        is_shared |= (direction >> axis & 1) == 0 && (lower[axis] == 0 || lower[axis] == chunk_.size[axis]);
    vertex_at_[at] = static_cast<std::uint32_t>(part_.vertices.size());
    used_.push_back(at);
    part_.vertices.push_back(field_.crossing(chunk_.first + lower, direction));
    part_.keys.push_back(is_shared ? crossing_key(chunk_.first + lower, direction) : no_key);
    return vertex_at_[at];
}

template <int Degree>
glm::dvec3 ChunkMesher<Degree>::center_of_loop(const glm::ivec3& cube, std::span<const glm::dvec3> positions) const
{
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& position : positions)
        middle += position / static_cast<double>(positions.size());
    const double edge = 1.0 / field_.subdivision();
    if (const auto projected = field_.project(middle, 0.5 * edge, metric_))
        return *projected;
    // Toward the nearest corner on the other side.
    const bool is_solid = field_.is_solid(field_.value(middle));
    glm::dvec3 nearest(0.0);
    double least = std::numeric_limits<double>::infinity();
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 node = cube + child_position(corner);
        const glm::dvec3 position = field_.position(chunk_.first + node);
        const double distance = glm::distance(position, middle);
        if ((solid_[place(node)] != 0) != is_solid && distance < least) {
            least = distance;
            nearest = position;
        }
    }
    return field_.crossing(middle, nearest);
}

template <int Degree>
void ChunkMesher<Degree>::add_loop(const glm::ivec3& cube, std::span<const CubeEdge> loop)
{
    std::array<std::uint32_t, 18> vertices;
    std::array<glm::dvec3, 18> positions;
    for (std::size_t i = 0; i < loop.size(); ++i) {
        vertices[i] = vertex(cube, loop[i]);
        positions[i] = part_.vertices[vertices[i]];
    }
    if (triangulate_loop(loop, {positions.data(), loop.size()}, triangles_)) {
        for (const auto& [a, b, c] : triangles_)
            part_.faces.push_back({vertices[a], vertices[b], vertices[c]});
        return;
    }
    const auto center = static_cast<std::uint32_t>(part_.vertices.size());
    part_.vertices.push_back(center_of_loop(cube, {positions.data(), loop.size()}));
    part_.keys.push_back(no_key);
    for (std::size_t i = 0; i < loop.size(); ++i)
        part_.faces.push_back({center, vertices[i], vertices[(i + 1) % loop.size()]});
}

template <int Degree>
MeshPart ChunkMesher<Degree>::operator()(const Chunk& chunk, const Brick& brick, const BrickCells& cells)
{
    chunk_ = chunk;
    part_ = {};
    near_special_ = !special_.all_plain_about(chunk.first, chunk.size);
    fill_values(chunk);
    glm::ivec3 cube;
    for (cube.z = 0; cube.z < chunk.size.z; ++cube.z)
        for (cube.y = 0; cube.y < chunk.size.y; ++cube.y)
            for (cube.x = 0; cube.x < chunk.size.x; ++cube.x) {
                const unsigned solid = solid_corners(cube);
                if (solid == 0 || solid == 255)
                    continue;
                const glm::ivec3 cell = (chunk.first + cube) / field_.subdivision() - brick.first;
                if ((cells[static_cast<std::size_t>(cell.z)] >> (cell.x + brick_size * cell.y) & 1u) == 0)
                    continue;
                if (near_special_ && special_.kind(chunk.first + cube) != CubeKind::plain)
                    continue;
                const unsigned joined = joined_faces(cube, CubeLoops::ambiguous_faces(solid));
                const unsigned split = near_special_ ? split_faces(cube) : 0;
                const CubeLoops loops = split != 0 ? CubeLoops(solid, joined, split) : CubeLoops::of(solid, joined);
                for (int i = 0; i < loops.count(); ++i)
                    add_loop(cube, loops.loop(i));
            }
    for (const std::size_t at : used_)
        vertex_at_[at] = none;
    used_.clear();
    return std::move(part_);
}

} // namespace

template <int Degree>
std::vector<MeshPart> march_cubes(const LatticeField<Degree>& field, const SpecialCubes& special,
                                  const CellFilter& filter, const Progress& progress)
{
    const Bricks& bricks = field.surface().bricks();
    std::vector<Brick> places;
    places.reserve(bricks.count());
    for (const Octet& octet : bricks.octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
            places.push_back(bricks.place(octet, std::countr_zero(rest)));

    std::vector<std::vector<MeshPart>> parts(places.size());
    parallel_for(
        places.size(), 16,
        [&](std::size_t begin, std::size_t end) {
            ChunkMesher<Degree> mesher(field, special);
            for (std::size_t i = begin; i < end; ++i) {
                const BrickCells chosen = chosen_cells(filter, places[i].first);
                if (chosen == BrickCells{})
                    continue;
                BrickCells cells = bricks.cells(places[i]);
                for (std::size_t z = 0; z < cells.size(); ++z)
                    cells[z] &= chosen[z];
                for (const Chunk& chunk : chunks_of(places[i], cells, field.subdivision()))
                    if (MeshPart part = mesher(chunk, places[i], cells); !part.faces.empty())
                        parts[i].push_back(std::move(part));
            }
        },
        progress);
    std::vector<MeshPart> all;
    for (std::vector<MeshPart>& of_brick : parts)
        std::move(of_brick.begin(), of_brick.end(), std::back_inserter(all));
    return all;
}

template std::vector<MeshPart> march_cubes(const LatticeField<1>&, const SpecialCubes&, const CellFilter&,
                                           const Progress&);
template std::vector<MeshPart> march_cubes(const LatticeField<2>&, const SpecialCubes&, const CellFilter&,
                                           const Progress&);
template std::vector<MeshPart> march_cubes(const LatticeField<3>&, const SpecialCubes&, const CellFilter&,
                                           const Progress&);

} // namespace isospline
