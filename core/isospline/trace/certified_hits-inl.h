// First crossings of rays in parts of their lines, and the model around them, with proven bounds; SIMD lanes are the
// parts: docs/method.md, "Certified rays". Included once for each SIMD target.
#include "isospline/cell/lane_mask-inl.h"
#include "isospline/trace/certified_lines-inl.h"
#include "isospline/trace/certified_parts-inl.h"
#include "isospline/trace/certified_ray.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#if defined(ISOSPLINE_TRACE_CERTIFIED_HITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ISOSPLINE_TRACE_CERTIFIED_HITS_INL_H
#undef ISOSPLINE_TRACE_CERTIFIED_HITS_INL_H
#else
#define ISOSPLINE_TRACE_CERTIFIED_HITS_INL_H
#endif

HWY_BEFORE_NAMESPACE();
namespace isospline {
namespace HWY_NAMESPACE {

/// The parts of a list from `first` on, and their lines.
struct LinesOfParts {
    using N = CertifiedNumber;

    LinesOfParts(const CertifiedLines& lines, const CertifiedPartList& list, std::size_t first_part)
        : parts(list), first(first_part)
    {
        t_begin = column(CertifiedPartList::t_begin);
        t_end = column(CertifiedPartList::t_end);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            start[axis] = of_lanes(lines.start[axis]);
            along[axis] = of_lanes(lines.along[axis]);
            cell[axis] = column(CertifiedPartList::cell + axis);
        }
    }

    HWY_INLINE N column(std::size_t item) const { return hn::LoadU(CertifiedDoubles(), parts[item] + first); }
    /// Numbers of the lanes of the packet, one for each part.
    HWY_INLINE N of_lanes(const double* numbers) const
    {
        alignas(64) double of_parts[certified_width];
        for (std::size_t i = 0; i < certified_width; ++i)
            of_parts[i] = numbers[lane(i)];
        return hn::Load(CertifiedDoubles(), of_parts);
    }
    std::size_t lane(std::size_t part) const
    {
        return static_cast<std::size_t>(parts.at(CertifiedPartList::lane, first + part));
    }
    /// A coordinate of the point at t.
    HWY_INLINE N point(std::size_t axis, N t) const { return start[axis] + t * along[axis]; }

    const CertifiedPartList& parts;
    std::size_t first;
    N t_begin, t_end;
    Vector3<N> start, along, cell;
};

/// The crossings next to hints, proven as certified::Search does.
template <int Degree>
struct CertifiedCrossings {
    using N = CertifiedNumber;
    static constexpr int order = 3 * Degree;

    /// f has the `side` before each part, which is 0 where nothing is before it. The crossing is at the hint.
    HWY_INLINE CertifiedCrossings(const CertifiedParts<Degree>& parts, const LinesOfParts& lines, N known_side,
                                  N t_hint)
    {
        const Bernstein<order, N>& b = parts.polynomial();
        const N zero = number<N>(0.0), error = parts.error(), length = lines.t_end - lines.t_begin;
        const N side = select(equal(known_side, zero), proven_sign(b[0], error), known_side);
        N s = (t_hint - lines.t_begin) / length, moved, slope;
        for (int step = 0; step < 2; ++step) {
            Bernstein<order, N> level = b;
            const N rest = number<N>(1.0) - s;
            for (std::size_t row = order; row > 1; --row)
                for (std::size_t j = 0; j < row; ++j)
                    level[j] = mul_add(s, level[j + 1], rest * level[j]);
            slope = number<N>(order) * (level[1] - level[0]);
            moved = mul_add(s, level[1], rest * level[0]) / slope;
            s = s - moved;
        }
        const N margin = larger(number<N>(2.0) * error / absolute(slope), number<N>(0x1p-46));
        const N before = s - margin, behind = s + margin;
        is_proven = both(less(absolute(moved), number<N>(0x1p-40)),
                         both(less(zero, before), both(less(behind, number<N>(1.0)), less(zero, absolute(side)))));
        for (const N& each : piece_before<order>(b, before))
            is_proven = both(is_proven, less(error, side * each));
        is_proven = both(is_proven, less(side * piece_before<order>(b, behind)[order], negated(error)));

        // t of s: rounded outwards by more than its three roundings.
        const N rounding = number<N>(0x1p-50) * (absolute(lines.t_begin) + absolute(lines.t_end));
        t_lower = larger(lines.t_begin + before * length - rounding, lines.t_begin);
        t_upper = smaller(lines.t_begin + behind * length + rounding, lines.t_end);
    }

    N t_lower, t_upper;
    MaskOf<N> is_proven;
};

/// The surface at hits, as RayCertifier::describe_hit() finds it, for degrees of at least 2.
template <int Degree>
struct CertifiedNormals {
    using N = CertifiedNumber;

