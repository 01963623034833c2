#include "isospline/measure/integrals.h"

#include "isospline/measure/piece_integrals.h"
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
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// The rules for a tolerance. Those of lines come first, and need the more nodes the smaller the tolerance is; the
/// numbers of nodes are odd, and fill SIMD lanes. Quadrature in every cell converges faster where the surface is
/// smooth.
constexpr std::array<PieceRule, 11> all_rules{{{true, 7},
                                               {true, 15},
                                               {true, 23},
                                               {true, 31},
                                               {true, 47},
                                               {true, 63},
                                               {true, 95},
                                               {true, 127},
                                               {false, 4},
                                               {false, 6},
                                               {false, 10}}};
constexpr std::size_t first_quadrature = 8;
/// From this rule of lines on, the first rule of quadrature takes no longer. Where lines are not in SIMD lanes, all
/// rules of quadrature together take less than those from another rule on, which are not used.
constexpr std::size_t first_slow_lines = 6, first_without_lanes = 3;
/// The errors of lines fall with about this power of their number of nodes.
constexpr double rate_of_lines = 3.0;
/// Every so many pieces of a component are integrated first, to choose the rule for all, if there are enough.
constexpr std::size_t sample_step = 16, fewest_sampled = 32;
/// The errors of lines are estimated by statistics of many cells. If there are fewer, they are not used.
constexpr std::size_t fewest_cells_of_lines = 1000;

void check(const Solid& solid, const IntegralOptions& options)
{
    if (options.order != 0 && (options.order < 2 || options.order > 10))
        throw_invalid("order", "2 to 10", options.order);
    if (!(options.tolerance > 0.0))
        throw_invalid("tolerance", "a positive number", options.tolerance);
    if (options.needs_curvature() && solid.volume.degree() < 2)
        throw_invalid("degree", "2 or 3 of a volume whose surfaces have curvatures: those of degree 1 have creases",
                      solid.volume.degree());
}

/// Sums over the pieces of one component, of one quantity.
struct Sums {
    double value = 0.0, error = 0.0, magnitude = 0.0;
    std::array<double, 2> difference{};
    double sum_of_squares = 0.0;
    std::size_t line_cells = 0, line_pieces = 0;

    void add(const PieceSums& piece, std::size_t quantity)
    {
        value += piece.integrals.value[quantity];
        magnitude += piece.magnitude[quantity];
        error += piece.integrals.error[quantity];
        for (std::size_t coarse = 0; coarse < 2; ++coarse)
            difference[coarse] += piece.difference[coarse][quantity];
        sum_of_squares += std::pow(piece.largest_difference(quantity), 2);
        line_cells += piece.line_cells;
        line_pieces += piece.line_cells > 0;
    }

    /// The sums over all pieces, estimated from one in `step`. The differences have lost what may be chance.
    Sums scaled(std::size_t step) const
    {
        const auto factor = static_cast<double>(step);
        Sums all = *this;
        for (double* const each : {&all.value, &all.error, &all.magnitude, &all.sum_of_squares})
            *each *= factor;
        for (double& each : all.difference)
            each = factor * std::max(0.0, std::abs(each) - 2.0 * std::sqrt(sum_of_squares));
        all.line_cells *= step;
        all.line_pieces *= step;
        return all;
    }

    /// The errors of lines in different pieces are independent, except for what all have in common, which the
    /// difference of the sums shows: that, and three standard deviations of the rest, or more if these are not well
    /// known, because there are few pieces.
    double total_error() const
    {
        if (line_pieces == 0)
            return error;
        const double deviations = 3.0 * (1.0 + 8.0 / static_cast<double>(line_pieces));
        return error + std::max(std::abs(difference[0]), std::abs(difference[1])) +
               deviations * std::sqrt(sum_of_squares);
    }
};

