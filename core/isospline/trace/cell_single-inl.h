// The first root of one ray in one cell; SIMD lanes are the coefficients of a row. Included once for each target.
#if defined(ISOSPLINE_TRACE_CELL_SINGLE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_CELL_SINGLE_INL_H
#undef ISOSPLINE_TRACE_CELL_SINGLE_INL_H
#else
#define ISOSPLINE_TRACE_CELL_SINGLE_INL_H
#endif

#include "isospline/trace/cell_kernel-inl.h"
#include "isospline/trace/cell_reference.h"

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

// What single precision can prove of a segment.
enum class Verdict { no_root, one_root, undecided };

// x, y, z and z again, or the one at `first` where vectors have one lane; not through memory, from which a vector that
// was just written in parts is slow to load.
template <class D>
HWY_INLINE hn::Vec<D> ToVector(D d, const glm::dvec3& from, int first)
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

// Scaled Bernstein coefficients of f - level from `entry` to `exit`, which are local coordinates.
template <int Degree>
HWY_INLINE void SegmentPolynomial(const float* HWY_RESTRICT coefficients, const glm::dvec3& entry,
                                  const glm::dvec3& exit, hn::Vec<hn::CappedTag<float, 1>> (&scaled)[3 * Degree + 1])
{
    // The weights of all axes: lanes are the axes.
    const hn::CappedTag<float, 4> d;
    using V = hn::Vec<decltype(d)>;
    constexpr int lanes = static_cast<int>(hn::MaxLanes(d));
    alignas(16) float weights[Degree + 1][Degree + 1][4];
    for (int axis = 0; axis < 3; axis += lanes) {
        V w[Degree + 1][Degree + 1];
        SegmentWeights<Degree>(d, ToVector(d, entry, axis), ToVector(d, exit, axis), w);
        for (int i = 0; i <= Degree; ++i)
            for (int p = 0; p <= Degree; ++p)
                hn::Store(w[i][p], d, weights[i][p] + axis);
    }

    // y and z: lanes are the coefficients of a row.
    alignas(16) float lines[2 * Degree + 1][local_row];
    V wy[Degree + 1][Degree + 1], wz[Degree + 1][Degree + 1];
    for (int i = 0; i <= Degree; ++i)
        for (int p = 0; p <= Degree; ++p) {
            wy[i][p] = hn::Set(d, weights[i][p][1]);
            wz[i][p] = hn::Set(d, weights[i][p][2]);
        }
    for (int i = 0; i <= Degree; i += lanes) {
        V y[2 * Degree + 1];
        const auto load = [&](int j, int k)
                              HWY_ATTR { return hn::Load(d, coefficients + (k * (Degree + 1) + j) * local_row + i); };
        ContractYZ<Degree>(d, wy, wz, load, y);
        for (int q = 0; q <= 2 * Degree; ++q)
            hn::Store(y[q], d, lines[q] + i);
    }

    // x, one coefficient after the other.
    const hn::CappedTag<float, 1> one;
    using Scalar = hn::Vec<decltype(one)>;
    for (Scalar& sum : scaled)
        sum = hn::Zero(one);
    for (int i = 0; i <= Degree; ++i) {
        Scalar wx[Degree + 1], y[2 * Degree + 1];
        for (int p = 0; p <= Degree; ++p)
            wx[p] = hn::Set(one, weights[i][p][0]);
        for (int q = 0; q <= 2 * Degree; ++q)
            y[q] = hn::Set(one, lines[q][i]);
        ContractX<Degree>(wx, y, scaled);
    }
}

// What single precision proves of one segment.
struct Judgement {
    Verdict verdict;
    RootEstimate<float> estimate; ///< with one_root
    bool rising;                  ///< with one_root: f grows through the level
};

// `entry` and `exit` are local coordinates.
template <int Degree>
HWY_INLINE Judgement Judge(const CellBlock& cell, const glm::dvec3& entry, const glm::dvec3& exit)
{
    alignas(64) float coefficients[local_count<Degree>];
    const float error = LoadReduced<Degree>(cell, coefficients);
    const hn::CappedTag<float, 1> one;
    constexpr int order = 3 * Degree;
    hn::Vec<decltype(one)> scaled[order + 1];
    SegmentPolynomial<Degree>(coefficients, entry, exit, scaled);

    // Bit r tells that coefficient r is surely positive, or negative.
    unsigned positive = 0, negative = 0;
    for (int r = 0; r <= order; ++r) {
        const float b = hn::GetLane(scaled[r]);
        const float bound = error * static_cast<float>(binomials<order>[r]);
        positive |= static_cast<unsigned>(b > bound) << r;
        negative |= static_cast<unsigned>(b < -bound) << r;
    }
    constexpr unsigned all = (1u << (order + 1)) - 1u;
    if (positive == all || negative == all)
        return {Verdict::no_root, {}, false};

    // From the first on one sign, from some coefficient on the other, between them at most one that may have either:
    // exactly one change of sign.
    const unsigned first = positive & 1u ? positive : negative, last = positive & 1u ? negative : positive;
    const bool first_is_prefix = (first & 1u) != 0 && (first & (first + 1u)) == 0;
    const unsigned rest = all & ~first;
    const bool last_is_suffix = last != 0 && (last == rest || last == (rest & (rest - 1u)));
    if (!first_is_prefix || !last_is_suffix)
        return {Verdict::undecided, {}, false};
    const auto found = EstimateRoot<order>(one, scaled);
    return {Verdict::one_root, {hn::GetLane(found.s), hn::GetLane(found.slope)}, (negative & 1u) != 0};
}

