#include "isospline/measure/integrals.h"

#include "isospline/measure/line_lanes.h"
#include "isospline/measure/piece_integrals.h"
#include "isospline/measure/plane_section.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// The rules for a tolerance: numbers of rows of lines, then orders of quadrature in every cell, which converges faster
/// where the surface is smooth.
constexpr std::array<PieceRule, 18> all_rules{{{true, 4},
                                               {true, 6},
                                               {true, 8},
                                               {true, 12},
                                               {true, 16},
                                               {true, 24},
                                               {true, 32},
                                               {true, 48},
                                               {true, 64},
                                               {true, 96},
                                               {true, 128},
                                               {true, 192},
                                               {true, 256},
                                               {true, 384},
                                               {true, 512},
                                               {false, 4},
                                               {false, 6},
                                               {false, 10}}};
constexpr std::size_t first_quadrature = 15;
static_assert(std::all_of(all_rules.begin(), all_rules.begin() + first_quadrature,
                          [](const PieceRule& rule) { return rule.order % 2 == 0; }));
/// Where lines are not in SIMD lanes, all rules of quadrature together take less than those from this one on, which are
/// not used.
constexpr std::size_t first_without_lanes = 7;
/// The first rule for areas and curvatures within less than a tolerance, and for all else. For volumes, few lines are
/// precise.
constexpr std::size_t usual_first_rule = 2;
constexpr double tolerance_of_few_lines = 5e-4;
/// One in so many pieces of a component tells how many cells the surface crosses, if it has at least so many.
constexpr std::size_t sample_step = 16, fewest_sampled = 512;
/// The standard deviation of the area of noise, times the square root of the number of cells, with the usual first
/// rule, and how it falls with the number of lines. Measured; smooth surfaces have less.
constexpr double deviation_in_noise = 0.0135, rate_in_noise = 1.7;
/// The errors of lines fall with about this power of their number.
constexpr double rate_of_lines = 1.2;
/// Three of four columns have one lattice. If the squares of the differences of their halves sum to more than this
/// number times those of the others, the columns are not alike.
constexpr double most_of_others = 12.0;
/// The relative error of sums over lines in single precision, whose rounding errors may be alike in all cells.
constexpr double rounding_of_lines = 2.5e-7;
/// The errors of lines are estimated by statistics of many cells. If there are fewer, they are not used.
constexpr std::size_t fewest_cells_of_lines = 1000;

void check(const Solid& solid, const IntegralOptions& options)
{
    if (options.order != 0 && (options.order < 2 || options.order > 10))
        throw_invalid("order", "2 to 10", options.order);
    if (!(options.tolerance > 0.0) || !std::isfinite(options.tolerance))
        throw_invalid("tolerance", "a positive number that is finite", options.tolerance);
    if (options.needs_curvature() && solid.volume.degree() < 2)
        throw_invalid("degree", "2 or 3 of a volume whose surfaces have curvatures: those of degree 1 have creases",
                      solid.volume.degree());
}

/// Sums over the pieces of one component, of one quantity.
struct Sums {
    double value = 0.0, error = 0.0, unresolved = 0.0, magnitude = 0.0; ///< error: of quadrature
    double deviation = 0.0;                                             ///< of lines, the standard one
    double columns = 0.0; ///< of lines: how many would have the same variance, if it were the same in all of them
    std::size_t line_cells = 0;

    void add(const PieceSums& piece, std::size_t quantity)
    {
        value += piece.integrals.value[quantity];
        magnitude += piece.magnitude[quantity];
        error += piece.integrals.error[quantity];
        unresolved += piece.integrals.unresolved[quantity];
        line_cells += piece.line_cells;
    }

    /// Four standard deviations, or more if these are not well known, because few columns have most of the variance.
    double line_error() const { return deviation > 0.0 ? 4.0 * (1.0 + 4.0 / columns) * deviation : 0.0; }
    /// What more lines do not make smaller: errors of quadrature, and rounding.
    double other_error() const { return error + (line_cells > 0 ? rounding_of_lines * magnitude : 0.0); }
    double total_error() const { return line_error() + other_error(); }
};

