// The connected components of the solid that an isosurface bounds.
#pragma once

#include "isospline/brick/cell_set.h"
#include "isospline/brick/cutout.h"
#include "isospline/math/box.h"
#include "isospline/measure/solid.h"
#include "isospline/util/progress.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

/// The samples of the cells that contain a part of the solid: those at their centres for even degrees, those at their
/// corners for odd degrees. As a mask of a surface, it keeps these cells; for odd degrees, also cells between them.
Mask mask_of_cells(const Solid& solid, const Progress& progress = {});

/// Cells of a component that are connected within one brick.
struct ComponentPiece {
    BrickCells cells;
    std::size_t component;
};

/// The counts of a component.
struct ComponentCount {
    std::uint64_t cells = 0;  ///< that contain a part of it
    std::uint64_t inside = 0; ///< that are completely in it, by their Bernstein coefficients
    Box box_lattice;          ///< of all its cells
};

/// Components of a solid, by cells.
///
/// Two cells that share a face are connected if the solid reaches that face, by the values of f on the face. The parts
/// of the solid in one cell count as connected. So each connected component of the continuous model's solid is in one
/// component here. Two separate components are in the same one only if they pass through the same cell. At degree 1,
/// this is the labelling of samples with 26 neighbours.
///
/// A clip separates: the components are those of the solid within it. A component has volume or area. At degree 1, it
/// can also be no more than samples that equal the level.
class Components {
public:
    /// Numbered in the order of bricks. The same for any number of threads.
    explicit Components(const Solid& solid, const Progress& progress = {});

    /// What each component contains; a component's number is its place here.
    const std::vector<ComponentCount>& counts() const { return counts_; }
    /// All pieces, in the order of bricks in their grid.
    const std::vector<ComponentPiece>& pieces() const { return pieces_; }
    /// The index of the first piece of a brick, by its index in the grid of bricks; one entry more than there are
    /// bricks.
    std::size_t first_piece(std::size_t brick) const { return first_piece_[brick]; }
    /// The cells of the components for which `is_wanted` is not 0. Neighbouring cells of the set `among` that belong to
    /// no component are added: if f equals the level on the face between both, the surface belongs to that neighbour.
    CellSet cells(const std::vector<std::uint8_t>& is_wanted, const CellSet& among,
                  const Progress& progress = {}) const;

private:
    glm::ivec3 cell_shape_;
    std::vector<std::size_t> first_piece_;
    std::vector<ComponentPiece> pieces_;
    std::vector<ComponentCount> counts_;
};

} // namespace isospline
