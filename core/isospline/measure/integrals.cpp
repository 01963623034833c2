#include "isospline/measure/integrals.h"

#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace isospline {

namespace {

/// Integrates over the cells of bricks, one brick at a time.
class BrickIntegrals {
public:
    BrickIntegrals(const Solid& solid, const IntegralOptions& options)
        : solid_(solid), options_(options),
          quadrature_(solid.volume.degree(),
                      {options.order, options.surface, options.curvature, solid.volume.lattice_to_world()}),
          cell_volume_(std::abs(glm::determinant(glm::dmat3(solid.volume.lattice_to_world()))))
    {
    }

    template <typename Visit>
    void visit_cells(const Brick& brick, Side side, const Visit& visit)
    {
        for (int z = 0; z < brick.size.z; ++z)
            for (int y = 0; y < brick.size.y; ++y)
                for (int x = 0; x < brick.size.x; ++x) {
                    const glm::ivec3 cell = brick.first + glm::ivec3(x, y, z);
                    if (solid_.cells.contains(cell))
                        visit_cell(cell, side, visit);
                }
    }

    /// Whether the clip or the set of cells can remove anything from a brick.
    bool is_cut(const Brick& brick) const
    {
        return !solid_.cells.has_all_of(brick) || std::any_of(planes().begin(), planes().end(), [&](const auto& plane) {
            return !is_inside(box_of(brick), plane);
        });
    }

private:
    /// Those that matter: the border of the domain only has area.
    const std::vector<HalfSpace>& planes() const
    {
        return options_.surface ? solid_.planes.all() : solid_.planes.clip();
    }

    template <typename Visit>
    void visit_cell(const glm::ivec3& at, Side side, const Visit& visit)
    {
        const VolumeCell cell(solid_.volume, solid_.threshold, at);
        if (side == Side::unknown)
            side = side_of_cell(cell);
        if (side == Side::outside)
            return;
        crossing_.clear();
        has_caps_.clear();
        const Box box{cell.lower, cell.lower + 1.0};
        for (std::size_t i = 0; i < planes().size(); ++i) {
            const HalfSpace& plane = planes()[i];
            if (is_outside(box, plane))
                return;
            if (is_inside(box, plane) || std::find(crossing_.begin(), crossing_.end(), plane) != crossing_.end())
                continue;
            crossing_.push_back(plane);
            has_caps_.push_back(options_.surface && solid_.planes.has_caps(i));
        }
        if (side == Side::inside && crossing_.empty())
            return visit(at, whole_cell());
        Integrals found = quadrature_.integrate(cell, solid_.sign, crossing_);
        for (std::size_t i = 0; i < crossing_.size(); ++i)
            if (has_caps_[i])
                found.add(quadrature_.integrate_cap(cell, solid_.sign, crossing_, i));
        visit(at, found);
    }

    Integrals whole_cell() const
    {
        Integrals whole;
        whole.value[static_cast<std::size_t>(Quantity::volume)] = cell_volume_;
        return whole;
    }

    Side side_of_cell(const CellCoefficients& cell) const
    {
        const int count = solid_.volume.degree() + 1;
        double least = cell(0, 0, 0), most = least;
        for (int k = 0; k < count; ++k)
            for (int j = 0; j < count; ++j)
                for (int i = 0; i < count; ++i) {
                    least = std::min(least, cell(i, j, k));
                    most = std::max(most, cell(i, j, k));
                }
        return side_of(least, most, solid_.sign);
    }

