#include "isospline/spline/volume.h"

#include "isospline/math/affine.h"
#include "isospline/spline/cell_weights-inl.h"
#include "isospline/spline/degree.h"
#include "isospline/spline/filter_design.h"
#include "isospline/spline/line_filter.h"
#include "isospline/spline/prefilter.h"
#include "isospline/util/check.h"
#include "isospline/util/memory.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace isospline {

namespace {

/// Floats that may be read beyond the last coefficient: see Volume::cell_coefficients().
constexpr std::size_t slack = 8;

/// The smallest and the largest half range of samples whose coefficients float32 holds with all its digits.
constexpr double smallest_half_range = 0.5e-30, largest_half_range = 0.5e34;
/// The shortest and the longest edges of voxels for which no product of four lengths underflows or overflows.
constexpr double shortest_edge = 1e-60, longest_edge = 1e60;

void check(const SampleView& samples, const VolumeOptions& options)
{
    const auto& shape = samples.shape;
    if (shape.x < 1 || shape.y < 1 || shape.z < 1)
        throw_invalid("data", "at least one sample along each axis", to_text(glm::dvec3(shape)) + " of them");
    if (samples.data == nullptr)
        throw_invalid("data", "samples", "none");
    if (std::max({shape.x, shape.y, shape.z}) > largest_sample_count)
        throw_invalid("data", "at most " + std::to_string(largest_sample_count) + " samples along an axis",
                      to_text(glm::dvec3(shape)));
    if (options.degree < 0 || options.degree > 5)
        throw_invalid("degree", "0 to 5", options.degree);
    const auto& spacing = options.spacing;
    if (!is_finite(spacing) || !(spacing.x > 0.0 && spacing.y > 0.0 && spacing.z > 0.0))
        throw_invalid("spacing", "three finite numbers above 0", to_text(spacing));
    check_finite("origin", options.origin);
    if (!(options.smoothing >= 0.0 && options.smoothing <= largest_smoothing))
        throw_invalid("smoothing", "a number from 0 to 1e9", options.smoothing);
    if (options.smoothing > 0.0 && options.filter != Filter::smoothing)
        throw_invalid("smoothing", "0 for this filter", options.smoothing);

    const auto& direction = options.direction;
    const double volume = std::abs(glm::determinant(direction));
    const double edges = glm::length(direction[0]) * glm::length(direction[1]) * glm::length(direction[2]);
    if (!std::isfinite(edges) || !(volume > 1e-9 * edges))
        throw_invalid("direction", "three finite columns that are linearly independent",
                      to_text(direction[0]) + ", " + to_text(direction[1]) + ", " + to_text(direction[2]));
    for (int axis = 0; axis < 3; ++axis)
        if (const double edge = spacing[axis] * glm::length(direction[axis]);
            !(edge >= shortest_edge && edge <= longest_edge))
            throw_invalid("spacing", "voxels with edges of 1e-60 to 1e60", to_text(spacing));
}

/// `needed` is a double because it may exceed 64 bits for long axes.
void check_memory(double needed)
{
    const auto available = static_cast<double>(available_memory());
    if (needed <= available)
        return;
    constexpr double mebibyte = 1 << 20;
    std::ostringstream message;
    message << std::fixed << std::setprecision(0) << "data: the coefficients need " << needed / mebibyte
            << " MiB of memory, of which " << available / mebibyte << " MiB are available";
    throw std::length_error(message.str());
}

/// The coefficients that influence a point along one axis, and the place of the point in their cell.
template <int Degree>
struct Support {
    std::array<int, Degree + 1> index; ///< relative to the first sample's coefficient
    int first;                         ///< the first index, before the boundary rule is applied
    double s = 0.0;