/// Integrates over pieces until the errors of all components are within a tolerance.
class Integration {
public:
    Integration(const Solid& solid, const std::vector<Piece>& pieces, const std::vector<double>& whole_volumes,
                const IntegralOptions& options)
        : solid_(solid), pieces_(pieces), whole_volumes_(whole_volumes), options_(options), sums_(pieces.size()),
          rule_of_(pieces.size(),
                   options.needs_surface() && options.tolerance < tolerance_of_few_lines ? usual_first_rule : 0),
          of_component_(whole_volumes.size()), totals_(whole_volumes.size())
    {
        for (std::size_t i = 0; i < pieces.size(); ++i)
            of_component_[pieces[i].component].push_back(i);
        for (const auto& component : of_component_) {
            std::size_t count = 0;
            for (const std::size_t i : component)
                count += count_cells(pieces[i].cells);
            if (count < fewest_cells_of_lines)
                for (const std::size_t i : component)
                    rule_of_[i] = first_quadrature;
        }
        for (Integrals& totals : totals_)
            totals.error.fill(std::numeric_limits<double>::infinity());
    }

    std::vector<Integrals> run(const Progress& progress)
    {
        std::vector<std::size_t> chosen(pieces_.size());
        std::iota(chosen.begin(), chosen.end(), std::size_t{0});
        const bool is_once = options_.order != 0;
        choose_first_rules(part_of(progress, 0.0, 0.05));
        double begin = 0.05;
        do {
            const double end = is_once ? 1.0 : 0.25 * begin + 0.75;
            compute(chosen, part_of(progress, begin, end));
            chosen = update_totals();
            begin = end;
        } while (!chosen.empty() && !is_once);
        return std::move(totals_);
    }

private:
    PieceRule rule(std::size_t piece) const
    {
        return options_.order != 0 ? PieceRule{false, options_.order} : all_rules[rule_of_[piece]];
    }

    /// The first rule that is not one of the rules of lines that are used.
    std::size_t end_of_lines() const
    {
        const bool has_lanes = CellLines::has_lanes(solid_.volume.degree(), options_.needs_curvature());
        return has_lanes ? first_quadrature : first_without_lanes;
    }

    void compute(const std::vector<std::size_t>& chosen, const Progress& progress)
    {
        parallel_for(
            chosen.size(), 8,
            [&](std::size_t begin, std::size_t end) {
                std::array<std::optional<PieceIntegrals>, all_rules.size()> integrals;
                for (std::size_t i = begin; i < end; ++i) {
                    auto& by_rule = integrals[rule_of_[chosen[i]]];
                    if (!by_rule)
                        by_rule.emplace(solid_, rule(chosen[i]), options_.needs_surface(), options_.needs_curvature());
                    sums_[chosen[i]] = (*by_rule)(pieces_[chosen[i]]);
                }
            },
            progress);
    }

    /// What bricks have in common that share a column.
    static std::array<int, 3> place_of_column(std::size_t column, const Brick& brick)
    {
        const int axis = LineSums::axis_of(column);
        return {static_cast<int>(column), brick.first[first_of_face(axis)], brick.first[second_of_face(axis)]};
    }

    /// The sums over a component. The errors of lines along different columns are independent.
    Sums sums_of(const std::vector<std::size_t>& pieces, std::size_t quantity) const
    {
        Sums all;
        std::map<std::array<int, 3>, std::array<double, 3>> columns; // by place_of_column: deviation, halves
        for (const std::size_t i : pieces) {
            all.add(sums_[i], quantity);
            for (std::size_t column = 0; column < LineSums::column_count; ++column) {
                const PieceSums::Column& part = sums_[i].columns[column];
                const float numbers[3] = {part.deviation[quantity], part.halves_of_pairs[quantity],
                                          part.halves_of_others[quantity]};
                if (numbers[0] == 0.0f && numbers[1] == 0.0f && numbers[2] == 0.0f)
                    continue;
                std::array<double, 3>& sums = columns[place_of_column(column, pieces_[i].brick)];
                for (std::size_t k = 0; k < sums.size(); ++k)
                    sums[k] += static_cast<double>(numbers[k]) * sums_[i].magnitude[quantity];
            }
        }
        double largest = 0.0;
        for (const auto& [place, numbers] : columns)
            for (const double number : numbers)
                largest = std::max(largest, std::abs(number));
        if (largest == 0.0)
            return all;
        std::array<double, 3> squares{}, fourth_powers{};
        for (const auto& [place, numbers] : columns)
            for (std::size_t k = 0; k < numbers.size(); ++k) {
                const double square = std::pow(numbers[k] / largest, 2);
                squares[k] += square;
                fourth_powers[k] += square * square;
            }
        // One of four columns has two lattices. Where the halves of the others differ much more, that one is not like
        // them, and the halves are what is known.
        const auto [by_pairs, of_pairs, of_others] = squares;
        const bool is_alike = of_others <= most_of_others * of_pairs;
        const double square = is_alike ? by_pairs : of_pairs + of_others;
        all.deviation = largest * std::sqrt(square);
        all.columns =
            is_alike ? by_pairs * by_pairs / fourth_powers[0] : square * square / (fourth_powers[1] + fourth_powers[2]);
        return all;
    }

