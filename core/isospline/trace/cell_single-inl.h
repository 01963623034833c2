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

// What single precision proves from `entry` to `exit`, and with one_root about where it is, in [0, 1].
template <int Degree>
HWY_INLINE Verdict Judge(const CellBlock& cell, const glm::dvec3& entry, const glm::dvec3& exit,
                         RootEstimate<float>& estimate)
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
        return Verdict::no_root;

    // From the first on one sign, from some coefficient on the other, between them at most one that may have either:
    // exactly one change of sign.
    const unsigned first = positive & 1u ? positive : negative, last = positive & 1u ? negative : positive;
    const bool first_is_prefix = (first & 1u) != 0 && (first & (first + 1u)) == 0;
    const unsigned rest = all & ~first;
    const bool last_is_suffix = last != 0 && (last == rest || last == (rest & (rest - 1u)));
    if (!first_is_prefix || !last_is_suffix)
        return Verdict::undecided;
    const auto found = EstimateRoot<order>(one, scaled);
    estimate = {hn::GetLane(found.s), hn::GetLane(found.slope)};
    return Verdict::one_root;
}

// The first root of a ray that is inside the cell in the interval, which is not empty.
template <int Degree>
HWY_INLINE std::optional<RootInCell> FirstRoot(const CellBlock& cell, const glm::dvec3& origin,
                                               const glm::dvec3& direction, const Interval& inside)
{
    const glm::dvec3 entry = (origin + inside.t_near * direction) - cell.lower;
    const glm::dvec3 exit = (origin + inside.t_far * direction) - cell.lower;
    RootEstimate<float> estimate;
    switch (Judge<Degree>(cell, entry, exit, estimate)) {
    case Verdict::no_root:
        return std::nullopt;
    case Verdict::one_root: {
        alignas(64) double coefficients[local_count<Degree>];
        LoadReduced<Degree>(cell, coefficients);
        const hn::CappedTag<double, 1> one;
        RootSearch<hn::Vec<decltype(one)>> search;
        for (int axis = 0; axis < 3; ++axis) {
            search.origin[axis] = hn::Set(one, origin[axis]);
            search.direction[axis] = hn::Set(one, direction[axis]);
        }
        search.begin(
            hn::Set(one, inside.t_near), hn::Set(one, inside.t_far),
            {hn::Set(one, static_cast<double>(estimate.s)), hn::Set(one, static_cast<double>(estimate.slope))});
        if (hn::AllTrue(one, RefineRoot<Degree>(one, coefficients, cell.lower, hn::FirstN(one, 1), search)))
            return RootInCell{
                hn::GetLane(search.t),
                {hn::GetLane(search.gradient[0]), hn::GetLane(search.gradient[1]), hn::GetLane(search.gradient[2])}};
        break;
    }
    case Verdict::undecided:
        break;
    }
    return reference_first_root<Degree>(cell, origin, direction, inside);
}

template <int Degree>
std::optional<RootInCell> SingleFirstRoot(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near > inside.t_far)
        return std::nullopt;
    return FirstRoot<Degree>(cell, ray.origin, ray.direction, inside);
}

template <int Degree>
bool SingleAnyRoot(const CellBlock& cell, const LatticeRay& ray)
{
    const Interval inside = ray.inside_cell(cell.lower);
    if (inside.t_near > inside.t_far)
        return false;
    RootEstimate<float> estimate;
    const Verdict verdict =
        Judge<Degree>(cell, ray.at(inside.t_near) - cell.lower, ray.at(inside.t_far) - cell.lower, estimate);
    return verdict == Verdict::one_root ||
           (verdict == Verdict::undecided &&
            reference_first_root<Degree>(cell, ray.origin, ray.direction, inside).has_value());
}

template <int Degree>
void SingleAllRoots(const CellBlock& cell, const LatticeRay& ray, std::vector<CrossingInCell>& crossings)
{
    if (SingleAnyRoot<Degree>(cell, ray))
        reference_all_roots<Degree>(cell, ray, crossings);
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
