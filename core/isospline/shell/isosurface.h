// The isosurface f = level of a volume: what scenes and hoppers trace.
#pragma once

#include "isospline/brick/bricks.h"
#include "isospline/brick/cell_set.h"
#include "isospline/brick/side_grid.h"
#include "isospline/brick/solid_planes.h"
#include "isospline/cell/method.h"
#include "isospline/shell/shell.h"

#include <cstdint>
#include <memory>
#include <span>
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
    int largest = 0;             ///< keeps the largest connected components of the solid, this many; 0 keeps all
    std::vector<HalfSpace> clip; ///< in the volume's world space; everything outside of any of them is cut away
    bool capped = false;         ///< whether the solid is closed where the clip cuts it
    bool closed = false;         ///< whether the solid is closed at the border of the volume's domain
    Method method = Method::exact;
    Inside inside = Inside::above;
    std::shared_ptr<const Material> material; ///< for path tracers, or null
};

/// An isosurface at one level. It never changes, so any number of threads may trace it. It lives as long as a pointer
/// to it.
class IsosurfaceSnapshot {
public:
    const Volume& volume() const { return *common_->volume; }
    const std::shared_ptr<const Volume>& shared_volume() const { return common_->volume; }
    const IsosurfaceOptions& options() const { return common_->options; }
    const std::shared_ptr<const Material>& material() const { return options().material; }
    const std::shared_ptr<const BrickRanges>& shared_ranges() const { return common_->ranges; }
    /// The cells that the mask keeps. If only the largest components are kept, they must also contain the cell.
    const CellSet& kept_cells() const { return *kept_; }
    /// The half-spaces that bound the solid, in lattice space: the clip and, if it is closed, the border of the domain.
    const SolidPlanes& planes() const { return common_->planes; }
    /// The clip alone, in lattice space. The isosurface itself ends there, and at the border of the domain anyway.
    const std::vector<HalfSpace>& clip_lattice() const { return planes().clip(); }
    /// A bound on the rounding errors of the lattice coordinates of points of the domain that are given in world space.
    double coordinate_error() const { return common_->coordinate_error; }
    /// 1 if the solid is above the level, -1 if it is below.
    double inward_sign() const { return options().inside == Inside::above ? 1.0 : -1.0; }
    double level() const { return level_; }
    /// The number that stored coefficients are compared with: level - volume().offset().
    double threshold() const { return bricks_.threshold(); }
    /// The bricks that rays meet.
    const Bricks& bricks() const { return bricks_; }
    /// Computed by the first call, from any thread; other calls wait for it. Throws Cancelled if `progress` returns
    /// false.
    const Shell& shell(const Progress& progress = {}) const;
    /// Whether the shell has no cells. Does not compute the shell.
    bool is_empty(const Progress& progress = {}) const;
    /// The box of the shell's cells, in lattice space; empty if there are no cells. The first call computes it, without
    /// the shell.
    Box bounds_lattice(const Progress& progress = {}) const;
    /// The extent of the shell's cells: the largest <direction, x> over them for each direction, in lattice space;
    /// minus infinity if there are no cells. Looks only at the bricks that it needs.
    std::vector<double> reach_lattice(std::span<const glm::dvec3> directions, const Progress& progress = {}) const;
    /// The sides of the threshold on which f is. The first call computes them, from any thread; other calls wait for
    /// it. Throws Cancelled if `progress` returns false.
    const SideGrid& sides(const Progress& progress = {}) const;
    /// Bytes held for queries, without the volume. It grows when rays enter bricks and when the shell is computed.
    std::size_t memory() const;

    /// The primitive id of the cap of a plane of `planes().all()`. Caps follow the cells.
    std::uint64_t cap_id(std::size_t plane) const { return volume().cell_count() + plane; }
    bool is_cap(std::uint64_t primitive_id) const { return primitive_id >= volume().cell_count(); }
    /// The half-space of a cap, given its primitive id; in lattice space.
    const HalfSpace& cut_of(std::uint64_t primitive_id) const
    {
        return planes().all()[static_cast<std::size_t>(primitive_id - volume().cell_count())];
    }
    /// The number of primitive ids: cells of the volume, and caps.
    std::uint64_t primitive_count() const { return cap_id(planes().have_caps() ? planes().all().size() : 0); }

private:
    friend class Isosurface;

    /// The data that all levels share.
    struct Common {
        std::shared_ptr<const Volume> volume;
        std::shared_ptr<const BrickRanges> ranges;
        IsosurfaceOptions options;
        SolidPlanes planes;
        std::shared_ptr<const CellSet> unmasked;
        double coordinate_error;
    };
    struct OnDemand;

    IsosurfaceSnapshot(std::shared_ptr<const Common> common, double level, const Progress& progress);
    std::shared_ptr<const CellSet> find_kept(const Progress& progress) const;
    BrickCells cells(const Octet& octet, int child) const;
    Box find_bounds(const Progress& progress) const;

    std::shared_ptr<const Common> common_;
    double level_;
    std::shared_ptr<const CellSet> kept_;
    Bricks bricks_;
    std::shared_ptr<OnDemand> on_demand_;
};

/// The surface f = level of a volume's model, of degree 1, 2 or 3.
///
/// A change of the level selects the bricks that straddle it; everything else is made when a ray needs it. Any number
/// of threads may change the level and use the surface at the same time. A query takes a snapshot, which later changes
/// of the level do not affect. A change never waits.
///
/// Several surfaces of one volume share the ranges of its bricks. A copy shares them with the original, and the
/// constructor accepts the ranges of another surface.
class Isosurface {
public:
    /// `ranges` are the ranges of `volume`; they are computed if null. Throws std::invalid_argument if the volume's
    /// degree is not 1, 2 or 3, if it has more than 65535 cells along an axis, or fewer than two samples along an axis
    /// for an odd degree. Also throws it if the level is not finite, the prune depth is not 0-6, the number of
    /// components is negative, the mask does not have one byte a sample, or a half-space of the clip is not finite or
    /// has no normal, or if cuts are to be capped and there is no clip.
    Isosurface(std::shared_ptr<const Volume> volume, double level, IsosurfaceOptions options = {},
               std::shared_ptr<const BrickRanges> ranges = nullptr, const Progress& progress = {});
    Isosurface(const Isosurface& other);
    Isosurface& operator=(const Isosurface&) = delete;

    /// The surface at its current level.
    std::shared_ptr<const IsosurfaceSnapshot> snapshot() const;
    double level() const { return snapshot()->level(); }
    /// Of two simultaneous changes, the one that finishes last holds. Throws std::invalid_argument if the level is not
    /// finite. If it throws or is cancelled, nothing changes.
    void set_level(double level, const Progress& progress = {});

    // Data that all levels share; references are valid as long as this object.
    const Volume& volume() const { return snapshot()->volume(); }
    std::shared_ptr<const Volume> shared_volume() const { return snapshot()->shared_volume(); }
    const IsosurfaceOptions& options() const { return snapshot()->options(); }
    const std::shared_ptr<const Material>& material() const { return options().material; }
    std::shared_ptr<const BrickRanges> shared_ranges() const { return snapshot()->shared_ranges(); }

private:
    std::shared_ptr<const IsosurfaceSnapshot> snapshot_; ///< read and swapped under fork_safe_mutex(this)
};

} // namespace isospline
