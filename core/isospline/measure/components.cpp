#include "isospline/measure/components.h"

#include "isospline/measure/brick_solid.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <vector>

namespace isospline {

namespace {

/// The cells of a brick that are connected to a given one within the brick.
BrickCells connected_cells(BrickCells cells, const BrickSolid& solid)
{
    const auto& [x_links, y_links, z_links] = solid.links;
    while (true) {
        BrickCells grown = cells;
        for (std::size_t z = 0; z < cells.size(); ++z) {
            // Each step stays in the set: a link may lead to a cell outside of it, where the search must not continue.
            const std::uint64_t all = solid.cells[z];
            const std::uint64_t along_x = x_links[z] & 0x7f7f7f7f7f7f7f7fu, along_y = y_links[z];
            std::uint64_t& word = grown[z];
            word |= ((word & along_x) << 1 | (word >> 1 & along_x)) & all;
            word |= ((word & along_y) << brick_size | (word >> brick_size & along_y)) & all;
            word |= (z > 0 ? grown[z - 1] & z_links[z - 1] : 0) & all;
            word |= (z + 1 < cells.size() ? cells[z + 1] & z_links[z] : 0) & all;
        }
        if (grown == cells)
            return cells;
        cells = grown;
    }
}

/// The cells of a set on a side of the brick across an axis, 8 x 8 bits.
std::uint64_t side_cells(const BrickCells& cells, int axis, bool upper)
{
    if (axis == 2)
        return upper ? cells.back() : cells.front();
    std::uint64_t side = 0;
    for (std::size_t z = 0; z < cells.size(); ++z) {
        std::uint64_t row = cells[z] >> (upper ? (axis == 0 ? brick_size - 1 : brick_size * (brick_size - 1)) : 0);
        if (axis == 0) // the first bit of each byte, side by side
            row = (row & 0x0101010101010101u) * 0x0102040810204080u >> (64 - brick_size);
        side |= (row & 0xffu) << brick_size * z;
    }
    return side;
}

/// Connected cells of a brick.
struct FoundPiece {
    BrickCells cells;
    std::size_t inside; ///< number of cells that are completely in the solid
    bool is_certain;    ///< whether the solid in them is more than points at which f may touch the level
};

std::size_t count_common(const BrickCells& first, const BrickCells& second)
{
    std::size_t count = 0;
    for (std::size_t z = 0; z < first.size(); ++z)
        count += static_cast<std::size_t>(std::popcount(first[z] & second[z]));
    return count;
}

/// Adds the pieces of a brick to a list, in the order of their first cells; returns how many there are.
std::size_t add_pieces(const BrickSolid& in_brick, std::vector<FoundPiece>& to)
{
    const std::size_t before = to.size();
    BrickCells left = in_brick.cells;
    for (std::size_t z = 0; z < left.size(); ++z)
        while (left[z] != 0) {
            BrickCells seed{};
            seed[z] = left[z] & -left[z];
            const BrickCells piece = connected_cells(seed, in_brick);
            to.push_back({piece, count_common(piece, in_brick.inside), count_common(piece, in_brick.certain) > 0});
            for (std::size_t i = z; i < left.size(); ++i)
                left[i] &= ~piece[i];
        }
    return to.size() - before;
}

/// The lattice box of some cells of a brick.
Box box_of(const BrickCells& cells, const Brick& brick)
{
    std::uint64_t all = 0;
    unsigned slices = 0;
    for (std::size_t z = 0; z < cells.size(); ++z) {
        all |= cells[z];
        slices |= static_cast<unsigned>(cells[z] != 0) << z;
    }
    if (all == 0)
        return {};
    unsigned columns = 0, rows = 0; // bit i: some cell is at x or y = i
    for (int y = 0; y < brick_size; ++y) {
        const auto row = static_cast<unsigned>(all >> brick_size * y & 0xffu);
        columns |= row;
        rows |= static_cast<unsigned>(row != 0) << y;
    }
    const auto first = [](unsigned bits) { return std::countr_zero(bits); };
    const auto end = [](unsigned bits) { return static_cast<int>(std::bit_width(bits)); };
    return {glm::dvec3(brick.first + glm::ivec3(first(columns), first(rows), first(slices))),
            glm::dvec3(brick.first + glm::ivec3(end(columns), end(rows), end(slices)))};
}

/// The cells of a brick that share a corner with a cell of a set, or are in it.
BrickCells cells_next_to(const CellSet& set, const Brick& brick, const glm::ivec3& cell_shape)
{
    const glm::ivec3 first = glm::max(brick.first - 1, glm::ivec3(0));
    const glm::ivec3 last = glm::min(brick.first + brick.size, cell_shape - 1);
    bool is_near_any = false;
    glm::ivec3 at;
    for (at.z = first.z; at.z <= last.z + brick_size - 1; at.z += brick_size)
        for (at.y = first.y; at.y <= last.y + brick_size - 1; at.y += brick_size)
            for (at.x = first.x; at.x <= last.x + brick_size - 1; at.x += brick_size)
                is_near_any |= !set.has_none_of(brick_at(cell_shape, glm::min(at, last) / brick_size));
    BrickCells near{};
    if (!is_near_any)
        return near;
    for (at.z = first.z; at.z <= last.z; ++at.z)
        for (at.y = first.y; at.y <= last.y; ++at.y)
            for (at.x = first.x; at.x <= last.x; ++at.x) {
                if (!set.contains(at))
                    continue;
                const glm::ivec3 from = glm::max(at - 1 - brick.first, glm::ivec3(0));
                const glm::ivec3 to = glm::min(at + 1 - brick.first, brick.size - 1);
                for (int z = from.z; z <= to.z; ++z)
                    for (int y = from.y; y <= to.y; ++y)
                        for (int x = from.x; x <= to.x; ++x)
                            near[static_cast<std::size_t>(z)] |= bit_of({x, y, z});
            }
    return near;
}

/// Disjoint sets, each represented by its smallest item.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t count) : parent_(count)
    {
        for (std::size_t i = 0; i < count; ++i)
            parent_[i] = i;
    }

