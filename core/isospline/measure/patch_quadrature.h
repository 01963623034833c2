// Quadrature over the unit square of functions that are smooth between the zeros of polynomials.
#pragma once

#include "isospline/measure/gauss_legendre.h"
#include "isospline/measure/polynomial.h"

#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace isospline {

/// The nodes of three rules along each axis: the fine one, and two coarser ones for its error. Both are needed. Near a
/// singularity at an end of an interval, the errors of rules next to each other are similar; near one in the middle,
/// those of rules that differ by two nodes are, because both have the middle as a node, or neither has.
inline std::array<int, 3> orders_of_rules(int order)
{
    return {order, std::max(order - 1, 1), std::max(order - 2, 1)};
}

/// A node of one of the rules.
struct PatchNode {
    glm::dvec2 position;
    double weight;
    std::size_t rule; ///< 0 for the fine one
    bool is_resolved; ///< whether the zeros around it are graphs, so that the rule converges
};

/// A node of the fine rule on the zeros of an edge, for integrals along them: `weight` is a length divided by the
/// length of the edge's gradient there.
struct ZeroNode {
    glm::dvec2 position;
    double weight;
};

/// The square is halved until all zeros in a part are graphs over one of its axes. The zeros then cut the part into
/// pieces.
class PatchQuadrature {
public:
    /// Without coarse rules, there is only the fine one.
    explicit PatchQuadrature(int order, bool has_coarse_rules = true)
    {
        for (const int nodes : orders_of_rules(order))
            if (rules_.empty() || has_coarse_rules)
                rules_.push_back(gauss_legendre(nodes));
    }

    /// Resets the count of parts.
    void begin() { patch_count_ = 0; }

    /// Calls `begin_row(coordinate, position)` and then `visit(PatchNode)` for the nodes at this position of a
    /// coordinate, for all rows of all rules on a piece, then `end_piece()`, and so on for all pieces. `cross` is
    /// whether zeros of two edges may meet.
    template <typename BeginRow, typename Visit, typename EndPiece>
    void integrate(std::vector<PatchPolynomial> edges, bool cross, const BeginRow& begin_row, const Visit& visit,
                   const EndPiece& end_piece)
    {
        add({std::move(edges), glm::dvec2(0.0), glm::dvec2(1.0), 0, cross},
            [&](const Patch& patch, int inner, std::size_t cut, bool is_resolved) {
                for (std::size_t rule = 0; rule < rules_.size(); ++rule)
                    add_rule(patch, inner, cut, rule, is_resolved, begin_row, visit);
                end_piece();
            });
    }

    /// Calls `visit(ZeroNode)` for the nodes on the zeros of the first edge, which the others cut into pieces.
    template <typename Visit>
    void integrate_zeros(std::vector<PatchPolynomial> edges, bool cross, const Visit& visit)
    {
        add({std::move(edges), glm::dvec2(0.0), glm::dvec2(1.0), 0, cross, true},
            [&](const Patch& patch, int inner, std::size_t cut, bool) { add_zeros(patch, inner, cut, visit); });
    }

private:
    /// The largest numbers of halvings and of parts.
    static constexpr int deepest_ = 20, most_patches_ = 8192;
    /// Up to this number of halvings, steep graphs are halved: the rules then converge faster.
    static constexpr int deepest_steep_ = 6;
    static constexpr double steep_ = 0.1;
    /// Narrower pieces are left out.
    static constexpr double least_width_ = 1e-13;

    struct Patch {
        std::vector<PatchPolynomial> edges;
        glm::dvec2 lower, size;
        int depth;
        bool cross;
        bool follows_first = false; ///< only the zeros of the first edge matter
    };

    /// Calls `add_piece(patch, inner, cut, is_resolved)` for what is between two outer cuts of a patch.
    template <typename AddPiece>
    void add(Patch patch, const AddPiece& add_piece)
    {
        if (patch.follows_first && !patch.edges.front().has_zeros())
            return;
        std::erase_if(patch.edges, [](const PatchPolynomial& edge) { return !edge.has_zeros(); });
        const auto least_slope = [&](int axis) {
            double least = 1.0;
            for (const PatchPolynomial& edge : patch.edges)
                least = std::min(least, edge.graph_slope(axis));
            return least;
        };
        const double slopes[2] = {least_slope(0), least_slope(1)};
        const int inner = slopes[0] >= slopes[1] ? 0 : 1;
        const bool is_resolved = slopes[inner] > (patch.depth < deepest_steep_ ? steep_ : 0.0);
        if (is_resolved || patch.depth == deepest_ || ++patch_count_ > most_patches_) {
            find_outer_cuts(patch, inner);
            for (std::size_t i = 1; i < outer_cuts_.size(); ++i)
                if (outer_cuts_[i] - outer_cuts_[i - 1] > least_width_)
                    add_piece(patch, inner, i, is_resolved);
            return;
        }
        const int axis = patch.depth % 2;
        for (const bool upper : {false, true}) {
            Patch half{{}, patch.lower, patch.size, patch.depth + 1, patch.cross, patch.follows_first};
            half.size[axis] *= 0.5;
            half.lower[axis] += upper ? half.size[axis] : 0.0;
            for (const PatchPolynomial& edge : patch.edges)
                half.edges.push_back(upper ? edge.part(axis, 0.5, 1.0) : edge.part(axis, 0.0, 0.5));
            add(std::move(half), add_piece);
        }
    }

