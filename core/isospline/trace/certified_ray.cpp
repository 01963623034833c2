#include "isospline/trace/certified_ray.h"

#include "isospline/brick/brick.h"
#include "isospline/math/bernstein_box.h"
#include "isospline/math/grid.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/certified_line.h"
#include "isospline/trace/certified_packet.h"
#include "isospline/trace/certified_place.h"
#include "isospline/trace/certified_placement.h"
#include "isospline/trace/certified_polynomial.h"
#include "isospline/util/error.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace isospline {

namespace {

/// The smallest and the largest coefficient of a cell, minus the threshold.
template <int Degree>
Extremes<double> extremes(const CoefficientView& cell, double threshold)
{
    // Four coefficients of each row may be read, so that lanes hold them.
    std::array<float, 4> least, most;
    std::copy_n(cell.first, 4, least.begin());
    most = least;
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j) {
            const float* const row = cell.first + j * cell.row_stride + k * cell.slice_stride;
            for (std::size_t i = 0; i < 4; ++i) {
                least[i] = row[i] < least[i] ? row[i] : least[i];
                most[i] = row[i] > most[i] ? row[i] : most[i];
            }
        }
    return {static_cast<double>(*std::min_element(least.begin(), least.begin() + Degree + 1)) - threshold,
            static_cast<double>(*std::max_element(most.begin(), most.begin() + Degree + 1)) - threshold};
}

/// One ray, in lattice space.
template <int Degree>
class Certification {
public:
    Certification(const IsosurfaceSnapshot& surface, const certified::Line& line, const certified::Range& range,
                  double slope, double threshold_error, double t_hint)
        : volume_(surface.volume()), ranges_(*surface.shared_ranges()), threshold_(surface.threshold()), line_(line),
          range_(range), slope_(slope * (1.0 + 0x1p-20)), search_(range, t_hint)
    {
        const double t_most = std::max(std::abs(range.begin), std::abs(range.end));
        error_ = slope_ * line.error(t_most) + threshold_error + 0x1p-52 * std::abs(threshold_);
        for (int axis = 0; axis < 3; ++axis)
            inverse_along_[axis] = 1.0 / line.along[static_cast<std::size_t>(axis)].value;
    }

    certified::Search run()
    {
        if (!std::isfinite(error_)) {
            search_.give_up(range_.begin);
            return search_;
        }
        walk(brick_size, glm::ivec3(0), (volume_.cell_shape() - 1) / brick_size, range_.begin, range_.end,
             [&](const glm::ivec3& brick, const Part& part) { pass_brick(brick, part); });
        search_.end();
        return search_;
    }

private:
    /// A part of the line, and the points at its ends.
    struct Part {
        double t_begin, t_end;
        glm::dvec3 begin, end;
    };

    /// Calls `pass(cell, part)` for parts of the line that cover [t_begin, t_end], until the search is decided.
    template <typename Pass>
    void walk(int size, const glm::ivec3& first, const glm::ivec3& last, double t_begin, double t_end, const Pass& pass)
    {
        certified::Walk cells(line_, inverse_along_, size, first, last, t_begin);
        Part part{t_begin, t_begin, line_.at(t_begin), {}};
        while (true) {
            part.t_end = std::clamp(cells.t_exit(), part.t_begin, t_end);
            if (part.t_end > part.t_begin || t_begin == t_end) {
                part.end = line_.at(part.t_end);
                pass(cells.cell(), part);
            }
            if (search_.is_decided() || part.t_end == t_end)
                return;
            part.t_begin = part.t_end;
            part.begin = line_.at(part.t_begin);
            cells.advance();
        }
    }

    /// How far f may be, on a part, from f at the nearest points of a box of cells: the part may be beside it, within
    /// rounding.
    double error(const Part& part, const glm::dvec3& lower, const glm::dvec3& upper) const
    {
        const glm::dvec3 below = lower - glm::min(part.begin, part.end);
        const glm::dvec3 above = glm::max(part.begin, part.end) - upper;
        const glm::dvec3 beside = glm::max(glm::max(below, above), 0.0);
        return error_ + slope_ * (beside.x + beside.y + beside.z);
    }

    void pass_brick(const glm::ivec3& position, const Part& part)
    {
        const Brick brick = brick_at(volume_.cell_shape(), position);
        const BrickRanges::Range range = ranges_.brick(position);
        const Extremes<double> bounds{static_cast<double>(range.lower) - threshold_,
                                      static_cast<double>(range.upper) - threshold_};
        const double off = error(part, glm::dvec3(brick.first), glm::dvec3(brick.first + brick.size));
        if (const int sign = sign_of(bounds, off); sign != 0)
            return search_.pass(part.t_begin, sign);
        if (!ranges_.has_blocks())
            return walk_cells(brick.first, brick.size, part);
        constexpr int edge = 2;
        const double near = 4.0 * error_;
        const glm::ivec3 first_block = brick.first / edge;
        const BrickRanges::BlockSides sides = ranges_.block_sides(position, threshold_ - near, threshold_ + near);
        walk(edge, first_block, (brick.first + brick.size - 1) / edge, part.t_begin, part.t_end,
             [&](const glm::ivec3& block, const Part& in_block) {
                 const glm::ivec3 at = block - first_block, first = block * edge;
                 const glm::ivec3 size = glm::min(glm::ivec3(edge), brick.first + brick.size - first);
                 const int side = sides[static_cast<std::size_t>(at.x + 4 * (at.y + 4 * at.z))];
                 if (side != 0 && error(in_block, glm::dvec3(first), glm::dvec3(first + size)) < near)
                     search_.pass(in_block.t_begin, side);
                 else
                     walk_cells(first, size, in_block);
             });
    }