    /// Large components have the fewest lines that would do for noise. A wrong choice costs time only.
    void choose_first_rules(const Progress& progress)
    {
        if (options_.order != 0 || !options_.needs_surface() || options_.needs_curvature())
            return;
        std::vector<std::size_t> sample;
        for (const std::vector<std::size_t>& component : of_component_)
            for (std::size_t i = 0; i < component.size() && is_sampled(component); i += sample_step)
                sample.push_back(component[i]);
        for (const std::size_t piece : sample)
            rule_of_[piece] = 0;
        compute(sample, progress);
        for (const std::vector<std::size_t>& component : of_component_) {
            if (!is_sampled(component))
                continue;
            std::size_t line_cells = 0, rule = 0;
            for (std::size_t i = 0; i < component.size(); i += sample_step)
                line_cells += sample_step * sums_[component[i]].line_cells;
            const auto error_in_noise = [line_cells](const PieceRule& few) {
                const double more = static_cast<double>(all_rules[usual_first_rule].order) / few.order;
                return 4.0 * deviation_in_noise * std::pow(more, rate_in_noise) /
                       std::sqrt(static_cast<double>(line_cells));
            };
            while (rule < usual_first_rule && !(error_in_noise(all_rules[rule]) < options_.tolerance))
                ++rule;
            for (const std::size_t piece : component)
                rule_of_[piece] = static_cast<std::uint8_t>(rule);
        }
    }
    bool is_sampled(const std::vector<std::size_t>& component) const
    {
        return component.size() >= fewest_sampled && rule_of_[component.front()] < first_quadrature;
    }

    /// Keeps the sums with the smallest errors so far, and returns the pieces that need a more precise rule, which is
    /// then their rule.
    std::vector<std::size_t> update_totals()
    {
        std::vector<std::uint8_t> next_rules = rule_of_;
        for (std::size_t component = 0; component < of_component_.size(); ++component)
            for (std::size_t quantity = 0; quantity < quantity_count; ++quantity) {
                const double whole = quantity == 0 ? whole_volumes_[component] : 0.0;
                const Sums all = sums_of(of_component_[component], quantity);
                Integrals& totals = totals_[component];
                // Of rules of lines, the last one counts: the smallest error may be so by chance.
                const bool is_known = all.line_cells == 0 || all.line_cells >= fewest_cells_of_lines;
                const double error = all.total_error();
                if (is_known && (all.line_cells > 0 || error < totals.error[quantity])) {
                    totals.value[quantity] = all.value + whole;
                    totals.error[quantity] = error;
                }
                const double limit = options_.tolerance * (all.magnitude + whole);
                const bool is_reached = totals.error[quantity] <= limit && std::isfinite(totals.error[quantity]);
                if (options_.wanted[quantity] && !is_reached)
                    choose_rules(of_component_[component], quantity, all, limit, next_rules);
            }
        std::vector<std::size_t> found;
        for (std::size_t i = 0; i < pieces_.size(); ++i)
            if (next_rules[i] != rule_of_[i])
                found.push_back(i);
        rule_of_ = std::move(next_rules);
        return found;
    }