    /// Finds where the number or the order of the edges' zeros along the inner coordinate changes.
    void find_outer_cuts(const Patch& patch, int inner)
    {
        const int outer = 1 - inner;
        outer_cuts_.assign({0.0, 1.0});
        for (const PatchPolynomial& edge : patch.edges)
            for (const int end : {0, edge.degree[inner]})
                for_each_root(edge.row(outer, end), [&](double s) { outer_cuts_.push_back(s); });
        std::sort(outer_cuts_.begin(), outer_cuts_.end());
        if (!patch.cross)
            return;

        const std::vector<double> ends = outer_cuts_;
        for (std::size_t i = 1; i < ends.size(); ++i)
            for (std::size_t first = 1; first < patch.edges.size(); ++first)
                for (std::size_t second = 0; second < first; ++second) {
                    const auto gap = [&](double s) {
                        return zero_along(patch.edges[first], inner, s) - zero_along(patch.edges[second], inner, s);
                    };
                    const double margin = 1e-9 * (ends[i] - ends[i - 1]);
                    double lower = ends[i - 1] + margin, upper = ends[i] - margin;
                    const bool starts_below = gap(lower) < 0.0;
                    if (!(starts_below ? gap(upper) > 0.0 : gap(lower) > 0.0 && gap(upper) < 0.0))
                        continue; // also if one of them has no zero
                    for (int halving = 0; halving < 48; ++halving) {
                        const double middle = 0.5 * (lower + upper);
                        ((gap(middle) < 0.0) == starts_below ? lower : upper) = middle;
                    }
                    outer_cuts_.push_back(lower);
                }
        std::sort(outer_cuts_.begin(), outer_cuts_.end());
    }

    /// The zero along the inner coordinate, or NaN if there is none.
    static double zero_along(const PatchPolynomial& edge, int inner, double s)
    {
        double zero = std::numeric_limits<double>::quiet_NaN();
        for_each_root(edge.line(inner, s), [&](double root) { zero = root; });
        return zero;
    }

    /// Applies one rule between two outer cuts, and there between the zeros of the edges.
    template <typename BeginRow, typename Visit>
    void add_rule(const Patch& patch, int inner, std::size_t cut, std::size_t rule, bool is_resolved,
                  const BeginRow& begin_row, const Visit& visit)
    {
        const int outer = 1 - inner;
        const std::vector<QuadratureNode>& nodes = rules_[rule];
        const double begin = outer_cuts_[cut - 1], width = outer_cuts_[cut] - begin;
        for (const QuadratureNode& node : nodes) {
            const double s = begin + width * node.position;
            inner_cuts_.assign({0.0, 1.0});
            for (const PatchPolynomial& edge : patch.edges)
                for_each_root(edge.line(inner, s), [&](double root) { inner_cuts_.push_back(root); });
            std::sort(inner_cuts_.begin(), inner_cuts_.end());
            begin_row(outer, patch.lower[outer] + patch.size[outer] * s);
            for (std::size_t j = 1; j < inner_cuts_.size(); ++j) {
                const double length = inner_cuts_[j] - inner_cuts_[j - 1];
                if (!(length > least_width_))
                    continue;
                for (const QuadratureNode& next : nodes) {
                    glm::dvec2 x;
                    x[outer] = s;
                    x[inner] = inner_cuts_[j - 1] + length * next.position;
                    visit(PatchNode{patch.lower + patch.size * x,
                                    width * node.weight * length * next.weight * patch.size.x * patch.size.y, rule,
                                    is_resolved});
                }
            }
        }
    }

    /// Applies the fine rule to the zeros of the first edge between two outer cuts.
    template <typename Visit>
    void add_zeros(const Patch& patch, int inner, std::size_t cut, const Visit& visit) const
    {
        const int outer = 1 - inner;
        const double begin = outer_cuts_[cut - 1], width = outer_cuts_[cut] - begin;
        for (const QuadratureNode& node : rules_.front()) {
            const double s = begin + width * node.position;
            const LinePolynomial line = patch.edges.front().line(inner, s);
            for_each_root(line, [&](double root) {
                glm::dvec2 x;
                x[outer] = s;
                x[inner] = root;
                const double area = width * node.weight * patch.size.x * patch.size.y;
                visit(ZeroNode{patch.lower + patch.size * x, area / std::abs(line.derivative(root))});
            });
        }
    }

    std::vector<std::vector<QuadratureNode>> rules_;
    std::vector<double> outer_cuts_, inner_cuts_; ///< reused, to avoid allocations
    int patch_count_ = 0;
};

} // namespace isospline
