// The roots of one ray in one cell; SIMD lanes are the coefficients of a row. Included once for each target.
#include "isospline/cell/solve-inl.h"

#if defined(ISOSPLINE_CELL_SINGLE_RAY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_CELL_SINGLE_RAY_INL_H
#undef ISOSPLINE_CELL_SINGLE_RAY_INL_H
#else
#define ISOSPLINE_CELL_SINGLE_RAY_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// x, y, z and z again, or the one at `first` if vectors have one lane. It avoids memory, because loading a vector that
// was just written in parts is slow.
template <class D>
HWY_INLINE hn::Vec<D> to_vector(D d, const glm::dvec3& from, int first)
{
#if HWY_TARGET == HWY_SCALAR
    return hn::Set(d, first < 3 ? static_cast<float>(from[first]) : 0.0f);
#else
    static_cast<void>(first);
    const auto xy =
        hn::InterleaveLower(d, hn::Set(d, static_cast<float>(from.x)), hn::Set(d, static_cast<float>(from.y)));
    return hn::ConcatLowerLower(d, hn::Set(d, static_cast<float>(from.z)), xy);
#endif
}

// scaled_bernstein() of f - level between the local coordinates `entry` and `exit`.
template <int Degree>
HWY_INLINE Bernstein<3 * Degree, OneFloat>
scaled_bernstein_of_ray(const ReducedCoefficients<Degree, float>& coefficients, const glm::dvec3& entry,
                        const glm::dvec3& exit)
{
    // The weights of all axes: lanes are the axes.
    const hn::CappedTag<float, 4> d;
    using V = hn::Vec<decltype(d)>;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
    alignas(16) float weights[Degree + 1][Degree + 1][4];
    for (int axis = 0; axis < 3; axis += lanes) {
        const auto w = segment_weights<Degree>(to_vector(d, entry, axis), to_vector(d, exit, axis));
        for (int i = 0; i <= Degree; ++i)
            for (int p = 0; p <= Degree; ++p)
                hn::Store(w[i][p], d, weights[i][p] + axis);
    }

    // y and z: lanes are the coefficients of a row.
    alignas(16) float lines[2 * Degree + 1][local_row];
    SegmentWeights<Degree, V> wy, wz;
    for (int i = 0; i <= Degree; ++i)
        for (int p = 0; p <= Degree; ++p) {
            wy[i][p] = hn::Set(d, weights[i][p][1]);
            wz[i][p] = hn::Set(d, weights[i][p][2]);
        }
    for (int i = 0; i <= Degree; i += lanes) {
        const auto load = [&](int j, int k) HWY_ATTR { return hn::Load(d, coefficients.row(j, k) + i); };
        const auto line = contract_yz<Degree>(wy, wz, load);
        for (int q = 0; q <= 2 * Degree; ++q)
            hn::Store(line[q], d, lines[q] + i);
    }

    // x, one coefficient after the other.
    const hn::CappedTag<float, 1> one;
    Bernstein<3 * Degree, OneFloat> scaled;
    for (OneFloat& sum : scaled)
        sum = hn::Zero(one);
    for (int i = 0; i <= Degree; ++i) {
        std::array<OneFloat, Degree + 1> wx;
        std::array<OneFloat, 2 * Degree + 1> line;
        for (int p = 0; p <= Degree; ++p)
            wx[p] = hn::Set(one, weights[i][p][0]);
        for (int q = 0; q <= 2 * Degree; ++q)
            line[q] = hn::Set(one, lines[q][i]);
        contract_x<Degree>(wx, line, scaled);
    }
    return scaled;
}

// What single precision proves about the segment of one ray.
template <int Degree>
struct RayVerdict {
    bool no_root, one_root;
    Bernstein<3 * Degree, OneFloat> scaled; ///< scaled_bernstein() along the segment

    bool rising() const { return hn::GetLane(scaled[0]) < 0.0f; } ///< with one_root: f increases along the ray
};

template <int Degree>
HWY_INLINE RayVerdict<Degree> judge_ray(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside)
{
    constexpr int order = 3 * Degree;
    const ReducedCoefficients<Degree, float> coefficients(cell);
    const auto scaled = scaled_bernstein_of_ray<Degree>(coefficients, ray.at(inside.t_near) - cell.lower,
                                                        ray.at(inside.t_far) - cell.lower);
    Bernstein<order, float> lane;
    for (int r = 0; r <= order; ++r)
        lane[r] = hn::GetLane(scaled[r]);
    const Verdict<float> verdict = judge<order>(lane, coefficients.error());
    return {verdict.no_root, verdict.one_root && !verdict.no_root, scaled};
}