    void walk_cells(const glm::ivec3& first, const glm::ivec3& size, const Part& part)
    {
        walk(1, first, first + size - 1, part.t_begin, part.t_end,
             [&](const glm::ivec3& cell, const Part& in_cell) { pass_cell(cell, in_cell); });
    }

    void pass_cell(const glm::ivec3& cell, const Part& part)
    {
        const CoefficientView coefficients = volume_.cell(cell, own_.data());
        const Extremes<double> bounds = extremes<Degree>(coefficients, threshold_);
        const glm::dvec3 lower(cell);
        const double off = error(part, lower, lower + 1.0);
        if (const int sign = sign_of(bounds, off); sign != 0)
            return search_.pass(part.t_begin, sign);
        const auto b = certified::polynomial_along<Degree>(
            coefficients, threshold_, glm::clamp(part.begin - lower, 0.0, 1.0), glm::clamp(part.end - lower, 0.0, 1.0));
        const double magnitude = std::max(std::abs(bounds.least), std::abs(bounds.most));
        search_.template pass<3 * Degree>(part.t_begin, part.t_end, b,
                                          (off + certified::polynomial_error(magnitude)) * (1.0 + 0x1p-40));
    }

    /// The sign of all numbers from `least` to `most`, if it is proven.
    static int sign_of(const Extremes<double>& bounds, double error)
    {
        // Differences of coefficients and the threshold are rounded.
        const double bound = error + 0x1p-52 * std::max(std::abs(bounds.least), std::abs(bounds.most));
        return bounds.least > bound ? 1 : bounds.most < -bound ? -1 : 0;
    }

    const Volume& volume_;
    const BrickRanges& ranges_;
    double threshold_;
    const certified::Line& line_;
    const certified::Range& range_;
    double slope_, error_;
    glm::dvec3 inverse_along_;
    certified::Search search_;
    std::array<float, 64> own_; ///< coefficients of a volume that has none in memory
};

/// Throws for surfaces that are not the whole surface of the model.
void check_certifiable(const IsosurfaceOptions& options, const char* parameter)
{
    const char* const found = !options.clip.empty()         ? "one with a clip"
                              : options.closed              ? "a closed one"
                              : !options.shell.mask.empty() ? "one with a mask"
                              : options.largest != 0        ? "one with largest="
                                                            : nullptr;
    if (found != nullptr)
        throw_invalid(parameter, "isosurfaces that are neither clipped, closed nor masked", found);
}

} // namespace

RayCertifier::RayCertifier(std::shared_ptr<const IsosurfaceSnapshot> surface, const glm::dmat4& transform,
                           const char* parameter)
    : surface_(std::move(surface)), placement_(*surface_, transform)
{
    check_certifiable(surface_->options(), parameter);
}

certified::Line RayCertifier::line_of(const glm::dvec3& origin, const glm::dvec3& direction) const
{
    certified::Line line;
    std::array<Enclosure, 3> from_origin, along;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<int>(i);
        from_origin[i] = Enclosure(origin[axis]) - placement_.origin[i];
        along[i] = direction[axis];
    }
    for (std::size_t i = 0; i < 3; ++i) {
        line.start[i] = certified::dot(placement_.to_lattice[i], from_origin) + surface_->volume().lattice_shift();
        line.along[i] = certified::dot(placement_.to_lattice[i], along);
    }
    return line;
}

certified::Range RayCertifier::range_of(const certified::Line& line, const Ray& ray) const
{
    return line.clip(glm::dvec3(surface_->volume().cell_shape()), ray.t_near, ray.t_far);
}

certified::Search RayCertifier::search(const Ray& ray) const
{
    const certified::Line line = line_of(ray.origin, ray.direction);
    return search(line, range_of(line, ray), std::numeric_limits<double>::infinity());
}

certified::Search RayCertifier::search(const certified::Line& line, const certified::Range& range, double t_hint) const
{
    if (range.begin > range.end)
        return certified::Search(range);
    return dispatch_degree(surface_->volume().degree(), [&](auto degree) {
        return Certification<degree>(*surface_, line, range, placement_.slope, placement_.threshold_error, t_hint)
            .run();
    });
}

RayCertificate RayCertifier::certify(const Ray& ray, double t_hint) const
{
    const certified::Line line = line_of(ray.origin, ray.direction);
    RayCertificate certificate = search(line, range_of(line, ray), t_hint).certificate();
    if (certificate.status == RayStatus::hit)
        dispatch_degree(surface_->volume().degree(), [&](auto degree) { describe_hit<degree>(line, certificate); });
    return certificate;
}

