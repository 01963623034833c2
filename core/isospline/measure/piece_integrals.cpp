#include "isospline/measure/piece_integrals.h"

#include "isospline/measure/brick_solid.h"
#include "isospline/spline/degree.h"

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

bool is_cut(const Solid& solid, const Brick& brick, bool surface)
{
    const std::vector<HalfSpace>& planes = surface ? solid.planes.all() : solid.planes.clip();
    return !solid.cells.has_all_of(brick) || std::any_of(planes.begin(), planes.end(), [&](const HalfSpace& plane) {
        return !is_inside(box_of(brick), plane);
    });
}

PieceIntegrals::PieceIntegrals(const Solid& solid, const PieceRule& rule, bool surface, bool curvature)
    : solid_(solid), surface_(surface),
      quadrature_(solid.volume.degree(),
                  {rule.has_lines ? 4 : rule.order, surface, curvature, solid.volume.lattice_to_world()}),
      cell_volume_(std::abs(glm::determinant(glm::dmat3(solid.volume.lattice_to_world()))))
{
    if (rule.has_lines)
        lines_.emplace(solid.volume.degree(),
                       QuadratureOptions{rule.order, surface, curvature, solid.volume.lattice_to_world()});
}

PieceSums PieceIntegrals::operator()(const Piece& piece)
{
    PieceSums sums;
    line_sums_ = {};
    const Side side = side_of(solid_, piece.brick);
    for_each_cell(piece.cells,
                  [&](int x, int y, int z) { add_cell(piece.brick.first + glm::ivec3(x, y, z), side, sums); });
    sums.line_cells = line_sums_.cells;
    for (std::size_t i = 0; i < quantity_count; ++i) {
        sums.magnitude[i] = std::abs(sums.integrals.value[i]) + line_sums_.magnitude[i];
        sums.integrals.value[i] += line_sums_.value[i];
        const auto part = [&](double number) { return static_cast<float>(number / sums.magnitude[i]); };
        for (std::size_t column = 0; column < sums.columns.size() && sums.magnitude[i] > 0.0; ++column) {
            const LineSums::Column& of_lines = line_sums_.columns[column];
            sums.columns[column].deviation[i] = part(of_lines.deviation[i]);
            sums.columns[column].halves_of_pairs[i] = part(of_lines.halves_of_pairs[i]);
            sums.columns[column].halves_of_others[i] = part(of_lines.halves_of_others[i]);
        }
    }
    return sums;
}

void PieceIntegrals::add_cell(const glm::ivec3& at, Side side, PieceSums& to)
{
    const VolumeCell cell(solid_.volume, solid_.threshold, at);
    if (side == Side::unknown)
        side = dispatch_degree(solid_.volume.degree(), [&](auto degree) { return side_of<degree>(cell, solid_.sign); });
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
        has_caps_.push_back(surface_ && solid_.planes.caps_have_area(i));
    }
    if (crossing_.empty()) {
        if (side == Side::inside) {
            to.integrals.value[index_of(Quantity::volume)] += cell_volume_;
            return;
        }
        if (lines_ && lines_->add(cell, at, solid_.sign, line_sums_))
            return;
    }
    to.integrals.add(quadrature_.integrate(cell, solid_.sign, crossing_));
    for (std::size_t i = 0; i < crossing_.size(); ++i)
        if (has_caps_[i])
            to.integrals.add(quadrature_.integrate_cap(cell, solid_.sign, crossing_, i));
}

} // namespace isospline