    HWY_INLINE CertifiedNormals(const IsosurfaceSnapshot& surface, const certified::Placement& placement,
                                const CertifiedParts<Degree>& parts, const LinesOfParts& lines, N t_lower, N t_upper,
                                N point_error, N speed)
    {
        const N zero = number<N>(0.0), one = number<N>(1.0), slope = number<N>(placement.slope);
        const N t = number<N>(0.5) * t_lower + number<N>(0.5) * t_upper;
        const N radius = (point_error + (t_upper - t_lower) * speed) * number<N>(1.0 + 0x1p-40);
        Vector3<N> within;
        N beside = zero, room = one;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const N local = lines.point(axis, t) - lines.cell[axis];
            within[axis] = smaller(larger(local, zero), one);
            beside = beside + absolute(local - within[axis]);
            room = smaller(smaller(local, one - local), room);
        }
        const N twice = number<N>(2.0) * slope;
        const N bend = select(less(radius, room), smaller(twice, number<N>(4.0) * parts.magnitude()), twice);
        const N gradient_error =
            (bend * (radius + beside) + number<N>(2.0) * parts.polynomial_error()) * number<N>(1.0 + 0x1p-40);
        const Vector3<N> gradient = gradient_of(parts, within, number<N>(surface.threshold()));

        // The transposed map takes the gradient to the space of the rays, where the vectors are in a ball.
        Vector3<N> normal;
        N radii = zero;
        for (std::size_t i = 0; i < 3; ++i) {
            N value = zero, error = zero;
            for (std::size_t j = 0; j < 3; ++j) {
                const Enclosure& entry = placement.to_lattice[j][i];
                value = value + number<N>(entry.value * -surface.inward_sign()) * gradient[j];
                error = error + number<N>((std::abs(entry.value) + entry.radius) * (1.0 + 0x1p-40)) * gradient_error +
                        number<N>(placement.product_error[j][i]) * absolute(gradient[j]);
            }
            normal[i] = value;
            error = error * number<N>(1.0 + 0x1p-40) + number<N>(0x1p-900);
            radii = radii + error * error;
        }
        const N length = square_root(dot(normal, normal)), ball = square_root(radii) * number<N>(1.0 + 0x1p-40);
        const N sine = ball / length * number<N>(1.0 + 0x1p-40);
        const auto is_known = less(sine, one);
        // asin(x) is below x + x^3 up to 1/2, and below pi / 2 x.
        angle = select(less(sine, number<N>(0.5)), sine + sine * sine * sine, number<N>(1.5708) * sine) +
                number<N>(0x1p-50);
        angle = select(is_known, angle, number<N>(std::numbers::pi));
        for (std::size_t i = 0; i < 3; ++i)
            unit[i] = select(is_known, normal[i] / length, zero);
        const N least_length = select(is_known, (length - ball) * number<N>(1.0 - 0x1p-40), zero);
        find_model_distance(surface, placement, lines, t, radius, least_length);
    }

    Vector3<N> unit; ///< the axis of the cone
    N angle, model_distance;

private:
    static constexpr std::size_t count = Degree + 1;

