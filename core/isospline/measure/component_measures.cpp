#include "isospline/measure/component_measures.h"

#include "isospline/measure/volume_bounds.h"
#include "isospline/spline/degree.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

namespace isospline {

namespace {

double volume_of(const Integrals& integrals)
{
    return integrals.value[index_of(Quantity::volume)];
}

/// Cells are halved at most this many times along each axis to bound volumes.
constexpr int deepest_bounds = 2;

/// Bounds of the volume of the solid in some cells of a brick, in cells.
Extremes<double> bounds_in_cells(const Solid& solid, const Brick& brick, const BrickCells& cells, int depth)
{
    if (side_of(solid, brick) == Side::inside) {
        const auto count = static_cast<double>(count_cells(cells));
        return {count, count};
    }
    Extremes<double> sum{0.0, 0.0};
    dispatch_degree(solid.volume.degree(), [&](auto degree) {
        for_each_cell(cells, [&](int x, int y, int z) {
            const VolumeCell cell(solid.volume, solid.threshold, brick.first + glm::ivec3(x, y, z));
            const auto [least, most] = volume_bounds<degree>(bernstein_of<degree>(cell), solid.sign, depth);
            sum.least += least;
            sum.most += most;
        });
    });
    return sum;
}

/// Bounds of the volumes of components, in cells.
using VolumeBounds = std::vector<Extremes<double>>;

/// What bounds say about the `count` largest of some items.
struct Ranking {
    std::vector<std::size_t> largest;   ///< those that are certainly among them
    std::vector<std::size_t> contested; ///< those that may be
};

Ranking rank(const std::vector<std::size_t>& items, std::size_t count, const VolumeBounds& bounds)
{
    std::vector<double> least, most;
    for (const std::size_t item : items) {
        least.push_back(bounds[item].least);
        most.push_back(bounds[item].most);
    }
    std::sort(least.begin(), least.end(), std::greater<>());
    std::sort(most.begin(), most.end(), std::greater<>());
    Ranking ranking;
    for (const std::size_t item : items) {
        // The items, including this one, that may be at least as large as its lower bound.
        const auto others = std::upper_bound(most.begin(), most.end(), bounds[item].least, std::greater<>());
        if (static_cast<std::size_t>(others - most.begin()) <= count)
            ranking.largest.push_back(item);
        else if (bounds[item].most >= least[count - 1])
            ranking.contested.push_back(item);
    }
    return ranking;
}

/// Bounds of the volumes of some components, in cells; those of the others stay as they are.
void bound_volumes(const Solid& solid, const Components& components, const std::vector<std::size_t>& items, int depth,
                   VolumeBounds& bounds, const Progress& progress)
{
    std::vector<std::uint8_t> is_wanted(components.counts().size(), 0);
    for (const std::size_t item : items) {
        is_wanted[item] = 1;
        bounds[item] = {0.0, 0.0};
    }
    const glm::ivec3 shape = solid.volume.cell_shape(), bricks = brick_shape(shape);
    VolumeBounds of_pieces(components.pieces().size(), {0.0, 0.0});
    parallel_for(
        static_cast<std::size_t>(place_count(bricks)), 8,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Brick brick = brick_at(shape, at_place(bricks, i));
                for (std::size_t piece = components.first_piece(i); piece < components.first_piece(i + 1); ++piece)
                    if (is_wanted[components.pieces()[piece].component] != 0)
                        of_pieces[piece] = bounds_in_cells(solid, brick, components.pieces()[piece].cells, depth);
            }
        },
        progress);
    // The same sums in the same order for any number of threads.
    for (std::size_t piece = 0; piece < of_pieces.size(); ++piece) {
        Extremes<double>& sum = bounds[components.pieces()[piece].component];
        sum.least += of_pieces[piece].least;
        sum.most += of_pieces[piece].most;
    }
    // More than what rounding can do: components of one shape and size stay contested.
    for (const std::size_t item : items) {
        bounds[item].least *= 1.0 - 1e-9;
        bounds[item].most *= 1.0 + 1e-9;
    }
}

} // namespace