// The only root in a segment, refined from that of single precision; none if double precision does not converge.
template <int Degree>
HWY_INLINE std::optional<RootInCell> only_root(const CellCoefficients& cell, const LatticeRay& ray,
                                               const Interval& inside, const RayVerdict<Degree>& verdict)
{
    const RootEstimate<float> estimate = estimate_one_root<3 * Degree>(verdict.scaled);
    const RowsOfCell<Degree> rows(cell);
    const hn::CappedTag<double, 1> one;
    RootSearch<OneDouble> search;
    for (int axis = 0; axis < 3; ++axis) {
        search.origin[axis] = hn::Set(one, ray.origin[axis]);
        search.direction[axis] = hn::Set(one, ray.direction[axis]);
    }
    search.begin(hn::Set(one, inside.t_near), hn::Set(one, inside.t_far),
                 {hn::Set(one, static_cast<double>(estimate.s)), hn::Set(one, static_cast<double>(estimate.slope))});
    if (!hn::AllTrue(one, refine_root(rows, cell.lower, hn::FirstN(one, 1), search)))
        return std::nullopt;
    return RootInCell{
        hn::GetLane(search.t),
        {hn::GetLane(search.gradient[0]), hn::GetLane(search.gradient[1]), hn::GetLane(search.gradient[2])}};
}

// Whether single precision proves that there is no root in the part of a segment within the ray's limits, if that is
// not all of the segment. A ray that leaves a surface has a root right behind its origin; without this test, that root
// would be refined only to find that it does not count.
template <int Degree>
HWY_INLINE bool has_no_root_within_limits(const CellCoefficients& cell, const LatticeRay& ray, const Interval& inside)
{
    if (inside.t_near >= ray.t_near && inside.t_far <= ray.t_far)
        return false;
    const Interval within{inside.t_near < ray.t_near ? ray.t_near : inside.t_near,
                          inside.t_far > ray.t_far ? ray.t_far : inside.t_far};
    return !(within.t_near <= within.t_far) || judge_ray<Degree>(cell, ray, within).no_root;
}

// The first root within the ray's limits in a segment that is not empty, after what single precision proves.
template <int Degree>
HWY_INLINE std::optional<RootInCell> first_root_after(const RayVerdict<Degree>& verdict, const CellCoefficients& cell,
                                                      const LatticeRay& ray, const Interval& inside)
{
    if (verdict.no_root)
        return std::nullopt;
    if (verdict.one_root)
        if (const auto root = only_root<Degree>(cell, ray, inside, verdict))
            return ray.is_within_limits(root->t) ? root : std::nullopt;
    return first_reference_root<Degree>(cell, ray, inside);
}

// The same of the whole segment.
template <int Degree>
HWY_INLINE std::optional<RootInCell> first_root_in_segment(const CellCoefficients& cell, const LatticeRay& ray,
                                                           const Interval& inside)
{
    if (has_no_root_within_limits<Degree>(cell, ray, inside))
        return std::nullopt;
    return first_root_after(judge_ray<Degree>(cell, ray, inside), cell, ray, inside);
}

// Whether crossings anywhere in a segment count.
HWY_INLINE bool is_within_limits(const LatticeRay& ray, const Interval& inside)
{
    return ray.is_within_limits(inside.t_near) && ray.is_within_limits(inside.t_far);
}

template <int Degree>
std::optional<RootInCell> exact_first_root(const CellCoefficients& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return std::nullopt;
    return first_root_in_segment<Degree>(cell, ray, inside);
}

template <int Degree>
bool exact_any_root(const CellCoefficients& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return false;
    if (has_no_root_within_limits<Degree>(cell, ray, inside))
        return false;
    const RayVerdict<Degree> verdict = judge_ray<Degree>(cell, ray, inside);
    return (verdict.one_root && is_within_limits(ray, inside)) ||
           first_root_after(verdict, cell, ray, inside).has_value();
}

template <int Degree>
void exact_all_roots(const CellCoefficients& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return;
    const RayVerdict<Degree> verdict = judge_ray<Degree>(cell, ray, inside);
    if (verdict.no_root)
        return;
    if (verdict.one_root)
        if (const auto root = only_root<Degree>(cell, ray, inside, verdict)) {
            if (ray.is_within_limits(root->t))
                crossings.push_back({*root, verdict.rising()});
            return;
        }
    all_reference_roots<Degree>(cell, ray, inside, crossings);
}

// All in double precision, except for the start of the search for a root that single precision has proven to be the
// only one. So Method::reference decides on its own whether there is a root, and finds the same number as
// Method::exact.
template <int Degree>
std::optional<RootInCell> reference_first_root(const CellCoefficients& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return std::nullopt;
    if (sign_changes<3 * Degree>(reference_polynomial<Degree>(cell, ray, inside)) == 1)
        if (const RayVerdict<Degree> verdict = judge_ray<Degree>(cell, ray, inside); verdict.one_root)
            if (const auto root = only_root<Degree>(cell, ray, inside, verdict))
                return ray.is_within_limits(root->t) ? root : std::nullopt;
    return first_reference_root<Degree>(cell, ray, inside);
}

template <int Degree>
void reference_all_roots(const CellCoefficients& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near < inside.t_far)
        all_reference_roots<Degree>(cell, ray, inside, crossings);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