    const Solid& solid_;
    IntegralOptions options_;
    CellQuadrature quadrature_;
    double cell_volume_;
    std::vector<HalfSpace> crossing_; ///< planes that cross or touch a cell
    std::vector<bool> has_caps_;      ///< of each of them
};

void check(const Solid& solid, const IntegralOptions& options)
{
    if (options.order < 2 || options.order > 10)
        throw_invalid("order", "2 to 10", options.order);
    if (options.curvature && solid.volume.degree() < 2)
        throw_invalid("degree", "2 or 3 of a volume whose surfaces have curvatures: those of degree 1 have creases",
                      solid.volume.degree());
}

/// Calls `visit(work, octet index, brick, side)` for all bricks that may hold a part of the solid, in parallel over
/// octets; `make()` returns the working memory of a chunk of octets.
template <typename Make, typename Visit>
void for_each_brick(const Solid& solid, const Make& make, const Visit& visit, const Progress& progress)
{
    const glm::ivec3 bricks = brick_shape(solid.volume.cell_shape());
    parallel_for(
        solid.ranges.octets().size(), 1,
        [&](std::size_t begin, std::size_t end) {
            auto work = make();
            for (std::size_t octet = begin; octet < end; ++octet)
                for (int child = 0; child < 8; ++child) {
                    const glm::ivec3 place = 2 * at_place(solid.ranges.shape(), octet) + child_position(child);
                    if (place.x >= bricks.x || place.y >= bricks.y || place.z >= bricks.z)
                        continue;
                    const Brick brick = brick_at(solid.volume.cell_shape(), place);
                    if (const Side side = side_of(solid, brick);
                        side != Side::outside && !solid.cells.has_none_of(brick))
                        visit(work, octet, brick, side);
                }
        },
        progress);
}

} // namespace

Integrals integrate(const Solid& solid, const IntegralOptions& options, const Progress& progress)
{
    check(solid, options);
    const double cell_volume = std::abs(glm::determinant(glm::dmat3(solid.volume.lattice_to_world())));
    // Sums per octet, added in a fixed order, do not depend on the number of threads.
    std::vector<Integrals> sums(solid.ranges.octets().size());
    for_each_brick(
        solid, [&] { return BrickIntegrals(solid, options); },
        [&](BrickIntegrals& work, std::size_t octet, const Brick& brick, Side side) {
            if (side == Side::inside && !work.is_cut(brick)) {
                const double cells = static_cast<double>(brick.size.x) * brick.size.y * brick.size.z;
                sums[octet].value[static_cast<std::size_t>(Quantity::volume)] += cells * cell_volume;
                return;
            }
            work.visit_cells(brick, side, [&](const glm::ivec3&, const Integrals& found) { sums[octet].add(found); });
        },
        progress);
    Integrals total;
    for (const Integrals& sum : sums)
        total.add(sum);
    return total;
}

std::vector<Integrals> integrate(const Solid& solid, const Components& components, const IntegralOptions& options,
                                 const Progress& progress)
{
    check(solid, options);
    const double cell_volume = std::abs(glm::determinant(glm::dmat3(solid.volume.lattice_to_world())));
    const glm::ivec3 bricks = brick_shape(solid.volume.cell_shape());
    std::vector<Integrals> sums(components.pieces().size());
    for_each_brick(
        solid, [&] { return BrickIntegrals(solid, options); },
        [&](BrickIntegrals& work, std::size_t, const Brick& brick, Side side) {
            const auto place = static_cast<std::size_t>(place_in(bricks, brick.first / brick_size));
            const std::size_t first = components.first_piece(place), last = components.first_piece(place + 1);
            if (side == Side::inside && !work.is_cut(brick)) {
                for (std::size_t i = first; i < last; ++i)
                    sums[i].value[static_cast<std::size_t>(Quantity::volume)] +=
                        static_cast<double>(count_cells(components.pieces()[i].cells)) * cell_volume;
                return;
            }
            work.visit_cells(brick, side, [&](const glm::ivec3& cell, const Integrals& found) {
                for (std::size_t i = first; i < last; ++i)
                    if (has_cell(components.pieces()[i].cells, cell - brick.first))
                        sums[i].add(found);
            });
        },
        progress);
    std::vector<Integrals> totals(components.counts().size());
    for (std::size_t i = 0; i < sums.size(); ++i)
        totals[components.pieces()[i].component].add(sums[i]);
    return totals;
}

} // namespace isospline
