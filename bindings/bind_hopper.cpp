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
#include <memory>
#include <mutex>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

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
                     const py::object& outputs, const py::object& dtype, const py::object& progress)
{
    const GivenRays given(rays, py::none(), t_near, t_far);
    HitArrays arrays(given.rows, outputs, dtype, py::none());
    const SnapshotObject object{following.surface()->snapshot()}; // any level: derivatives are those at the hit
    if (arrays.outputs.of_coefficients())
        arrays.make_coefficients(coefficient_count(object));
    HopStatistics statistics;
    std::mutex adding;
    long_call("to cast " + std::to_string(given.count()) + " rays", progress, [&](const Progress& report) {
        const auto hopper = following.hopper(part_of(report, 0.0, 0.1));
        given.for_each_chunk(part_of(report, 0.1, 1.0), [&](std::size_t begin, std::size_t end) {
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
    py::class_<FollowingHopper>(module, "VoxelHopper")
        .def(py::init(&make_hopper))
        .def("cast_rays", &cast_rays)
        .def_property_readonly("statistics", [](const FollowingHopper& following) { return to_result(following.last); })
        .def_property_readonly("surface", &FollowingHopper::surface)
        .def_property_readonly("strides", [](const FollowingHopper& following) { return following.options().strides; })
        .def_property_readonly("memory", &memory)
        .def("__repr__", [](const FollowingHopper& following) {
            return std::string("VoxelHopper(strides=") + (following.options().strides ? "True" : "False") + ")";
        });
}

} // namespace isospline
