// Integrals over the cells of a solid in one brick, by rules of different precision.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/measure/cell_lines.h"
#include "isospline/measure/cell_quadrature.h"
#include "isospline/measure/solid.h"

#include <glm/vec3.hpp>

#include <array>
#include <optional>
#include <vector>

namespace isospline {

/// Some cells of a brick.
struct Piece {
    Brick brick;
    BrickCells cells;
    std::size_t component;
};

/// Integrals over a piece.
struct PieceSums {
    Integrals integrals;                            ///< with the errors of quadrature
    std::array<double, quantity_count> magnitude{}; ///< of the absolute value
    /// See LineSums; in parts of the magnitude, so that single precision is enough for any unit.
    struct Column {
        std::array<float, quantity_count> deviation{}, halves_of_pairs{}, halves_of_others{};
    };
    std::array<Column, LineSums::column_count> columns;
    std::size_t line_cells = 0; ///< cells that the surface may cross, by lines
};

/// How to integrate over cells.
struct PieceRule {
    bool has_lines; ///< CellLines, and CellQuadrature of order 4 in cells that lines cannot do; else CellQuadrature
    int order;
};

/// Integrates over pieces, one at a time.
class PieceIntegrals {
public:
    /// `solid` must outlive it.
    PieceIntegrals(const Solid& solid, const PieceRule& rule, bool surface, bool curvature);

    PieceSums operator()(const Piece& piece);

private:
    void add_cell(const glm::ivec3& at, Side side, PieceSums& to);
    /// Those that matter: the border of the domain only has area.
    const std::vector<HalfSpace>& planes() const { return surface_ ? solid_.planes.all() : solid_.planes.clip(); }

    const Solid& solid_;
    bool surface_;
    CellQuadrature quadrature_;
    std::optional<CellLines> lines_;
    LineSums line_sums_; ///< of the piece
    double cell_volume_;
    std::vector<HalfSpace> crossing_; ///< planes that cross or touch a cell
    std::vector<bool> has_caps_;      ///< of each of them
};

/// Whether the clip or the set of cells can remove anything from a brick, or add a cap to it.
bool is_cut(const Solid& solid, const Brick& brick, bool surface);

} // namespace isospline