    std::size_t find(std::size_t i)
    {
        while (parent_[i] != i)
            i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::size_t a, std::size_t b)
    {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<std::size_t> parent_;
};

} // namespace

Mask mask_of_cells(const Solid& solid, const Progress& progress)
{
    const CellSet cells(
        solid.volume.cell_shape(), [&](std::size_t, const Brick& brick) { return solid_in(solid, brick).cells; },
        part_of(progress, 0.0, 0.8));
    const auto is_kept = [&](const glm::ivec3& sample) {
        const auto [first, last] = solid.volume.cells_with(sample);
        return cells.contains_any(first, last);
    };
    return make_mask(solid.volume.shape(), is_kept, part_of(progress, 0.8, 1.0));
}

Components::Components(const Solid& solid, const Progress& progress) : cell_shape_(solid.volume.cell_shape())
{
    // The pieces in each brick; chunks of bricks, each with lists of its own.
    constexpr std::size_t chunk_size = 64;
    const glm::ivec3 shape = brick_shape(cell_shape_);
    const auto brick_count = static_cast<std::size_t>(place_count(shape));
    std::vector<std::vector<FoundPiece>> chunks((brick_count + chunk_size - 1) / chunk_size);
    std::vector<std::array<std::uint64_t, 3>> upper_links(brick_count);
    first_piece_.resize(brick_count + 1);
    parallel_for(
        chunks.size(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin * chunk_size; i < std::min(end * chunk_size, brick_count); ++i) {
                const BrickSolid in_brick = solid_in(solid, brick_at(cell_shape_, at_place(shape, i)));
                for (int axis = 0; axis < 3; ++axis)
                    upper_links[i][static_cast<std::size_t>(axis)] =
                        side_cells(in_brick.links[static_cast<std::size_t>(axis)], axis, true);
                first_piece_[i + 1] = add_pieces(in_brick, chunks[i / chunk_size]);
            }
        },
        progress);
    std::partial_sum(first_piece_.begin(), first_piece_.end(), first_piece_.begin());
    std::vector<FoundPiece> found;
    found.reserve(first_piece_.back());
    for (std::vector<FoundPiece>& chunk : chunks) {
        found.insert(found.end(), chunk.begin(), chunk.end());
        chunk = {};
    }

