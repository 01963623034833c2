// The isosurface f = level of a volume: what scenes and hoppers trace.
#pragma once

#include "isospline/brick/bricks.h"
#include "isospline/cell/method.h"
#include "isospline/shell/shell.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace isospline {

struct Material;

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
    const Volume& volume() const { return *common_->volume; }
    const std::shared_ptr<const Volume>& shared_volume() const { return common_->volume; }
    const IsosurfaceOptions& options() const { return common_->options; }
    const std::shared_ptr<const Material>& material() const { return options().material; }
    const std::shared_ptr<const BrickRanges>& shared_ranges() const { return common_->ranges; }
    /// The clip half-spaces in lattice space.
    const std::vector<HalfSpace>& clip_lattice() const { return common_->clip_lattice; }
    double level() const { return level_; }
    /// The level that stored coefficients are compared with: level - volume().offset().
    double threshold() const { return bricks_.threshold(); }
    /// What rays meet.
    const Bricks& bricks() const { return bricks_; }
    /// Found by the first call, which may come from any thread. Waits for others that find it, and throws Cancelled
    /// where `progress` returns false.
    const Shell& shell(const Progress& progress = {}) const;
    /// Whether the shell has no cell; it is not made for this.
    bool is_empty() const;
    /// The box of the shell's cells, in lattice space; empty where there are none. Found by the first call, without the
    /// shell.
    Box bounds_lattice() const;
    /// Bytes held for queries, the volume not counted. It grows as rays meet bricks, and where the shell is asked for.
    std::size_t memory() const;

    /// The primitive id of a cap, by the position of its half-space in the clip: it follows those of all cells.
    std::uint64_t cap_id(std::size_t half_space) const { return volume().cell_count() + half_space; }
    bool is_cap(std::uint64_t primitive_id) const { return primitive_id >= volume().cell_count(); }
    /// The half-space, in lattice space, of a cap's primitive id.
    const HalfSpace& cut_of(std::uint64_t primitive_id) const
    {
        return clip_lattice()[static_cast<std::size_t>(primitive_id - volume().cell_count())];
    }
    /// How many primitive ids there are: cells of the volume, and caps.
    std::uint64_t primitive_count() const { return cap_id(options().capped ? clip_lattice().size() : 0); }

private:
    friend class Isosurface;

    /// What all levels have in common.
    struct Common {
        std::shared_ptr<const Volume> volume;
        std::shared_ptr<const CoefficientSource> source;
        std::shared_ptr<const BrickRanges> ranges;
        IsosurfaceOptions options;
        std::vector<HalfSpace> clip_lattice;
    };
    struct OnDemand;

    IsosurfaceSnapshot(std::shared_ptr<const Common> common, double level, const Progress& progress);
    BrickCells cells(const Octet& octet, int child) const;
    Box find_bounds() const;

    std::shared_ptr<const Common> common_;
    double level_;
    Bricks bricks_;
    std::shared_ptr<OnDemand> on_demand_;
};

/// The surface f = level of a volume's model, of degree 1, 2 or 3.
///
/// Changing the level selects the bricks that straddle it; all else is made when a ray asks for it. Any number of
/// threads may change the level and use the surface at a time. Whoever uses it takes a snapshot, which later changes of
/// the level leave as it is; a change waits for nobody.
///
/// Several surfaces of one volume share the ranges of its bricks: a copy shares them with the original, and the
/// constructor takes those of another surface.
class Isosurface {
public:
    /// Throws std::invalid_argument where the volume's degree is not 1, 2 or 3, it has fewer than two samples along an
    /// axis at an odd degree, more than 65535 cells along one, the level is not finite, the depth of pruning is not in
    /// 0-6, the mask has not one byte a sample, or a half-space of the clip is not finite or has no normal.
    /// `ranges` are those of `volume`, and are computed where there are none; `source` gives its coefficients, the
    /// volume itself where there is none.
    Isosurface(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options = {},
               std::shared_ptr<const BrickRanges> ranges = nullptr, const Progress& progress = {},
               std::shared_ptr<const CoefficientSource> source = nullptr);
    Isosurface(const Isosurface& other);
    Isosurface& operator=(const Isosurface&) = delete;

    /// The surface at its present level.
    std::shared_ptr<const IsosurfaceSnapshot> snapshot() const;
    double level() const { return snapshot()->level(); }
    /// Of two changes at a time, the last to be finished holds. Throws std::invalid_argument where the level is not
    /// finite. Nothing changes where this throws or is cancelled.
    void set_level(double level, const Progress& progress = {});

    // What all levels have in common; references are good for as long as this lives.
    const Volume& volume() const { return snapshot()->volume(); }
    std::shared_ptr<const Volume> shared_volume() const { return snapshot()->shared_volume(); }
    const IsosurfaceOptions& options() const { return snapshot()->options(); }
    const std::shared_ptr<const Material>& material() const { return options().material; }
    std::shared_ptr<const BrickRanges> shared_ranges() const { return snapshot()->shared_ranges(); }

private:
    std::shared_ptr<const IsosurfaceSnapshot> snapshot_; ///< read and swapped under moment_mutex(this)
};

} // namespace isospline
