#include "isospline/brick/cell_set.h"

#include "isospline/spline/volume.h"
#include "isospline/util/parallel.h"

#include <algorithm>

namespace isospline {

CellSet::CellSet(const Mask& mask, const Volume& volume, const Progress& progress)
{
    if (mask.empty())
        return;
    const auto cells_of = [&](std::size_t, const Brick& brick) {
        BrickCells cells = all_cells(brick.size);
        cut_by_mask(cells, brick, mask, volume);
        return cells;
    };
    *this = CellSet(volume.cell_shape(), cells_of, progress);
}

CellSet::CellSet(const glm::ivec3& cell_shape, const std::function<BrickCells(std::size_t, const Brick&)>& cells_of,
                 const Progress& progress)
    : shape_(brick_shape(cell_shape)), bricks_(static_cast<std::size_t>(place_count(shape_)))
{
    // Chunks of bricks, each with a list of its own.
    constexpr std::size_t chunk_size = 256;
    std::vector<std::vector<BrickCells>> chunks((bricks_.size() + chunk_size - 1) / chunk_size);
    const auto for_each_brick = [&](std::size_t chunk, const auto& visit) {
        for (std::size_t i = chunk * chunk_size; i < std::min((chunk + 1) * chunk_size, bricks_.size()); ++i)
            visit(i);
    };
    parallel_for(
        chunks.size(), 1,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t chunk = begin; chunk < end; ++chunk)
                for_each_brick(chunk, [&](std::size_t i) {
                    const Brick brick = brick_at(cell_shape, at_place(shape_, i));
                    const BrickCells cells = cells_of(i, brick);
                    if (cells == BrickCells{}) {
                        bricks_[i] = none;
                    } else if (cells == all_cells(brick.size)) {
                        bricks_[i] = all;
                    } else {
                        bricks_[i] = first_mixed;
                        chunks[chunk].push_back(cells);
                    }
                });
        },
        progress);

    std::size_t mixed_count = 0;
    for (const std::vector<BrickCells>& chunk : chunks)
        mixed_count += chunk.size();
    mixed_.reserve(mixed_count);
    for (std::size_t chunk = 0; chunk < chunks.size(); ++chunk) {
        auto next = static_cast<std::uint32_t>(mixed_.size());
        for_each_brick(chunk, [&](std::size_t i) {
            if (bricks_[i] == first_mixed)
                bricks_[i] += next++;
        });
        mixed_.insert(mixed_.end(), chunks[chunk].begin(), chunks[chunk].end());
    }
}

} // namespace isospline