    /// `position` is in index space.
    Support(double position, int size, Boundary boundary)
    {
        constexpr int padding = Degree / 2;
        constexpr double shift = Degree % 2 == 0 ? 0.5 : 0.0;
        const int cells = Degree % 2 == 0 ? size : size - 1;
        const double lattice = position + shift;
        const double cell = std::floor(lattice);
        if (cell >= 0.0 && cell < cells) {
            first = static_cast<int>(cell) - padding;
            for (int j = 0; j <= Degree; ++j)
                index[static_cast<std::size_t>(j)] = first + j;
        } else {
            // Fold the cell into a period next to 0, which is exact, so that its number is a small integer. Then fold
            // each coefficient's index.
            const double period = size == 1 ? 1.0 : boundary == Boundary::periodic ? size : 2.0 * size - 2.0;
            first = static_cast<int>(std::fmod(cell, period)) - padding;
            for (int j = 0; j <= Degree; ++j)
                index[static_cast<std::size_t>(j)] = detail::inside_index(first + j, size, boundary);
        }
        s = lattice - cell;
    }
};

template <int Degree>
using Weights = std::array<double, Degree + 1>;

/// The coefficients around a point, and derivatives of any order of their weights along each axis.
template <int Degree>
class Neighbourhood {
public:
    Neighbourhood(const Volume& volume, const glm::dvec3& position)
        : x_(position.x, volume.shape().x, volume.boundary()), y_(position.y, volume.shape().y, volume.boundary()),
          z_(position.z, volume.shape().z, volume.boundary()), x_basis_(scalar::cell_basis<Degree>(x_.s)),
          y_basis_(scalar::cell_basis<Degree>(y_.s)), z_basis_(scalar::cell_basis<Degree>(z_.s))
    {
        if (volume.source() == nullptr) {
            coefficients_ = {volume.cell_coefficients(Degree / 2, Degree / 2, Degree / 2), volume.row_stride(),
                             volume.slice_stride()};
            return;
        }
        constexpr int count = Degree + 1;
        volume.copy({x_.first, y_.first, z_.first}, glm::ivec3(count), own_.data(), count, count * count);
        coefficients_ = {own_.data(), count, count * count};
        for (auto* support : {&x_, &y_, &z_})
            std::iota(support->index.begin(), support->index.end(), 0);
    }
    Neighbourhood(const Neighbourhood&) = delete;
    Neighbourhood& operator=(const Neighbourhood&) = delete;

    const scalar::CellBasis<Degree, double>& x() const { return x_basis_; }
    const scalar::CellBasis<Degree, double>& y() const { return y_basis_; }
    const scalar::CellBasis<Degree, double>& z() const { return z_basis_; }