    /// Chooses the rules for the pieces of a component, whose error is larger than a limit.
    void choose_rules(std::vector<std::size_t> pieces, std::size_t quantity, const Sums& all, double limit,
                      std::vector<std::uint8_t>& next_rules) const
    {
        const auto choose = [&](std::size_t piece, std::size_t next) {
            next_rules[piece] = std::max(next_rules[piece], static_cast<std::uint8_t>(next));
        };
        // What lines say of a single piece may be chance: all or none have them.
        if (all_rules[rule_of_[pieces.front()]].has_lines) {
            const std::size_t rule = rule_of_[pieces.front()];
            std::size_t next = all.line_cells < fewest_cells_of_lines ? first_quadrature : rule + 1;
            const double order = all_rules[rule].order;
            while (next < first_quadrature &&
                   all.line_error() * std::pow(order / all_rules[next].order, rate_of_lines) >
                       limit - all.other_error())
                ++next;
            if (next >= end_of_lines())
                next = first_quadrature;
            for (const std::size_t piece : pieces)
                choose(piece, next);
            return;
        }
        // Those with the largest errors, so that half of the limit is left for them. What is unresolved stays; if it is
        // more than the rest of the limit, the others need not be smaller.
        const auto resolved_error = [&](std::size_t piece) {
            return sums_[piece].integrals.error[quantity] - sums_[piece].integrals.unresolved[quantity];
        };
        limit = std::max(limit - all.unresolved, all.unresolved);
        std::stable_sort(pieces.begin(), pieces.end(),
                         [&](std::size_t a, std::size_t b) { return resolved_error(a) < resolved_error(b); });
        double kept = 0.0;
        for (const std::size_t piece : pieces) {
            kept += resolved_error(piece);
            if (kept > 0.5 * limit)
                choose(piece, std::min(rule_of_[piece] + std::size_t{1}, all_rules.size() - 1));
        }
    }

    const Solid& solid_;
    const std::vector<Piece>& pieces_;
    const std::vector<double>& whole_volumes_;
    IntegralOptions options_;
    std::vector<PieceSums> sums_;
    std::vector<std::uint8_t> rule_of_;                  ///< of each piece
    std::vector<std::vector<std::size_t>> of_component_; ///< the pieces of each component
    std::vector<Integrals> totals_;                      ///< of each component, the best ones so far
};

/// `visit_pieces(brick, add)` calls `add(component, cells)` for all pieces of a brick.
template <typename VisitPieces>
std::vector<Integrals> integrate_pieces(const Solid& solid, std::size_t component_count, const IntegralOptions& options,
                                        const Progress& progress, const VisitPieces& visit_pieces)
{
    check(solid, options);
    const double cell_volume = std::abs(glm::determinant(glm::dmat3(solid.volume.lattice_to_world())));
    std::vector<Piece> pieces;
    std::vector<double> whole_volumes(component_count, 0.0);
    for_each_brick(solid, [&](const Brick& brick, Side side) {
        const bool is_whole = side == Side::inside && !is_cut(solid, brick, options.needs_surface());
        visit_pieces(brick, [&](std::size_t component, const BrickCells& cells) {
            if (is_whole)
                whole_volumes[component] += static_cast<double>(count_cells(cells)) * cell_volume;
            else
                pieces.push_back({brick, cells, component});
        });
    });
    return Integration(solid, pieces, whole_volumes, options).run(progress);
}

} // namespace

Integrals integrate(const Solid& solid, const IntegralOptions& options, const Progress& progress)
{
    return integrate_pieces(solid, 1, options, progress,
                            [&](const Brick& brick, const auto& add) { add(std::size_t{0}, solid.cells.cells(brick)); })
        .front();
}

std::vector<Integrals> integrate(const Solid& solid, const Components& components, const IntegralOptions& options,
                                 const Progress& progress)
{
    const glm::ivec3 bricks = brick_shape(solid.volume.cell_shape());
    return integrate_pieces(
        solid, components.counts().size(), options, progress, [&](const Brick& brick, const auto& add) {
            const auto place = static_cast<std::size_t>(place_in(bricks, brick.first / brick_size));
            const BrickCells of_solid = solid.cells.cells(brick);
            for (std::size_t i = components.first_piece(place); i < components.first_piece(place + 1); ++i) {
                BrickCells cells = components.pieces()[i].cells;
                for (std::size_t z = 0; z < cells.size(); ++z)
                    cells[z] &= of_solid[z];
                if (count_cells(cells) > 0)
                    add(components.pieces()[i].component, cells);
            }
        });
}

} // namespace isospline