std::vector<MeasuredComponent> measure_components(const Solid& solid, const IntegralOptions& options,
                                                  const Progress& progress)
{
    const Components components(solid, part_of(progress, 0.0, 0.2));
    const std::vector<Integrals> integrals = integrate(solid, components, options, part_of(progress, 0.2, 1.0));
    std::vector<MeasuredComponent> measured;
    for (std::size_t i = 0; i < integrals.size(); ++i)
        measured.push_back({components.counts()[i], integrals[i]});
    std::stable_sort(measured.begin(), measured.end(), [](const MeasuredComponent& a, const MeasuredComponent& b) {
        return volume_of(a.integrals) > volume_of(b.integrals);
    });
    return measured;
}

std::vector<MeasuredComponent> count_components(const Solid& solid, const Progress& progress)
{
    const Components components(solid, progress);
    std::vector<MeasuredComponent> counted;
    for (const ComponentCount& count : components.counts())
        counted.push_back({count, {}});
    std::stable_sort(counted.begin(), counted.end(), [](const MeasuredComponent& a, const MeasuredComponent& b) {
        return std::pair(a.count.inside, a.count.cells) > std::pair(b.count.inside, b.count.cells);
    });
    return counted;
}

CellSet largest_components(const Solid& solid, std::size_t count, const Progress& progress)
{
    const Components components(solid, part_of(progress, 0.0, 0.5));
    const std::vector<ComponentCount>& counts = components.counts();
    if (counts.size() <= count)
        return solid.cells;
    std::vector<std::uint8_t> is_wanted(counts.size(), 0);
    if (count == 0)
        return components.cells(is_wanted, solid.cells);

    // For most components, the cells decide: a component's volume is at least that of its inside cells, and at most
    // that of all its cells. Bounds of ever smaller parts of cells decide between the others, and at last volumes.
    std::vector<std::size_t> contested(counts.size());
    std::iota(contested.begin(), contested.end(), std::size_t{0});
    VolumeBounds bounds;
    for (const ComponentCount& each : counts)
        bounds.push_back({static_cast<double>(each.inside), static_cast<double>(each.cells)});
    std::size_t left = count;
    const auto decide = [&] {
        const Ranking ranking = rank(contested, left, bounds);
        for (const std::size_t i : ranking.largest)
            is_wanted[i] = 1;
        left -= ranking.largest.size();
        contested = ranking.contested;
        return left == 0 || contested.size() <= left;
    };
    bool is_decided = decide();
    for (int depth = 0; depth <= deepest_bounds && !is_decided; ++depth) {
        const double begin = 0.5 + 0.1 * depth;
        bound_volumes(solid, components, contested, depth, bounds, part_of(progress, begin, begin + 0.1));
        is_decided = decide();
    }
    if (!is_decided) {
        std::vector<std::uint8_t> is_contested(counts.size(), 0);
        for (const std::size_t i : contested)
            is_contested[i] = 1;
        const CellSet cells = components.cells(is_contested, solid.cells);
        const IntegralOptions volumes{.order = 4, .wanted = {true, false, false, false}};
        const Solid part{solid.volume, solid.ranges, solid.threshold, solid.sign, cells, {}};
        const auto integrals = integrate(part, components, volumes, part_of(progress, 0.8, 1.0));
        std::sort(contested.begin(), contested.end(), [&](std::size_t i, std::size_t j) {
            return std::pair(-volume_of(integrals[i]), i) < std::pair(-volume_of(integrals[j]), j);
        });
    }
    contested.resize(std::min(left, contested.size()));
    for (const std::size_t i : contested)
        is_wanted[i] = 1;
    return components.cells(is_wanted, solid.cells);
}

} // namespace isospline