    double sum(const Weights<Degree>& x, const Weights<Degree>& y, const Weights<Degree>& z) const
    {
        const auto coefficient = [this](std::size_t i, std::size_t j, std::size_t k) {
            return static_cast<double>(*coefficients_.from(x_.index[i], y_.index[j], z_.index[k]).first);
        };
        return scalar::weighted_sum(coefficient, x, y, z);
    }

private:
    Support<Degree> x_, y_, z_;
    CoefficientView coefficients_;                                      ///< beginning at index (0, 0, 0)
    std::array<float, (Degree + 1) * (Degree + 1) * (Degree + 1)> own_; ///< if they are not in memory
    scalar::CellBasis<Degree, double> x_basis_, y_basis_, z_basis_;
};

/// Calls function(Neighbourhood<degree>), except for a position that is not finite.
template <typename Result, typename Function>
Result with_neighbourhood(const Volume& volume, const glm::dvec3& position, const Result& otherwise, Function function)
{
    if (!is_finite(position))
        return otherwise;
    return dispatch_degree<0, 5>(volume.degree(),
                                 [&](auto degree) { return function(Neighbourhood<degree>(volume, position)); });
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

} // namespace

void Volume::set_layout()
{
    // Slices that are a multiple of the page size apart would compete for the same few cache lines.
    constexpr std::size_t line = 16;
    constexpr std::size_t page = 1024;
    const auto padded = [&](int axis) { return static_cast<std::size_t>(shape_[axis] + 2 * padding()); };
    std::size_t slice = (padded(0) * padded(1) + line - 1) / line * line;
    if (slice % page == 0)
        slice += line;
    row_stride_ = static_cast<std::ptrdiff_t>(padded(0));
    slice_stride_ = static_cast<std::ptrdiff_t>(slice);
    check_memory(static_cast<double>(sizeof(float)) * static_cast<double>(slice) * static_cast<double>(padded(2)));
    coefficient_count_ = slice * padded(2) + slack;
}

void Volume::set_maps()
{
    for (int axis = 0; axis < 3; ++axis)
        index_to_world_[axis] = glm::dvec4(options_.direction[axis] * options_.spacing[axis], 0.0);
    index_to_world_[3] = glm::dvec4(options_.origin, 1.0);
    world_to_index_ = glm::inverse(index_to_world_);
    const glm::dvec3 shift(lattice_shift());
    lattice_to_world_ = index_to_world_;
    lattice_to_world_[3] = glm::dvec4(transform_point(index_to_world_, -shift), 1.0);
    world_to_lattice_ = world_to_index_;
    world_to_lattice_[3] += glm::dvec4(shift, 0.0);
}

void Volume::allocate()
{
    coefficients_.reset(new float[coefficient_count_]);
    prefer_huge_pages(coefficients_.get(), coefficient_count_ * sizeof(float));
}

Volume::Volume(const VolumeOptions& options, const VolumeSummary& summary, std::span<const float> stored_coefficients)
    : options_(options), shape_(summary.shape), minimum_(summary.minimum), maximum_(summary.maximum),
      offset_(summary.offset)
{
    check({stored_coefficients.data(), SampleType::float32, summary.shape, {}, false}, options);
    set_layout();
    if (stored_coefficients.size() != coefficient_count_)
        throw_invalid("coefficients", std::to_string(coefficient_count_) + " of them", stored_coefficients.size());
    set_maps();
    allocate();
    std::copy(stored_coefficients.begin(), stored_coefficients.end(), coefficients_.get());
}

Volume::Volume(const VolumeOptions& options, const VolumeSummary& summary,
               std::shared_ptr<const CoefficientSource> source)
    : options_(options), shape_(summary.shape), minimum_(summary.minimum), maximum_(summary.maximum),
      offset_(summary.offset), source_(std::move(source))
{
    check({source_.get(), SampleType::float32, summary.shape, {}, false}, options);
    set_maps();
}

Volume::Volume(const SampleView& samples, const VolumeOptions& options, const Progress& progress)
    : options_(options), shape_(samples.shape)
{
    check(samples, options);
    set_layout();
    set_maps();

    // Range of the samples. The offset of float32 samples is a float32 too, so that its subtraction loses nothing.
    const SampleRange range = sample_range(samples, part_of(progress, 0.0, 0.1));
    minimum_ = range.minimum;
    maximum_ = range.maximum;
    const double half_range = 0.5 * maximum_ - 0.5 * minimum_;
    if (half_range > largest_half_range || (half_range > 0.0 && half_range < smallest_half_range))
        throw_invalid("data", "a range of 1e-30 to 1e34, or one value only", 2.0 * half_range);
    offset_ = 0.5 * minimum_ + 0.5 * maximum_;
    if (samples.type == SampleType::float32)
        offset_ = static_cast<double>(static_cast<float>(offset_));

    // Coefficients.
    allocate();
    const auto used = static_cast<std::size_t>(row_stride_) * static_cast<std::size_t>(shape_.y + 2 * padding());
    const auto slice = static_cast<std::size_t>(slice_stride_);
    for (std::size_t begin = 0; begin + slack < coefficient_count_; begin += slice)
        std::fill_n(coefficients_.get() + begin + used, slice - used, 0.0f);
    std::fill_n(coefficients_.get() + coefficient_count_ - slack, slack, 0.0f);
    const auto first = static_cast<std::ptrdiff_t>(padding());
    compute_coefficients(samples, offset_, design_filter(degree(), filter(), options.smoothing), boundary(),
                         {coefficients_.get() + first * (1 + row_stride_ + slice_stride_), shape_, padding(),
                          row_stride_, slice_stride_},
                         part_of(progress, 0.1, 1.0));
}

double Volume::coefficient_error() const
{
    // docs/method.md, "Certified rays". The samples differ from the offset by at most half their range; three filters
    // multiply this by at most norm^3, and so they do with what is rounded on the way.
    const RecursiveFilter design = design_filter(degree(), filter(), options_.smoothing);
    const FilterNorm norm = norm_of(design);
    const double largest = std::max(maximum_ - offset_, offset_ - minimum_);
    const double rounded_times = filter() == Filter::none ? 1.0 : 4.0; // when read, and by the filter of each axis
    const double in_lines = 0x1p-43 * norm.recursion;
    const double beyond_reach = source_ ? 0x1p-30 : 0.0; // of parts that were filtered apart: filter_reach()
    const auto cube = [](double x) { return x * x * x; };
    // Samples are multiplied by the gains of all axes when they are read, so that they may become subnormal numbers.
    const double underflow = rounded_times * 0x1p-149 * cube(std::max(1.0, 1.0 / design.gain));
    const double bound = (rounded_times * 0x1p-24 + in_lines + beyond_reach) * largest + underflow;
    return bound * cube(norm.whole) * (1.0 + 0x1p-20);
}

Box Volume::bounds() const
{
    return transform_box(lattice_to_world_, {glm::dvec3(0.0), glm::dvec3(cell_shape())});
}

std::size_t Volume::memory() const
{
    return sizeof(*this) + coefficient_count_ * sizeof(float) + (source_ ? source_->memory() : 0);
}

void Volume::copy(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
                  std::ptrdiff_t slice_stride) const
{
    if (glm::all(glm::greaterThanEqual(first, glm::ivec3(0))) && glm::all(glm::lessThanEqual(first + size, shape_)))
        return copy_inside(first, size, to, row_stride, slice_stride);
    // Outside of the volume, indices come in runs that are consecutive after the boundary rule.
    struct Run {
        int at, inside, count;
    };
    std::array<std::vector<Run>, 3> runs;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < size[axis]; ++i) {
            std::vector<Run>& of_axis = runs[static_cast<std::size_t>(axis)];
            const int inside = detail::inside_index(static_cast<long long>(first[axis]) + i, shape_[axis], boundary());
            if (!of_axis.empty() && of_axis.back().inside + of_axis.back().count == inside)
                ++of_axis.back().count;
            else
                of_axis.push_back({i, inside, 1});
        }
    for (const Run& z : runs[2])
        for (const Run& y : runs[1])
            for (const Run& x : runs[0])
                copy_inside({x.inside, y.inside, z.inside}, {x.count, y.count, z.count},
                            to + x.at + y.at * row_stride + z.at * slice_stride, row_stride, slice_stride);
}