template <int Degree>
HWY_INLINE Judgement Judge(const CellBlock& cell, const LatticeRay& ray, const Interval& inside)
{
    return Judge<Degree>(cell, ray.at(inside.t_near) - cell.lower, ray.at(inside.t_far) - cell.lower);
}

// The only root in a segment, from where single precision has it; none where double precision does not arrive.
template <int Degree>
HWY_INLINE std::optional<RootInCell> OnlyRoot(const CellBlock& cell, const LatticeRay& ray, const Interval& inside,
                                              const RootEstimate<float>& estimate)
{
    alignas(64) double coefficients[local_count<Degree>];
    LoadReduced<Degree>(cell, coefficients);
    const hn::CappedTag<double, 1> one;
    RootSearch<hn::Vec<decltype(one)>> search;
    for (int axis = 0; axis < 3; ++axis) {
        search.origin[axis] = hn::Set(one, ray.origin[axis]);
        search.direction[axis] = hn::Set(one, ray.direction[axis]);
    }
    search.begin(hn::Set(one, inside.t_near), hn::Set(one, inside.t_far),
                 {hn::Set(one, static_cast<double>(estimate.s)), hn::Set(one, static_cast<double>(estimate.slope))});
    if (!hn::AllTrue(one, RefineRoot<Degree>(one, coefficients, cell.lower, hn::FirstN(one, 1), search)))
        return std::nullopt;
    return RootInCell{
        hn::GetLane(search.t),
        {hn::GetLane(search.gradient[0]), hn::GetLane(search.gradient[1]), hn::GetLane(search.gradient[2])}};
}

// The first root within the ray's limits in the segment of a cell, which is not empty.
template <int Degree>
HWY_INLINE std::optional<RootInCell> FirstRoot(const CellBlock& cell, const LatticeRay& ray, const Interval& inside)
{
    const Judgement judgement = Judge<Degree>(cell, ray, inside);
    if (judgement.verdict == Verdict::no_root)
        return std::nullopt;
    if (judgement.verdict == Verdict::one_root)
        if (const auto root = OnlyRoot<Degree>(cell, ray, inside, judgement.estimate))
            return ray.is_within_limits(root->t) ? root : std::nullopt;
    return reference_first_root<Degree>(cell, ray, inside);
}

template <int Degree>
std::optional<RootInCell> SingleFirstRoot(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return std::nullopt;
    return FirstRoot<Degree>(cell, ray, inside);
}

template <int Degree>
bool SingleAnyRoot(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return false;
    const Judgement judgement = Judge<Degree>(cell, ray, inside);
    if (judgement.verdict == Verdict::no_root)
        return false;
    if (judgement.verdict == Verdict::one_root) {
        if (ray.is_within_limits(inside.t_near) && ray.is_within_limits(inside.t_far))
            return true;
        if (const auto root = OnlyRoot<Degree>(cell, ray, inside, judgement.estimate))
            return ray.is_within_limits(root->t);
    }
    return reference_first_root<Degree>(cell, ray, inside).has_value();
}

template <int Degree>
void SingleAllRoots(const CellBlock& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return;
    const Judgement judgement = Judge<Degree>(cell, ray, inside);
    if (judgement.verdict == Verdict::no_root)
        return;
    if (judgement.verdict == Verdict::one_root)
        if (const auto root = OnlyRoot<Degree>(cell, ray, inside, judgement.estimate)) {
            if (ray.is_within_limits(root->t))
                crossings.push_back({*root, judgement.rising});
            return;
        }
    reference_all_roots<Degree>(cell, ray, inside, crossings);
}

// All in double precision but for the start of the search for a root that single precision has proven to be the only
// one: so Method::reference decides alone whether there is a root, and finds the same number where both see it.
template <int Degree>
std::optional<RootInCell> ReferenceFirstRoot(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (!(inside.t_near < inside.t_far))
        return std::nullopt;
    if (sign_changes<3 * Degree>(reference_polynomial<Degree>(cell, ray, inside)) == 1)
        if (const Judgement judgement = Judge<Degree>(cell, ray, inside); judgement.verdict == Verdict::one_root)
            if (const auto root = OnlyRoot<Degree>(cell, ray, inside, judgement.estimate))
                return ray.is_within_limits(root->t) ? root : std::nullopt;
    return reference_first_root<Degree>(cell, ray, inside);
}

template <int Degree>
void ReferenceAllRoots(const CellBlock& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near < inside.t_far)
        reference_all_roots<Degree>(cell, ray, inside, crossings);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
