#include "bind.h"

#include "arrays.h"
#include "hits.h"
#include "long_call.h"
#include "rays.h"
#include "results.h"

#include "isospline/hopper/hopper.h"
#include "isospline/util/cancellable_mutex.h"
#include "isospline/util/fork.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* hopper_doc = R"(Plain voxel hopping, as in the paper [1]_: the baseline for a `Scene`.

A ray hops from voxel to voxel through a dense binary array. In voxels of the shell, the surface's own method
intersects it. The hits are the same as in a scene of this surface.

Parameters
----------
surface : Isosurface
    A change of its level takes effect at the next query.
strides : bool
    Whether empty bricks of 8 x 8 x 8 voxels are crossed in one step, as the octree that the paper suggests does.

Raises
------
ValueError
    For a surface that is capped or closed.

Notes
-----
The paper observes that the average hop is "about 0.653" of a voxel's edge long, and leaves the exact value to the
reader. Over lines that are uniform and isotropic it is the mean chord of a unit cube, by Cauchy's formula

.. math:: \frac{4 V}{S} = \frac{4 \cdot 1}{6} = \frac{2}{3}.

Parallel lines of direction d have the mean chord V / (area of the shadow) = :math:`1 / (|d_x| + |d_y| + |d_z|)`,
between 0.577 along a diagonal and 1 along an axis. A picture looks along few directions, so its average differs.

References
----------
.. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, sections 3 and 4.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[-8:9, -8:9, -8:9]
>>> volume = isospline.Volume(np.sqrt(x**2 + y**2 + z**2), origin=(-8, -8, -8))
>>> hopper = isospline.research.VoxelHopper(isospline.Isosurface(volume, 5.0, inside="below"))
>>> bool(abs(hopper.cast_rays([(-20, 0, 0, 1, 0, 0)])["t_hit"][0] - 15.0) < 0.01)
True
>>> round(hopper.statistics["mean_hop_length"], 6)
1.0
)";

constexpr const char* cast_rays_doc = R"(First crossing of each ray with the surface.

Parameters
----------
rays : (..., 6) array_like, float32 or float64
    Origin and direction, ox oy oz dx dy dz, in world units. Directions need not have length one.
t_near, t_far : float
    Only crossings with t in [t_near, t_far] count. t is in units of the direction's length.
outputs : sequence of str
    Names of the arrays to return, as in `Scene.cast_rays`.
dtype : dtype, optional
    Type of arrays of real numbers, float64 or float32; by default that of the rays.

Returns
-------
Hits
    As in `Scene.cast_rays`; the geometry id is 0.

Raises
------
ValueError
    If `rays` has another shape, an origin or direction is not finite, a direction is zero, the limits are NaN, an
    output name is unknown, or `dtype` is another type.
TypeError
    If `rays` does not hold real numbers.
)";

constexpr const char* statistics_doc = R"(HopStatistics: of the rays of the last `cast_rays`.

``hops``: from one voxel to the next. ``strides``: across empty bricks. ``evaluated_cells``: cells of the shell in which
the surface was searched. ``mean_hop_length``: of hops and strides, in voxels, or 0 without any. Hops end on the faces
of voxels, so the part from the last face to the hit does not count.)";

/// A hopper that follows the level of a surface, and the statistics of its last query.
class FollowingHopper {
public:
    FollowingHopper(std::shared_ptr<Isosurface> surface, const VoxelHopperOptions& options)
        : surface_(std::move(surface)), options_(options), level_(surface_->snapshot()),
          hopper_(std::make_shared<const VoxelHopper>(level_, options_))
    {
    }

    /// The hopper of the surface's current level.
    std::shared_ptr<const VoxelHopper> hopper(const Progress& progress)
    {
        const CancellableMutex::Lock to_change(mutex_, progress);
        if (auto level = surface_->snapshot(); level != level_) {
            auto hopper = std::make_shared<const VoxelHopper>(level, options_);
            const std::lock_guard lock(fork_safe_mutex(this));
            hopper_.swap(hopper);
            level_.swap(level);
        }
        return hopper_;
    }

    const std::shared_ptr<Isosurface>& surface() const { return surface_; }
    const VoxelHopperOptions& options() const { return options_; }