void RayCertifier::certify(const RayPacket& rays, LaneMask lanes, std::span<const double, packet_capacity> t_hints,
                           std::span<RayCertificate, packet_capacity> certificates) const
{
    const LaneMask proven = certified::certify_packet(*surface_, placement_, rays, lanes, t_hints, certificates);
    for (LaneMask rest = lanes & ~proven; rest != 0; rest &= rest - 1) {
        const int lane = std::countr_zero(rest);
        const auto item = static_cast<std::size_t>(lane);
        certificates[item] = certify(rays.ray(lane), t_hints[item]);
    }
    if (surface_->volume().degree() >= 2)
        return;
    for (LaneMask rest = proven; rest != 0; rest &= rest - 1) { // gradients jump between cells
        const int lane = std::countr_zero(rest);
        const Ray ray = rays.ray(lane);
        if (RayCertificate& own = certificates[static_cast<std::size_t>(lane)]; own.status == RayStatus::hit)
            describe_hit<1>(line_of(ray.origin, ray.direction), own);
    }
}

template <int Degree>
void RayCertifier::describe_hit(const certified::Line& line, RayCertificate& hit) const
{
    const certified::PlaceOnSurface<Degree> place(surface_->volume(), surface_->threshold(), placement_.slope, line,
                                                  hit.t_lower, hit.t_upper);
    std::array<Enclosure, 3> normal; // not of unit length
    for (std::size_t i = 0; i < 3; ++i) {
        const std::array<Enclosure, 3> column{placement_.to_lattice[0][i], placement_.to_lattice[1][i],
                                              placement_.to_lattice[2][i]};
        normal[i] = certified::dot(column, place.gradient()) * -surface_->inward_sign();
    }
    const certified::Cone cone = certified::cone_of(normal);
    hit.normal = cone.axis;
    hit.normal_angle = cone.angle;
    hit.model_distance = std::numeric_limits<double>::infinity();
    if (cone.axis == glm::dvec3(0.0))
        return;

    // Along the normal, to both sides, until f is beyond the level by more than all errors.
    glm::dvec3 along(0.0);
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t j = 0; j < 3; ++j)
            along[axis] +=
                placement_.to_lattice[static_cast<std::size_t>(axis)][j].value * cone.axis[static_cast<int>(j)];
    const double longest = 1.0 / (std::abs(along.x) + std::abs(along.y) + std::abs(along.z));
    const double growth = cone.least_length - placement_.slope * placement_.along_error;
    const double least =
        placement_.coefficient_error + placement_.threshold_error + 0x1p-52 * std::abs(surface_->threshold());
    for (double distance = std::max(1.125 * least / growth, 0x1p-50 * longest); distance <= longest; distance *= 2.0)
        if (place.changes_sides(distance * along, distance * growth, least)) {
            hit.model_distance = (distance * (1.0 + placement_.longest_edge * placement_.along_error) +
                                  2.0 * place.radius() * placement_.longest_edge) *
                                 (1.0 + 0x1p-40);
            return;
        }
}

std::optional<bool> RayCertifier::is_crossed(Ray ray) const
{
    // Where there is a doubt, the search goes on behind it; the limit is for rays that run along the surface.
    constexpr int most_doubts = 16;
    for (int doubts = 0; doubts < most_doubts; ++doubts) {
        const certified::Search found = search(ray);
        if (found.certificate().status == RayStatus::hit)
            return true;
        if (found.certificate().status == RayStatus::miss)
            return doubts == 0 ? std::optional<bool>(false) : std::nullopt;
        if (!(found.t_resume() > ray.t_near && found.t_resume() <= ray.t_far))
            break;
        ray.t_near = found.t_resume();
    }
    return std::nullopt;
}

std::optional<bool> RayCertifier::crosses_oddly(const Ray& ray) const
{
    const certified::Line line = line_of(ray.origin, ray.direction);
    const certified::Range range = range_of(line, ray);
    if (range.begin > range.end)
        return false;
    if (!(range.sure_begin <= range.sure_end))
        return std::nullopt;
    // The ends of the ray are not known exactly, but f has one sign near each.
    const auto sign = [&](double begin, double end) {
        const certified::Search found = search(line, {begin, end, begin, end}, HUGE_VAL);
        return found.certificate().status == RayStatus::miss ? found.sign() : 0;
    };
    const int product = sign(range.begin, range.sure_begin) * sign(range.sure_end, range.end);
    return product == 0 ? std::nullopt : std::optional<bool>(product < 0);
}

std::optional<bool> RayCertifier::contains(const glm::dvec3& point) const
{
    const certified::Line line = line_of(point, glm::dvec3(0.0));
    const certified::Range range = line.clip(glm::dvec3(surface_->volume().cell_shape()), 0.0, 0.0);
    if (range.begin > range.end)
        return false;
    const certified::Search found = search(line, range, HUGE_VAL);
    if (found.certificate().status != RayStatus::miss)
        return std::nullopt;
    if (found.sign() * surface_->inward_sign() < 0.0)
        return false;
    return range.sure_begin <= range.sure_end ? std::optional<bool>(true) : std::nullopt;
}

} // namespace isospline
