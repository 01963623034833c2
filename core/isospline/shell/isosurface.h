// The isosurface f = level of a volume: what scenes and hoppers trace.
#pragma once

#include "isospline/shell/shell.h"
#include "isospline/shell/value_bounds.h"

#include <cstdint>
#include <memory>

namespace isospline {

struct Material;

/// How the root in a cell is found.
enum class Method {
    exact,     ///< Bernstein form of the polynomial along the ray: never misses a root
    reference, ///< the same, scalar and all in double precision: slow, the oracle of tests
    bracket    ///< the paper's §4: opposite signs at the ends of the cell, then Brent's method
};

/// The side of the surface that is the solid; the outward normal points to the other one.
enum class Inside {
    above, ///< f > level, as for tissue in a CT
    below  ///< f < level, as in the paper
};

struct IsosurfaceOptions {
    ShellOptions shell;
    std::vector<HalfSpace> clip; ///< in the volume's world space; the parts outside of any are cut away
    bool capped = false;         ///< whether scenes close the solid where the clip cuts it
    Method method = Method::exact;
    Inside inside = Inside::above;
    std::shared_ptr<const Material> material; ///< what it is made of, for path tracers, or nothing
};

/// The surface f = level of a volume's model, of degree 1, 2 or 3.
///
/// Changing the level re-uses coefficients and value bounds: only bricks that straddle the level are visited. Not
/// synchronised: do not change the level while another thread traces the surface.
///
/// Several surfaces of one volume share its value bounds: a copy shares them with the original, and the constructor
/// takes those of another surface.
class Isosurface {
public:
    /// Throws std::invalid_argument where the volume's degree is not 1, 2 or 3, it has fewer than two samples along an
    /// axis at an odd degree, more than 65535 cells along one, the level is not finite, the depth of pruning is not in
    /// 0-6, the mask has not one byte a sample, or a half-space of the clip is not finite or has no normal.
    /// `bounds` are those of `volume`, and are computed where there are none.
    Isosurface(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options = {},
               std::shared_ptr<const ValueBounds> bounds = nullptr, const Progress& progress = {});

    const Volume& volume() const { return *volume_; }
    const std::shared_ptr<const Volume>& shared_volume() const { return volume_; }
    const IsosurfaceOptions& options() const { return options_; }
    const std::shared_ptr<const Material>& material() const { return options_.material; }
    double level() const { return level_; }
    /// Throws std::invalid_argument where the level is not finite. Nothing changes where this throws or is cancelled.
    void set_level(double level, const Progress& progress = {});
    /// The level that stored coefficients are compared with: level - volume().offset().
    double threshold() const { return level_ - volume_->offset(); }
    const Shell& shell() const { return shell_; }
    const std::shared_ptr<const ValueBounds>& shared_bounds() const { return bounds_; }
    /// The clip half-spaces in lattice space.
    const std::vector<HalfSpace>& clip_lattice() const { return clip_lattice_; }
    /// Whether a primitive id is that of a cap: shell().count() + position of its half-space in the clip.
    bool is_cap(std::uint32_t primitive_id) const { return primitive_id >= shell_.count(); }
    /// How many primitive ids there are: cells and caps.
    std::size_t primitive_count() const { return shell_.count() + (options_.capped ? clip_lattice_.size() : 0); }
    /// Grows with every change of the shell; scenes rebuild by it.
    std::uint64_t version() const { return version_; }

private:
    std::shared_ptr<const Volume> volume_;
    std::shared_ptr<const ValueBounds> bounds_;
    IsosurfaceOptions options_;
    std::vector<HalfSpace> clip_lattice_;
    double level_ = 0.0;
    Shell shell_;
    std::uint64_t version_ = 0;
};

} // namespace isospline