    HopStatistics last; ///< needs the GIL

private:
    std::shared_ptr<Isosurface> surface_;
    VoxelHopperOptions options_;
    CancellableMutex mutex_; ///< guards the members below
    std::shared_ptr<const IsosurfaceSnapshot> level_;
    std::shared_ptr<const VoxelHopper> hopper_;
};

std::unique_ptr<FollowingHopper> make_hopper(const py::object& given, bool strides)
{
    auto surface = as_object<Isosurface>(given, "surface");
    std::unique_ptr<FollowingHopper> following;
    long_call("to make a hopper", py::none(), [&](const Progress&) {
        following = std::make_unique<FollowingHopper>(std::move(surface), VoxelHopperOptions{strides});
    });
    return following;
}

py::object cast_rays(FollowingHopper& following, const py::object& rays, double t_near, double t_far,
                     const py::object& outputs, const py::object& dtype)
{
    const GivenRays given(rays, py::none(), t_near, t_far);
    HitArrays arrays(given.rows, outputs, dtype, py::none());
    const SnapshotObject object{following.surface()->snapshot()}; // any level: derivatives are those at the hit
    if (arrays.outputs.of_coefficients())
        arrays.make_coefficients(coefficient_count(object));
    HopStatistics statistics;
    std::mutex adding;
    long_call("to cast " + std::to_string(given.count()) + " rays", py::none(), [&](const Progress& progress) {
        const auto hopper = following.hopper(progress);
        given.for_each_chunk(progress, [&](std::size_t begin, std::size_t end) {
            std::vector<Hit> hits(end - begin);
            HitArrays::LastObject last;
            const HopStatistics of_chunk = hopper->cast_rays(given.chunk(begin, end), hits);
            for (std::size_t i = begin; i < end; i += RayPacket::capacity) {
                const std::size_t count = std::min<std::size_t>(RayPacket::capacity, end - i);
                std::array<std::size_t, RayPacket::capacity> places;
                std::iota(places.begin(), places.end(), i);
                const std::span<const Hit> some = std::span<const Hit>(hits).subspan(i - begin, count);
                arrays.set(places, count, ~LaneMask{0}, some);
                if (arrays.outputs.derivatives())
                    arrays.set_derivatives(
                        places, count, ~LaneMask{0}, some,
                        [&](std::size_t lane) { return given.ray(i + lane).direction; },
                        [&](std::uint32_t) -> const SnapshotObject& { return object; }, last);
            }
            const std::lock_guard lock(adding);
            statistics += of_chunk;
        });
    });
    following.last = statistics;
    return as_result("Hits", arrays.to_dict());
}

std::size_t memory(FollowingHopper& following)
{
    std::size_t bytes = 0;
    long_call("to make a hopper", py::none(),
              [&](const Progress& progress) { bytes = following.hopper(progress)->memory(); });
    return bytes;
}

py::object to_result(const HopStatistics& statistics)
{
    py::dict result;
    result["hops"] = statistics.hops;
    result["strides"] = statistics.strides;
    result["evaluated_cells"] = statistics.evaluated_cells;
    result["mean_hop_length"] = statistics.mean_hop_length();
    return as_result("HopStatistics", result);
}

} // namespace

void bind_hopper(py::module_& module)
{
    py::class_<FollowingHopper>(module, "VoxelHopper", hopper_doc)
        .def(py::init(&make_hopper), py::arg("surface"), py::kw_only(), py::arg("strides") = false)
        .def("cast_rays", &cast_rays, py::arg("rays"), py::kw_only(), py::arg("t_near") = 0.0,
             py::arg("t_far") = std::numeric_limits<double>::infinity(), py::arg("outputs") = default_hit_outputs(),
             py::arg("dtype") = py::none(), cast_rays_doc)
        .def_property_readonly(
            "statistics", [](const FollowingHopper& following) { return to_result(following.last); }, statistics_doc)
        .def_property_readonly("surface", &FollowingHopper::surface, "The surface.")
        .def_property_readonly(
            "strides", [](const FollowingHopper& following) { return following.options().strides; },
            "Whether empty bricks are crossed at once.")
        .def_property_readonly("memory", &memory, "Bytes held by the binary array and its index, at the current level.")
        .def("__repr__", [](const FollowingHopper& following) {
            return std::string("VoxelHopper(strides=") + (following.options().strides ? "True" : "False") + ")";
        });
}

} // namespace isospline