    /// The derivatives of f at a place in each cell.
    HWY_INLINE static Vector3<N> gradient_of(const CertifiedParts<Degree>& parts, const Vector3<N>& place, N threshold)
    {
        const N zero = number<N>(0.0);
        std::array<std::array<N, count>, 3> values, slopes;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            values[axis] = polar_weights<Degree, 0>(place[axis], place[axis]);
            const auto lower = polar_weights<Degree - 1, 0>(place[axis], place[axis]);
            slopes[axis].fill(zero);
            for (std::size_t i = 0; i < Degree; ++i) { // the weights of c_(i+1) - c_i
                slopes[axis][i] = slopes[axis][i] - lower[i];
                slopes[axis][i + 1] = slopes[axis][i + 1] + lower[i];
            }
        }
        Vector3<N> total{zero, zero, zero};
        for (std::size_t k = 0; k < count; ++k) {
            N value = zero, along_x = zero, along_y = zero;
            for (std::size_t j = 0; j < count; ++j) {
                N of_row = zero, slope_of_row = zero;
                const std::array<N, count> row = parts.row(j, k, threshold);
                for (std::size_t i = 0; i < count; ++i) {
                    of_row = mul_add(values[0][i], row[i], of_row);
                    slope_of_row = mul_add(slopes[0][i], row[i], slope_of_row);
                }
                value = mul_add(values[1][j], of_row, value);
                along_x = mul_add(values[1][j], slope_of_row, along_x);
                along_y = mul_add(slopes[1][j], of_row, along_y);
            }
            total[0] = mul_add(values[2][k], along_x, total[0]);
            total[1] = mul_add(values[2][k], along_y, total[1]);
            total[2] = mul_add(slopes[2][k], value, total[2]);
        }
        return total;
    }

    /// Along the normal, to both sides, until f is beyond the level by more than all errors.
    HWY_INLINE void find_model_distance(const IsosurfaceSnapshot& surface, const certified::Placement& placement,
                                        const LinesOfParts& lines, N t, N radius, N least_length)
    {
        const N zero = number<N>(0.0), one = number<N>(1.0), slope = number<N>(placement.slope);
        Vector3<N> along;
        N sum = zero;
        auto can_move = less(zero, least_length);
        N room = number<N>(std::numeric_limits<double>::infinity()); // in units of `along`
        for (std::size_t i = 0; i < 3; ++i) {
            along[i] = zero;
            for (std::size_t j = 0; j < 3; ++j)
                along[i] = along[i] + number<N>(placement.to_lattice[i][j].value) * unit[j];
            sum = sum + absolute(along[i]);
            // To the nearest face of the domain.
            const N point = lines.point(i, t);
            const N size = number<N>(surface.volume().cell_shape()[static_cast<int>(i)]);
            room = smaller(smaller(point, size - point) / absolute(along[i]), room);
        }
        const N longest = smaller(one / sum, room * number<N>(1.0 - 0x1p-40));
        const N growth = least_length - slope * number<N>(placement.along_error);
        const double rounding =
            placement.coefficient_error + placement.threshold_error + 0x1p-52 * std::abs(surface.threshold());
        const N least = number<N>(rounding);
        N distance = larger(number<N>(1.125) * least / growth, number<N>(0x1p-50) / sum);
        model_distance = number<N>(std::numeric_limits<double>::infinity());
        can_move = both(can_move, less(zero, growth));
        while (true) {
            can_move = both(can_move, less_equal(distance, longest));
            if (hn::AllFalse(CertifiedDoubles(), can_move))
                return;
            const N moved = distance * sum;
            const N error = (least + slope * (radius + moved * moved)) * number<N>(1.0 + 0x1p-40);
            const auto is_found = both(can_move, less(error, distance * growth));
            const N found = (distance * number<N>(1.0 + placement.longest_edge * placement.along_error) +
                             number<N>(2.0) * radius * number<N>(placement.longest_edge)) *
                            number<N>(1.0 + 0x1p-40);
            model_distance = select(is_found, found, model_distance);
            can_move = without(can_move, is_found);
            distance = distance * number<N>(2.0);
        }
    }
};

/// Sets the certificates of the lanes of these parts that cross the surface, from `first` on; returns them. f has
/// `sides` before.
template <int Degree>
LaneMask set_certified_hits(const IsosurfaceSnapshot& surface, const certified::Placement& placement,
                            const CertifiedLines& lines, const CertifiedPartList& parts, std::size_t first,
                            const double* sides, const double* t_hints, RayCertificate* certificates)
{
    const CertifiedDoubles d;
    const LinesOfParts lines_of_parts(lines, parts, first);
    const auto of_lanes = [&](const double* numbers) HWY_ATTR { return lines_of_parts.of_lanes(numbers); };
    const CertifiedParts<Degree> in_lanes(surface, placement, parts, first);
    const CertifiedCrossings<Degree> crossings(in_lanes, lines_of_parts, of_lanes(sides), of_lanes(t_hints));
    const auto is_within = both(less_equal(of_lanes(lines.sure_begin), crossings.t_lower),
                                less_equal(crossings.t_upper, of_lanes(lines.sure_end)));
    const std::size_t count = std::min(parts.size() - first, certified_width);
    const LaneMask proven = to_lane_mask(d, both(crossings.is_proven, is_within), 0) & ((LaneMask{1} << count) - 1);
    if (proven == 0)
        return 0;
    alignas(64) double numbers[7][certified_width];
    hn::Store(crossings.t_lower, d, numbers[0]);
    hn::Store(crossings.t_upper, d, numbers[1]);
    if constexpr (Degree >= 2) {
        const CertifiedNormals<Degree> normals(surface, placement, in_lanes, lines_of_parts, crossings.t_lower,
                                               crossings.t_upper, of_lanes(lines.point_error), of_lanes(lines.speed));
        for (std::size_t axis = 0; axis < 3; ++axis)
            hn::Store(normals.unit[axis], d, numbers[2 + axis]);
        hn::Store(normals.angle, d, numbers[5]);
        hn::Store(normals.model_distance, d, numbers[6]);
    }
    LaneMask lanes = 0;
    for (LaneMask rest = proven; rest != 0; rest &= rest - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(rest));
        const std::size_t lane = lines_of_parts.lane(i);
        RayCertificate& certificate = certificates[lane];
        certificate = {RayStatus::hit, numbers[0][i], numbers[1][i]};
        if constexpr (Degree >= 2) {
            certificate.normal = {numbers[2][i], numbers[3][i], numbers[4][i]};
            certificate.normal_angle = numbers[5][i];
            certificate.model_distance = numbers[6][i];
        }
        lanes |= LaneMask{1} << lane;
    }
    return lanes;
}

} // namespace HWY_NAMESPACE
} // namespace isospline
HWY_AFTER_NAMESPACE();

#endif
