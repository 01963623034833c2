// The continuous model of a regular volume: f(x) = sum over k of c_k beta^n(x - k).
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/grid.h"
#include "isospline/spline/coefficient_source.h"
#include "isospline/spline/coefficient_view.h"
#include "isospline/spline/filter.h"
#include "isospline/spline/samples.h"
#include "isospline/util/progress.h"

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace isospline {

/// Order of the axes of the user's arrays. "zyx" is [z, y, x], as in NumPy arrays from ITK, VTK, tifffile and zarr;
/// "xyz" is [x, y, z], as in arrays from nibabel.
enum class Axes { zyx, xyz };

struct VolumeOptions {
    glm::dvec3 spacing{1.0};   ///< world units between samples along x, y, z
    glm::dvec3 origin{0.0};    ///< world position of sample (0, 0, 0)
    glm::dmat3 direction{1.0}; ///< columns are the world directions of the axes x, y, z
    int degree = 2;            ///< of the B-spline, 0 to 5
    Boundary boundary = Boundary::mirror;
    Filter filter = Filter::interpolate;
    double smoothing = 0.0; ///< weight of the roughness, at least 0; used by Filter::smoothing
    Axes axes = Axes::zyx;  ///< for bindings that exchange arrays; C++ does not use it
    std::string unit{};     ///< of world coordinates, such as "mm", for pictures and tables; empty if unknown
    bool patient = false;   ///< whether x, y and z run to a patient's left, back and head (LPS), for pictures
};

/// The facts about the samples that a volume keeps besides the coefficients.
struct VolumeSummary {
    glm::ivec3 shape{0};
    double minimum = 0.0, maximum = 0.0, offset = 0.0;
};

/// The largest number of samples along an axis, so that indices and periods fit into an int.
inline constexpr int largest_sample_count = 1 << 28;

/// A B-spline model of a volume. Immutable: any number of threads may read it.
///
/// Three spaces meet here. *Index space* has samples at integers. *Lattice space* is index space shifted so that cell
/// (i, j, k) is the unit cube [i, i+1] x [j, j+1] x [k, k+1]: lattice = index + lattice_shift(). *World space* is
/// origin + direction * diag(spacing) * index.
///
/// The offset, the middle of the samples' range, is subtracted from stored coefficients, so that float32 spends its
/// digits on the variation: f = offset + sum c beta. This is exact because the prefilter keeps constants.
class Volume {
public:
    /// Computes the coefficients. Throws std::invalid_argument for an empty view, a sample that is not finite (the
    /// message names the first such index), a range that float32 cannot hold (below 1e-30 or above 1e34), a degree
    /// outside of 0-5, voxels with edges below 1e-60 or above 1e60, a singular direction or a smoothing that does not
    /// fit the filter. Throws std::length_error before it begins if the coefficients do not fit into the machine's
    /// memory.
    Volume(const SampleView& samples, const VolumeOptions& options = {}, const Progress& progress = {});

    /// A copy of a volume from its `summary()` and `stored_coefficients()`, for example in another process. Throws
    /// std::invalid_argument if the arguments do not belong together.
    Volume(const VolumeOptions& options, const VolumeSummary& summary, std::span<const float> stored_coefficients);

    /// A volume whose coefficients are not in memory. Throws std::invalid_argument like the other constructors.
    Volume(const VolumeOptions& options, const VolumeSummary& summary, std::shared_ptr<const CoefficientSource> source);

    int degree() const { return options_.degree; }
    Boundary boundary() const { return options_.boundary; }
    Filter filter() const { return options_.filter; }
    /// Whether f is the samples at their places, but for the rounding of the coefficients.
    bool interpolates() const { return filter() == Filter::interpolate || (filter() == Filter::none && degree() <= 1); }
    const VolumeOptions& options() const { return options_; }

    /// Samples along x, y, z.
    glm::ivec3 shape() const { return shape_; }
    /// Cells along x, y, z: as many as samples for even degrees, one fewer for odd ones.
    glm::ivec3 cell_shape() const { return degree() % 2 == 0 ? shape_ : shape_ - 1; }
    std::uint64_t cell_count() const { return place_count(cell_shape()); }
    /// The primitive id of a cell: its place in the grid of all cells. It is the same for every level.
    std::uint64_t primitive_id(const glm::ivec3& cell) const { return place_in(cell_shape(), cell); }
    /// The cell of a primitive id below cell_count().
    glm::ivec3 cell_at(std::uint64_t primitive_id) const { return at_place(cell_shape(), primitive_id); }
    /// The first and the last cell, along each axis, of those that contain a sample, also on their border: the one of
    /// which it is the centre for even degrees, those of which it is a corner for odd ones.
    std::pair<glm::ivec3, glm::ivec3> cells_with(const glm::ivec3& sample) const
    {
        return {glm::max(sample - degree() % 2, glm::ivec3(0)), glm::min(sample, cell_shape() - 1)};
    }
    /// Smallest and largest sample.
    double minimum() const { return minimum_; }
    double maximum() const { return maximum_; }

    /// Lattice coordinates minus index coordinates: 1/2 for even degrees, 0 for odd ones.
    double lattice_shift() const { return degree() % 2 == 0 ? 0.5 : 0.0; }
    const glm::dmat4& index_to_world() const { return index_to_world_; }
    const glm::dmat4& world_to_index() const { return world_to_index_; }
    const glm::dmat4& lattice_to_world() const { return lattice_to_world_; }
    const glm::dmat4& world_to_lattice() const { return world_to_lattice_; }
    /// The box of the domain in world space: whole voxels for even degrees, sample to sample for odd ones.
    Box bounds() const;

    /// f = offset + sum c beta.
    double offset() const { return offset_; }
    /// No stored coefficient is farther than this from the one that exact arithmetic computes from the samples: a bound
    /// on the rounding of a line's filter, in double precision, and of what is stored after each axis, in float32. It
    /// bounds |f - f of those coefficients| too.
    double coefficient_error() const;
    /// The source of the coefficients, or null if all are in memory.
    const CoefficientSource* source() const { return source_.get(); }
    MemoryBudget* budget() const { return source_ ? source_->budget() : nullptr; }
    /// The coefficients that influence a cell, in memory or copied to `own`: (n+1)^2 rows of at least four.
    CoefficientView cell(const glm::ivec3& cell, float* own) const
    {
        if (source_ == nullptr)
            return {cell_coefficients(cell.x, cell.y, cell.z), row_stride_, slice_stride_};
        return copy_of_cell(cell, own);
    }
    /// Copies the coefficients of a box of samples, continued by the boundary rule. The coefficient of index
    /// first + (x, y, z) goes to to[x + y * row_stride + z * slice_stride].
    void copy(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
              std::ptrdiff_t slice_stride) const;
    /// The coefficients that influence a box of cells, at least one cell along each axis.
    CoefficientBox box(const glm::ivec3& first_cell, const glm::ivec3& cells) const;

    // Only for a volume in memory:
    /// The beginning of the (n+1)^3 coefficients of a cell: coefficient (i, j, k) is at
    /// [i + j * row_stride() + k * slice_stride()]. Four floats may be read from the beginning of every row, even if
    /// n+1 is less; eight if n+1 is more than four.
    const float* cell_coefficients(int x, int y, int z) const
    {
        return coefficients_.get() + x + y * row_stride_ + z * slice_stride_;
    }
    std::ptrdiff_t row_stride() const { return row_stride_; }
    std::ptrdiff_t slice_stride() const { return slice_stride_; }
    /// All stored coefficients, including the padding.
    std::span<const float> stored_coefficients() const { return {coefficients_.get(), coefficient_count_}; }

    /// The number of coefficients on each side that the boundary rule adds: n/2, rounded down.
    int padding() const { return degree() / 2; }
    VolumeSummary summary() const { return {shape_, minimum_, maximum_, offset_}; }
    /// Bytes held by this object.
    std::size_t memory() const;

    /// f at a point in index space; outside of the domain the model continues by its boundary rule.
    double value(const glm::dvec3& position_index) const;
    /// Gradient of f by index coordinates.
    glm::dvec3 gradient(const glm::dvec3& position_index) const;
    /// Hessian of f by index coordinates. For degree 0 and 1 the derivatives that do not exist are zero.
    glm::dmat3 hessian(const glm::dvec3& position_index) const;

private:
    void set_layout();
    void set_maps();
    void allocate();
    CoefficientView copy_of_cell(const glm::ivec3& cell, float* own) const;
    void copy_inside(const glm::ivec3& first, const glm::ivec3& size, float* to, std::ptrdiff_t row_stride,
                     std::ptrdiff_t slice_stride) const;

    VolumeOptions options_;
    glm::ivec3 shape_{0};
    double minimum_ = 0.0, maximum_ = 0.0, offset_ = 0.0;
    glm::dmat4 index_to_world_{1.0}, world_to_index_{1.0}, lattice_to_world_{1.0}, world_to_lattice_{1.0};
    std::shared_ptr<const CoefficientSource> source_;
    std::unique_ptr<float[]> coefficients_; ///< null if there is a source
    std::size_t coefficient_count_ = 0;
    std::ptrdiff_t row_stride_ = 0, slice_stride_ = 0;
};

/// The domain of a volume's model in lattice space: the box of its cells.
inline Box domain_lattice(const Volume& volume)
{
    return {glm::dvec3(0.0), glm::dvec3(volume.cell_shape())};
}

} // namespace isospline
