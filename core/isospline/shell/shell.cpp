#include "isospline/shell/shell.h"

#include "isospline/brick/bricks.h"
#include "isospline/shell/cell_tree.h"
#include "isospline/shell/prune.h"
#include "isospline/util/lazy.h"
#include "isospline/util/parallel.h"

#include <bit>
#include <memory>
#include <span>

namespace isospline {

namespace {

/// Cells of a brick on the border of the volume.
BrickCells border_cells(const Brick& brick, const glm::ivec3& cell_shape)
{
    const glm::ivec3 last = cell_shape - 1 - brick.first;
    const bool first_x = brick.first.x == 0, first_y = brick.first.y == 0, first_z = brick.first.z == 0;
    std::uint64_t sides = 0;
    for (int i = 0; i < brick_size; ++i) {
        sides |= first_x ? std::uint64_t(1) << brick_size * i : 0;
        sides |= last.x < brick_size ? std::uint64_t(1) << (last.x + brick_size * i) : 0;
        sides |= first_y ? std::uint64_t(1) << i : 0;
        sides |= last.y < brick_size ? std::uint64_t(1) << (i + brick_size * last.y) : 0;
    }
    BrickCells border;
    for (int z = 0; z < brick_size; ++z)
        border[static_cast<std::size_t>(z)] = (first_z && z == 0) || z == last.z ? ~std::uint64_t(0) : sides;
    return border;
}

} // namespace

// Do not prune the border if the options ask for that.
void prune_bricks(const Volume& volume, double threshold, const ShellOptions& options, std::span<const Brick> bricks,
                  std::span<BrickCells> cells)
{
    if (options.prune_depth == 0)
        return;
    if (options.prune_border)
        return prune(volume, threshold, options.prune_depth, bricks, cells);

    std::vector<BrickCells> left(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const BrickCells border = border_cells(bricks[i], volume.cell_shape());
        for (std::size_t z = 0; z < border.size(); ++z) {
            left[i][z] = cells[i][z] & border[z];
            cells[i][z] &= ~border[z];
        }
    }
    prune(volume, threshold, options.prune_depth, bricks, cells);
    for (std::size_t i = 0; i < cells.size(); ++i)
        for (std::size_t z = 0; z < cells[i].size(); ++z)
            cells[i][z] |= left[i][z];
}

Shell::Shell() : tree_(std::make_shared<Lazy<CellTree>>())
{
}

Shell::Shell(const Volume& volume, const Bricks& all, const ShellOptions& options, const Progress& progress) : Shell()
{
    std::vector<Brick> bricks;
    bricks.reserve(all.count());
    for (const Octet& octet : all.octets())
        for (unsigned rest = octet.bricks; rest != 0; rest &= rest - 1u)
            bricks.push_back(all.place(octet, std::countr_zero(rest)));

    // The set of cells of each brick. Chunks of bricks are small enough for their coefficients to stay in the cache
    // from one step to the next.
    std::vector<BrickCells> cells(bricks.size());
    parallel_for(
        bricks.size(), 16,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                cells[i] = all.cells(bricks[i]);
            prune_bricks(volume, all.threshold(), options, std::span(bricks).subspan(begin, end - begin),
                         std::span(cells).subspan(begin, end - begin));
        },
        progress);

    // Concatenate all sets.
    std::vector<std::size_t> begin_of_brick(bricks.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < bricks.size(); ++i) {
        begin_of_brick[i] = count;
        count += count_cells(cells[i]);
    }
    cells_.resize(count);
    parallel_for(bricks.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Cell* next = cells_.data() + begin_of_brick[i];
            for_each_cell_by_blocks(cells[i], [&](int x, int y, int z) {
                const glm::ivec3 cell = bricks[i].first + glm::ivec3(x, y, z);
                *next++ = {static_cast<std::uint16_t>(cell.x), static_cast<std::uint16_t>(cell.y),
                           static_cast<std::uint16_t>(cell.z)};
            });
        }
    });
}

const CellTree& Shell::tree(const Progress& progress) const
{
    return tree_->get(progress, [&] { return CellTree(cells_, progress); });
}

} // namespace isospline
