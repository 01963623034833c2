// Quadrature over the unit square of functions that are smooth between the zeros of polynomials.
#pragma once

#include "isospline/measure/gauss_legendre.h"
#include "isospline/measure/polynomial.h"

#include <glm/vec2.hpp>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace isospline {

/// The nodes of the coarse rule along each axis, for those of the fine rule. With one node less, it is not coarse
/// enough for the difference to bound the error of the fine rule: near a singularity, the errors of rules next to each
/// other are similar. That of a curvature's integral was up to eight times the difference.
inline int coarse_order(int order)
{
    return std::max(order - 2, 1);
}

/// A node of one of two rules, the fine and the coarse one.
struct PatchNode {
    glm::dvec2 position;
    double weight;
    bool is_fine;
    bool is_resolved; ///< whether the zeros around it are graphs, so that the rule converges
};

/// The square is halved until all zeros in a part are graphs over one of its axes. The zeros then cut the part into
/// pieces.
class PatchQuadrature {
public:
    explicit PatchQuadrature(int order) : fine_(gauss_legendre(order)), coarse_(gauss_legendre(coarse_order(order))) {}

    /// Resets the count of parts.
    void begin() { patch_count_ = 0; }

    /// Calls `visit(PatchNode)` for the nodes of both rules on a piece, then `end_piece()`, and so on for all pieces.
    /// `cross` is whether zeros of two edges may meet.
    template <typename Visit, typename EndPiece>
    void integrate(std::vector<PatchPolynomial> edges, bool cross, const Visit& visit, const EndPiece& end_piece)
    {
        add({std::move(edges), glm::dvec2(0.0), glm::dvec2(1.0), 0, cross}, visit, end_piece);
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
    };

    template <typename Visit, typename EndPiece>
    void add(Patch patch, const Visit& visit, const EndPiece& end_piece)
    {
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
            for (std::size_t i = 1; i < outer_cuts_.size(); ++i) {
                if (!(outer_cuts_[i] - outer_cuts_[i - 1] > least_width_))
                    continue;
                for (const bool is_fine : {true, false})
                    add_rule(patch, inner, i, is_fine, is_resolved, visit);
                end_piece();
            }
            return;
        }
        const int axis = patch.depth % 2;
        for (const bool upper : {false, true}) {
            Patch half{{}, patch.lower, patch.size, patch.depth + 1, patch.cross};
            half.size[axis] *= 0.5;
            half.lower[axis] += upper ? half.size[axis] : 0.0;
            for (const PatchPolynomial& edge : patch.edges)
                half.edges.push_back(upper ? edge.part(axis, 0.5, 1.0) : edge.part(axis, 0.0, 0.5));
            add(std::move(half), visit, end_piece);
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
    template <typename Visit>
    void add_rule(const Patch& patch, int inner, std::size_t cut, bool is_fine, bool is_resolved, const Visit& visit)
    {
        const int outer = 1 - inner;
        const std::vector<QuadratureNode>& rule = is_fine ? fine_ : coarse_;
        const double begin = outer_cuts_[cut - 1], width = outer_cuts_[cut] - begin;
        for (const QuadratureNode& node : rule) {
            const double s = begin + width * node.position;
            inner_cuts_.assign({0.0, 1.0});
            for (const PatchPolynomial& edge : patch.edges)
                for_each_root(edge.line(inner, s), [&](double root) { inner_cuts_.push_back(root); });
            std::sort(inner_cuts_.begin(), inner_cuts_.end());
            for (std::size_t j = 1; j < inner_cuts_.size(); ++j) {
                const double length = inner_cuts_[j] - inner_cuts_[j - 1];
                if (!(length > least_width_))
                    continue;
                for (const QuadratureNode& next : rule) {
                    glm::dvec2 x;
                    x[outer] = s;
                    x[inner] = inner_cuts_[j - 1] + length * next.position;
                    visit(PatchNode{patch.lower + patch.size * x,
                                    width * node.weight * length * next.weight * patch.size.x * patch.size.y, is_fine,
                                    is_resolved});
                }
            }
        }
    }

    std::vector<QuadratureNode> fine_, coarse_;
    std::vector<double> outer_cuts_, inner_cuts_; ///< reused, to avoid allocations
    int patch_count_ = 0;
};

} // namespace isospline
