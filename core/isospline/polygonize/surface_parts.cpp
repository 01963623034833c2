#include "isospline/polygonize/surface_parts.h"

#include "isospline/math/bernstein_box.h"
#include "isospline/polygonize/cells_in_question.h"
#include "isospline/polygonize/special_cubes.h"
#include "isospline/spline/cell_weights-inl.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace isospline {

namespace {

constexpr std::size_t nodes_per_cell = parts_per_cell + 1, nodes_per_brick = parts_per_brick + 1;
constexpr std::size_t rows_per_cell = nodes_per_cell * nodes_per_cell;
/// Values that are this much smaller than the coefficients have no sign for certain.
constexpr double rounding_of_values = 0x1p-40;

/// For each row of the nodes of a cell, whether f - level is above and below a limit on both sides: bit i is node i.
struct Sides {
    std::array<std::uint8_t, rows_per_cell> above{}, below{};
};

/// f - level at the nodes around the parts of a cell.
template <int Degree>
class NodesOfCell {
public:
    static constexpr std::size_t count = Degree + 1;

    NodesOfCell()
    {
        for (std::size_t node = 0; node < nodes_per_cell; ++node)
            weights_[node] = scalar::cell_weights<Degree>(static_cast<double>(node) / parts_per_cell);
    }

    void enter(const CellCoefficients& cell)
    {
        std::array<std::array<std::array<double, nodes_per_cell>, count>, count> along_x{};
        std::array<double, count * count * count> c;
        largest_ = 0.0;
        for (std::size_t k = 0, item = 0; k < count; ++k)
            for (std::size_t j = 0; j < count; ++j)
                for (std::size_t i = 0; i < count; ++i, ++item) {
                    c[item] = cell(static_cast<std::ptrdiff_t>(i), static_cast<std::ptrdiff_t>(j),
                                   static_cast<std::ptrdiff_t>(k));
                    largest_ = std::max(largest_, std::abs(c[item]));
                    for (std::size_t x = 0; x < nodes_per_cell; ++x)
                        along_x[k][j][x] += weights_[x][i] * c[item];
                }
        std::array<std::array<std::array<double, nodes_per_cell>, nodes_per_cell>, count> along_y{};
        for (std::size_t k = 0; k < count; ++k)
            for (std::size_t y = 0; y < nodes_per_cell; ++y)
                for (std::size_t j = 0; j < count; ++j)
                    for (std::size_t x = 0; x < nodes_per_cell; ++x)
                        along_y[k][y][x] += weights_[y][j] * along_x[k][j][x];
        values_ = {};
        for (std::size_t z = 0; z < nodes_per_cell; ++z)
            for (std::size_t k = 0; k < count; ++k)
                for (std::size_t y = 0; y < nodes_per_cell; ++y)
                    for (std::size_t x = 0; x < nodes_per_cell; ++x)
                        values_[y + nodes_per_cell * z][x] += weights_[z][k] * along_y[k][y][x];

        // The second derivatives are between these differences of coefficients.
        bend_ = 0.0;
        for (std::size_t axis = 0, stride = 1; axis < 3; ++axis, stride *= count) {
            double most = 0.0;
            for (std::size_t item = 0; item + 2 * stride < c.size(); ++item)
                if (item / stride % count + 2 < count)
                    most = std::max(most, std::abs(c[item] - 2.0 * c[item + stride] + c[item + 2 * stride]));
            bend_ += most;
        }
    }

    /// The signs at nodes.
    Sides signs() const { return sides(rounding_of_values * largest_); }
    /// The sides on which all of f is around the nodes, up to half of the parts beside them.
    Sides sides_of_parts() const
    {
        constexpr double size = 1.0 / parts_per_cell;
        return sides(size * size / 8.0 * bend_ + rounding_of_values * largest_);
    }

private:
    Sides sides(double limit) const
    {
        Sides sides;
        for (std::size_t row = 0; row < rows_per_cell; ++row)
            for (std::size_t x = 0; x < nodes_per_cell; ++x) {
                sides.above[row] |= static_cast<std::uint8_t>((values_[row][x] > limit) << x);
                sides.below[row] |= static_cast<std::uint8_t>((values_[row][x] < -limit) << x);
            }
        return sides;
    }