/// Integrates over pieces until the errors of all components are within a tolerance.
class Integration {
public:
    Integration(const Solid& solid, const std::vector<Piece>& pieces, const std::vector<double>& whole_volumes,
                const IntegralOptions& options)
        : solid_(solid), pieces_(pieces), whole_volumes_(whole_volumes), options_(options), sums_(pieces.size()),
          rule_of_(pieces.size(), 0), of_component_(whole_volumes.size()), totals_(whole_volumes.size())
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
        double begin = 0.0;
        if (!is_once) {
            begin = 0.05;
            choose_first_rules(part_of(progress, 0.0, begin));
        }
        do {
            const double end = is_once ? 1.0 : 0.5 * (begin + 1.0);
            compute(chosen, part_of(progress, begin, end));
            chosen = update_totals();
            begin = 0.5 * (end + 1.0);
            prefer_quadrature(part_of(progress, end, begin));
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

    /// Chooses the rules of components with many pieces by a sample of these.
    void choose_first_rules(const Progress& progress)
    {
        const auto is_sampled = [&](const std::vector<std::size_t>& component) {
            return component.size() >= fewest_sampled * sample_step && all_rules[rule_of_[component.front()]].has_lines;
        };
        std::vector<std::size_t> sample;
        for (const auto& component : of_component_)
            for (std::size_t i = 0; is_sampled(component) && i < component.size(); i += sample_step)
                sample.push_back(component[i]);
        compute(sample, progress);
        std::vector<std::uint8_t> rules = rule_of_;
        for (std::size_t component = 0; component < of_component_.size(); ++component) {
            const std::vector<std::size_t>& of_component = of_component_[component];
            if (!is_sampled(of_component))
                continue;
            for (std::size_t quantity = 0; quantity < quantity_count; ++quantity) {
                Sums some;
                for (std::size_t i = 0; i < of_component.size(); i += sample_step)
                    some.add(sums_[of_component[i]], quantity);
                const Sums all = some.scaled(sample_step);
                const double whole = quantity == 0 ? whole_volumes_[component] : 0.0;
                const double limit = options_.tolerance * (all.magnitude + whole);
                if (options_.wanted[quantity] && all.total_error() > limit)
                    choose_rules(of_component, quantity, all, limit, rules);
            }
            for (const std::size_t i : of_component) // a sample does not tell that lines are not enough
                rule_of_[i] = std::min(rules[i], static_cast<std::uint8_t>(end_of_lines() - 1));
        }
    }

    /// Where slow lines come next, quadrature does if it is precise enough in a sample of the pieces.
    void prefer_quadrature(const Progress& progress)
    {
        const auto has_slow_lines = [&](const std::vector<std::size_t>& component) {
            return !component.empty() && rule_of_[component.front()] >= first_slow_lines &&
                   rule_of_[component.front()] < first_quadrature;
        };
        const auto step_of = [](const std::vector<std::size_t>& component) {
            return std::clamp(component.size() / fewest_sampled, std::size_t{1}, sample_step);
        };
        std::vector<std::size_t> sample;
        std::vector<std::uint8_t> rules = rule_of_;
        for (const auto& component : of_component_)
            for (std::size_t i = 0; has_slow_lines(component) && i < component.size(); i += step_of(component))
                sample.push_back(component[i]);
        for (const std::size_t i : sample)
            rule_of_[i] = first_quadrature;
        compute(sample, progress);
        std::swap(rules, rule_of_);
        for (std::size_t component = 0; component < of_component_.size(); ++component) {
            const std::vector<std::size_t>& of_component = of_component_[component];
            if (!has_slow_lines(of_component))
                continue;
            bool is_precise = true;
            for (std::size_t quantity = 0; quantity < quantity_count; ++quantity) {
                Sums some;
                for (std::size_t i = 0; i < of_component.size(); i += step_of(of_component))
                    some.add(sums_[of_component[i]], quantity);
                const Sums all = some.scaled(step_of(of_component));
                const double whole = quantity == 0 ? whole_volumes_[component] : 0.0;
                is_precise &= !options_.wanted[quantity] || all.error <= options_.tolerance * (all.magnitude + whole);
            }
            for (const std::size_t i : of_component)
                rule_of_[i] = is_precise ? static_cast<std::uint8_t>(first_quadrature) : rule_of_[i];
        }
    }

    /// Keeps the sums with the smallest errors so far, and returns the pieces that need a more precise rule, which is
    /// then their rule.
    std::vector<std::size_t> update_totals()
    {
        std::vector<std::uint8_t> next_rules = rule_of_;
        for (std::size_t component = 0; component < of_component_.size(); ++component)
            for (std::size_t quantity = 0; quantity < quantity_count; ++quantity) {
                const double whole = quantity == 0 ? whole_volumes_[component] : 0.0;
                Sums all;
                for (const std::size_t i : of_component_[component])
                    all.add(sums_[i], quantity);
                Integrals& totals = totals_[component];
                const bool is_known = all.line_cells == 0 || all.line_cells >= fewest_cells_of_lines;
                if (const double error = all.total_error(); is_known && error < totals.error[quantity]) {
                    totals.value[quantity] = all.value + whole;
                    totals.error[quantity] = error;
                }
                const double limit = options_.tolerance * (all.magnitude + whole);
                if (options_.wanted[quantity] && totals.error[quantity] > limit)
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
                   all.total_error() * std::pow(order / all_rules[next].order, rate_of_lines) > limit)
                ++next;
            if (next >= end_of_lines())
                next = first_quadrature;
            for (const std::size_t piece : pieces)
                choose(piece, next);
            return;
        }
        // Those with the largest errors, so that half of the limit is left for them.
        std::stable_sort(pieces.begin(), pieces.end(), [&](std::size_t a, std::size_t b) {
            return sums_[a].integrals.error[quantity] < sums_[b].integrals.error[quantity];
        });
        double kept = 0.0;
        for (const std::size_t piece : pieces) {
            kept += sums_[piece].integrals.error[quantity];
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