void Volume::copy_inside(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
                         std::ptrdiff_t slice_stride) const
{
    if (source_)
        return source_->copy(first, size, to, row_stride, slice_stride);
    const glm::ivec3 stored = first + padding();
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            std::copy_n(cell_coefficients(stored.x, stored.y + y, stored.z + z), size.x,
                        to + y * row_stride + z * slice_stride);
}

CoefficientView Volume::copy_of_cell(const glm::ivec3& cell, float* own) const
{
    const int count = degree() + 1, row = std::max(count, 4);
    std::fill_n(own, row * count * count, 0.0f); // rows may be read beyond their end; the numbers there are not used
    copy(cell - padding(), glm::ivec3(count), own, row, static_cast<std::ptrdiff_t>(row) * count);
    return {own, row, static_cast<std::ptrdiff_t>(row) * count};
}

CoefficientBox Volume::box(const glm::ivec3& first_cell, const glm::ivec3& cells) const
{
    if (source_ == nullptr)
        return {{cell_coefficients(first_cell.x, first_cell.y, first_cell.z), row_stride_, slice_stride_}, {}, 0};
    const glm::vec<3, std::size_t> size(cells + degree());
    const std::size_t count = size.x * size.y * size.z + slack;
    CoefficientBox box;
    box.copy.reset(new float[count]);
    box.copied_bytes = count * sizeof(float);
    std::fill_n(box.copy.get() + count - slack, slack, 0.0f);
    box.first = box.copy.get();
    box.row_stride = static_cast<std::ptrdiff_t>(size.x);
    box.slice_stride = static_cast<std::ptrdiff_t>(size.x * size.y);
    copy(first_cell - padding(), glm::ivec3(size), box.copy.get(), box.row_stride, box.slice_stride);
    return box;
}

double Volume::value(const glm::dvec3& position_index) const
{
    return with_neighbourhood(*this, position_index, not_a_number, [&](const auto& near) {
        return offset_ + near.sum(near.x().values, near.y().values, near.z().values);
    });
}

glm::dvec3 Volume::gradient(const glm::dvec3& position_index) const
{
    return with_neighbourhood(*this, position_index, glm::dvec3(not_a_number), [](const auto& near) {
        return glm::dvec3(near.sum(near.x().first, near.y().values, near.z().values),
                          near.sum(near.x().values, near.y().first, near.z().values),
                          near.sum(near.x().values, near.y().values, near.z().first));
    });
}

glm::dmat3 Volume::hessian(const glm::dvec3& position_index) const
{
    const glm::dvec3 missing(not_a_number);
    return with_neighbourhood(*this, position_index, glm::dmat3(missing, missing, missing), [](const auto& near) {
        const double xx = near.sum(near.x().second, near.y().values, near.z().values);
        const double yy = near.sum(near.x().values, near.y().second, near.z().values);
        const double zz = near.sum(near.x().values, near.y().values, near.z().second);
        const double xy = near.sum(near.x().first, near.y().first, near.z().values);
        const double xz = near.sum(near.x().first, near.y().values, near.z().first);
        const double yz = near.sum(near.x().values, near.y().first, near.z().first);
        return glm::dmat3(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    });
}

} // namespace isospline