    // Join the pieces that meet at faces of bricks.
    DisjointSets sets(found.size());
    for (std::size_t i = 0; i < brick_count; ++i) {
        const glm::ivec3 at = at_place(shape, i);
        for (int axis = 0; axis < 3; ++axis) {
            if (at[axis] + 1 == shape[axis])
                continue;
            glm::ivec3 next = at;
            ++next[axis];
            const std::uint64_t links = upper_links[i][static_cast<std::size_t>(axis)];
            const auto other = static_cast<std::size_t>(place_in(shape, next));
            for (std::size_t lower = first_piece_[i]; lower < first_piece_[i + 1]; ++lower)
                if (const std::uint64_t side = side_cells(found[lower].cells, axis, true) & links; side != 0)
                    for (std::size_t upper = first_piece_[other]; upper < first_piece_[other + 1]; ++upper)
                        if ((side_cells(found[upper].cells, axis, false) & side) != 0)
                            sets.join(lower, upper);
        }
    }

    // Leave out components of which nothing is certain.
    std::vector<std::uint8_t> is_certain(found.size(), 0);
    for (std::size_t i = 0; i < found.size(); ++i)
        is_certain[sets.find(i)] |= static_cast<std::uint8_t>(found[i].is_certain);

    // Number the others, and count their cells. The first piece of a component comes before its others.
    std::vector<std::size_t> number_of(found.size());
    pieces_.reserve(found.size());
    for (std::size_t brick = 0, i = 0; brick < brick_count; ++brick) {
        for (const std::size_t end = first_piece_[brick + 1]; i < end; ++i) {
            const std::size_t first = sets.find(i);
            if (is_certain[first] == 0)
                continue;
            if (first == i) {
                number_of[i] = counts_.size();
                counts_.emplace_back();
            }
            pieces_.push_back({found[i].cells, number_of[first]});
            ComponentCount& count = counts_[number_of[first]];
            count.cells += count_cells(found[i].cells);
            count.inside += found[i].inside;
            count.box_lattice.extend(box_of(found[i].cells, brick_at(cell_shape_, at_place(shape, brick))));
        }
        first_piece_[brick + 1] = pieces_.size();
    }
}

CellSet Components::cells(const std::vector<std::uint8_t>& is_wanted, const CellSet& among,
                          const Progress& progress) const
{
    const auto cells_of = [&](std::size_t brick, bool any_component) {
        BrickCells cells{};
        for (std::size_t i = first_piece_[brick]; i < first_piece_[brick + 1]; ++i)
            if (any_component || is_wanted[pieces_[i].component] != 0)
                for (std::size_t z = 0; z < cells.size(); ++z)
                    cells[z] |= pieces_[i].cells[z];
        return cells;
    };
    const CellSet wanted(
        cell_shape_, [&](std::size_t i, const Brick&) { return cells_of(i, false); }, part_of(progress, 0.0, 0.5));
    const auto with_neighbors = [&](std::size_t i, const Brick& brick) {
        BrickCells cells = wanted.cells(brick);
        if (wanted.has_all_of(brick))
            return cells;
        const BrickCells of_components = cells_of(i, true), near = cells_next_to(wanted, brick, cell_shape_);
        const BrickCells possible = among.cells(brick);
        for (std::size_t z = 0; z < cells.size(); ++z)
            cells[z] |= near[z] & possible[z] & ~of_components[z];
        return cells;
    };
    return CellSet(cell_shape_, with_neighbors, part_of(progress, 0.5, 1.0));
}

} // namespace isospline
