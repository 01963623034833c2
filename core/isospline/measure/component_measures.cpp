#include "isospline/measure/component_measures.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

namespace isospline {

namespace {

double volume_of(const Integrals& integrals)
{
    return integrals.value[static_cast<std::size_t>(Quantity::volume)];
}

double error_of(const Integrals& integrals)
{
    return integrals.error[static_cast<std::size_t>(Quantity::volume)];
}

/// Calls `visit(i)` for the components that are certainly among the `count` largest, and `contest(i)` for those that
/// may be. A component's volume is at least that of its inside cells, and at most that of all its cells.
template <typename Visit, typename Contest>
void rank_by_cells(const std::vector<ComponentCount>& counts, std::size_t count, const Visit& visit,
                   const Contest& contest)
{
    std::vector<std::uint64_t> least, most;
    for (const ComponentCount& each : counts) {
        least.push_back(each.inside);
        most.push_back(each.cells);
    }
    std::sort(least.begin(), least.end(), std::greater<>());
    std::sort(most.begin(), most.end(), std::greater<>());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        // The components, including this one, that may be at least as large as its lower bound.
        const auto others = std::upper_bound(most.begin(), most.end(), counts[i].inside, std::greater<>());
        if (static_cast<std::size_t>(others - most.begin()) <= count)
            visit(i);
        else if (counts[i].cells >= least[count - 1])
            contest(i);
    }
}

} // namespace

std::vector<MeasuredComponent> measure_components(Solid solid, const IntegralOptions& options, const Progress& progress)
{
    solid.planes = solid.planes.without_clip();
    const Components components(solid, part_of(progress, 0.0, 0.2));
    const std::vector<Integrals> integrals = integrate(solid, components, options, part_of(progress, 0.2, 1.0));
    std::vector<MeasuredComponent> measured;
    for (std::size_t i = 0; i < integrals.size(); ++i)
        if (volume_of(integrals[i]) > 0.0)
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

    // For most components, the cells decide; the others have to be measured.
    std::vector<std::uint8_t> is_contested(counts.size(), 0);
    std::vector<std::size_t> contested;
    std::size_t left = count;
    rank_by_cells(
        counts, count,
        [&](std::size_t i) {
            is_wanted[i] = 1;
            --left;
        },
        [&](std::size_t i) {
            is_contested[i] = 1;
            contested.push_back(i);
        });
    if (left > 0 && left < contested.size()) {
        const CellSet cells = components.cells(is_contested, solid.cells);
        const Solid part{solid.volume, solid.ranges, solid.threshold, solid.sign, cells, {}};
        // Rough volumes decide, unless one that is kept and one that is not are too close.
        for (const int order : {2, 4}) {
            const auto integrals = integrate(part, components, {.order = order, .surface = false},
                                             order == 2 ? part_of(progress, 0.5, 0.7) : part_of(progress, 0.7, 1.0));
            std::sort(contested.begin(), contested.end(), [&](std::size_t i, std::size_t j) {
                return std::pair(-volume_of(integrals[i]), i) < std::pair(-volume_of(integrals[j]), j);
            });
            double least_kept = std::numeric_limits<double>::infinity(), most_left_out = 0.0;
            for (std::size_t rank = 0; rank < contested.size(); ++rank) {
                const Integrals& each = integrals[contested[rank]];
                if (rank < left)
                    least_kept = std::min(least_kept, volume_of(each) - error_of(each));
                else
                    most_left_out = std::max(most_left_out, volume_of(each) + error_of(each));
            }
            if (least_kept > most_left_out)
                break;
        }
    }
    contested.resize(std::min(left, contested.size()));
    for (const std::size_t i : contested)
        is_wanted[i] = 1;
    return components.cells(is_wanted, solid.cells);
}

} // namespace isospline
