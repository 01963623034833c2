// The repetition of collapses by a Simplification.
#include "isospline/math/point_triangle.h"
#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/covering.h"
#include "isospline/polygonize/simplification.h"
#include "isospline/util/progress.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <unordered_set>

namespace isospline {

template <int Degree>
void Simplification<Degree>::repeat(const std::vector<Collapse>& history, const Progress& progress)
{
    // Where all neighbours are as they were in the earlier run, a collapse is as valid as it was then. Where the mesh
    // is a different one, vertices are queued again, and faces nearby may cross.
    constexpr double block = 0.25; // one of this number in a cell, as in cubes_of()
    is_queued_.assign(lattice_.size(), 0);
    std::unordered_set<CrossingKey> different;
    const auto is_far_from_different = [&](const Box& box) {
        const std::unordered_set<CrossingKey> blocks = cubes_of({box}, block, 0.0);
        return std::all_of(blocks.begin(), blocks.end(), [&](CrossingKey key) { return different.count(key) == 0; });
    };
    for (std::size_t step = 0; step < history.size(); ++step) {
        if (step % 1024 == 0)
            report(progress, static_cast<double>(step) / static_cast<double>(history.size()));
        const auto [from, to] = history[step];
        find_neighbors(from);
        Box around{lattice_[from], lattice_[from]};
        bool is_same = !is_locked(from) && is_queued_[from] == 0;
        for (const std::uint32_t neighbor : neighbors_) {
            around.extend(lattice_[neighbor]);
            is_same = is_same && is_queued_[neighbor] == 0;
        }
        if (is_same && keeps_shape(from, to) && (is_far_from_different(around) || !crosses_others())) {
            moved_.clear();
            collapse(from, to);
            continue;
        }
        is_queued_[from] = 1;
        for (const std::uint32_t neighbor : neighbors_)
            is_queued_[neighbor] = 1;
        different.merge(cubes_of({around}, block, 0.0));
    }

    // Give removed vertices around these places to the nearest faces.
    const glm::dvec3 reach = box_of_ball(metric_, simplicity_.of_vertices);
    for (const Collapse& done : history_) {
        const glm::dvec3& sample = lattice_[done.from];
        if (is_far_from_different({sample - 1.0 / block, sample + 1.0 / block}))
            continue;
        double least = std::numeric_limits<double>::infinity();
        std::uint32_t nearest = none;
        octree_.visit({sample - reach, sample + reach}, [&](std::uint32_t index) {
            const auto [a, b, c] = corners(world_, editable_.faces()[index]);
            const glm::dvec3 difference = world_[done.from] - closest_point_of_triangle(world_[done.from], a, b, c);
            if (const double square = glm::dot(difference, difference); square < least) {
                least = square;
                nearest = index;
            }
            return true;
        });
        if (nearest != none) {
            next_sample_[done.from] = first_sample_[nearest];
            first_sample_[nearest] = done.from;
        }
    }
}

template void Simplification<1>::repeat(const std::vector<Collapse>&, const Progress&);
template void Simplification<2>::repeat(const std::vector<Collapse>&, const Progress&);
template void Simplification<3>::repeat(const std::vector<Collapse>&, const Progress&);

} // namespace isospline
