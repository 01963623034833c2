// The isosurface f = level of a volume: what scenes and hoppers trace.
#pragma once

#include "isospline/shell/shell.h"
#include "isospline/shell/value_bounds.h"

#include <cstdint>
#include <memory>
#include <vector>

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

/// An isosurface as it is at one level. It never changes, so that any number of threads may trace it, and whoever holds
/// it keeps it alive.
class IsosurfaceSnapshot {
public:
    const Volume& volume() const { return *volume_; }
    const std::shared_ptr<const Volume>& shared_volume() const { return volume_; }
    const IsosurfaceOptions& options() const { return *options_; }
    const std::shared_ptr<const Material>& material() const { return options_->material; }
    const std::shared_ptr<const ValueBounds>& shared_bounds() const { return bounds_; }
    double level() const { return level_; }
    /// The level that stored coefficients are compared with: level - volume().offset().
    double threshold() const { return threshold_; }
    const Shell& shell() const { return shell_; }
    /// The clip half-spaces in lattice space.
    const std::vector<HalfSpace>& clip_lattice() const { return clip_lattice_; }
    /// Whether a primitive id is that of a cap: shell().count() + position of its half-space in the clip.
    bool is_cap(std::uint32_t primitive_id) const { return primitive_id >= shell_.count(); }
    /// How many primitive ids there are: cells and caps.
    std::size_t primitive_count() const { return shell_.count() + (options_->capped ? clip_lattice_.size() : 0); }

private:
    friend class Isosurface;
    IsosurfaceSnapshot() = default;
    /// The same surface at another level.
    IsosurfaceSnapshot(const IsosurfaceSnapshot& other, double level, const Progress& progress);

    std::shared_ptr<const Volume> volume_;
    std::shared_ptr<const ValueBounds> bounds_;
    std::shared_ptr<const IsosurfaceOptions> options_;
    std::vector<HalfSpace> clip_lattice_;
    double level_ = 0.0, threshold_ = 0.0;
    Shell shell_;
};

/// The surface f = level of a volume's model, of degree 1, 2 or 3.
///
/// Changing the level re-uses coefficients and value bounds: only bricks that straddle the level are visited. Any
/// number of threads may change the level and use the surface at a time. Whoever uses it takes a snapshot, which later
/// changes of the level leave as it is; a change waits for nobody.
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
    Isosurface(const Isosurface& other);
    Isosurface& operator=(const Isosurface&) = delete;

    /// The surface at its present level.
    std::shared_ptr<const IsosurfaceSnapshot> snapshot() const;
    double level() const { return snapshot()->level(); }
    /// Of two changes at a time, the last to be finished holds. Throws std::invalid_argument where the level is not
    /// finite. Nothing changes where this throws or is cancelled.
    void set_level(double level, const Progress& progress = {});

    // What all levels have in common.
    const Volume& volume() const { return snapshot()->volume(); }
    const std::shared_ptr<const Volume>& shared_volume() const { return snapshot()->shared_volume(); }
    const IsosurfaceOptions& options() const { return snapshot()->options(); }
    const std::shared_ptr<const Material>& material() const { return options().material; }
    const std::shared_ptr<const ValueBounds>& shared_bounds() const { return snapshot()->shared_bounds(); }

private:
    std::shared_ptr<const IsosurfaceSnapshot> snapshot_; ///< read and swapped under moment_mutex(this)
};

} // namespace isospline