    std::array<std::array<double, count>, nodes_per_cell> weights_;
    std::array<std::array<double, nodes_per_cell>, rows_per_cell> values_; ///< by z and y, then by x
    double largest_ = 0.0, bend_ = 0.0;
};

/// The parts of a cell that are not known to be on one side.
std::uint64_t parts_between(const Sides& sides)
{
    const auto on_one_side = [](const std::array<std::uint8_t, rows_per_cell>& nodes, std::size_t row) {
        unsigned all = nodes[row] & nodes[row + 1] & nodes[row + nodes_per_cell] & nodes[row + nodes_per_cell + 1];
        all &= all >> 1;
        return all & ((1u << parts_per_cell) - 1u);
    };
    std::uint64_t parts = 0;
    for (std::size_t z = 0; z < parts_per_cell; ++z)
        for (std::size_t y = 0; y < parts_per_cell; ++y) {
            const std::size_t row = y + nodes_per_cell * z;
            const std::uint64_t known = on_one_side(sides.above, row) | on_one_side(sides.below, row);
            parts |= known << parts_per_cell * (y + parts_per_cell * z);
        }
    return ~parts;
}

/// The edges of a brick's parts with different signs at both ends: a bit for each lower end, by axis and row.
struct CrossedEdges {
    using Rows = std::array<std::uint64_t, nodes_per_brick * nodes_per_brick>;

    void add(const Sides& signs, const glm::ivec3& cell)
    {
        const auto differ = [&](std::size_t a, std::size_t b) {
            return static_cast<unsigned>((signs.above[a] & signs.below[b]) | (signs.below[a] & signs.above[b]));
        };
        const glm::vec<3, std::size_t> first(parts_per_cell * cell);
        for (std::size_t z = 0; z < nodes_per_cell; ++z)
            for (std::size_t y = 0; y < nodes_per_cell; ++y) {
                const std::size_t row = y + nodes_per_cell * z, to = first.y + y + nodes_per_brick * (first.z + z);
                const unsigned above = signs.above[row], below = signs.below[row];
                of_axis[0][to] |= std::uint64_t{(above & below >> 1) | (below & above >> 1)} << first.x;
                if (y + 1 < nodes_per_cell)
                    of_axis[1][to] |= std::uint64_t{differ(row, row + 1)} << first.x;
                if (z + 1 < nodes_per_cell)
                    of_axis[2][to] |= std::uint64_t{differ(row, row + nodes_per_cell)} << first.x;
            }
    }

    std::array<Rows, 3> of_axis{};
};

} // namespace

template <int Degree>
SurfaceParts::SurfaceParts(const LatticeField<Degree>& field, double distance, const Progress& progress)
    : near_(field.surface().volume().cell_shape()), crossed_(near_.shape() / parts_per_cell)
{
    const IsosurfaceSnapshot& surface = field.surface();
    const LatticeMetric metric(surface.volume().lattice_to_world());
    if (PartReach(metric, distance).distance() == 0.0)
        return;
    std::vector<PartReach> reaches;
    for (int axis = 0; axis < 3; ++axis) {
        reaches.emplace_back(metric, distance, axis);
        distance_ = std::max(distance_, reaches.back().distance());
    }
    const SpecialCubes by_planes(surface.planes(), 1);
    const std::vector<BrickInQuestion> bricks = bricks_in_question(surface);
    parallel_for(
        bricks.size(), 8,
        [&](std::size_t begin, std::size_t end) {
            NodesOfCell<Degree> nodes;
            SpreadParts spread;
            for (std::size_t i = begin; i < end; ++i) {
                const Brick& brick = bricks[i].brick;
                const bool are_inside = by_planes.kind_by_planes(brick.first, brick.size) == CubeKind::plain;
                CrossedEdges edges;
                for_each_cell_in_question(surface, {brick, bricks[i].is_mixed, false}, all_cells(brick.size),
                                          [&](const glm::ivec3& cell, bool) {
                                              nodes.enter(VolumeCell(surface.volume(), surface.threshold(), cell));
                                              crossed_.add_of_cell(cell, parts_between(nodes.sides_of_parts()));
                                              if (are_inside ||
                                                  by_planes.kind_by_planes(cell, glm::ivec3(1)) == CubeKind::plain)
                                                  edges.add(nodes.signs(), cell - brick.first);
                                          });
                for (std::size_t axis = 0; axis < 3; ++axis)
                    for (std::size_t row = 0; row < edges.of_axis[axis].size(); ++row)
                        if (const std::uint64_t bits = edges.of_axis[axis][row]; bits != 0)
                            spread.add(reaches[axis], static_cast<int>(row % nodes_per_brick),
                                       static_cast<int>(row / nodes_per_brick), bits);
                spread.move_to(near_, parts_per_cell * brick.first);
            }
        },
        progress);
}

template SurfaceParts::SurfaceParts(const LatticeField<1>&, double, const Progress&);
template SurfaceParts::SurfaceParts(const LatticeField<2>&, double, const Progress&);
template SurfaceParts::SurfaceParts(const LatticeField<3>&, double, const Progress&);

} // namespace isospline
