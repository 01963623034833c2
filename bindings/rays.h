// Reads rays from NumPy arrays, for scenes and hoppers.
#pragma once

#include "arrays.h"
#include "handed.h"
#include "visiting_order.h"

#include "isospline/math/ray.h"
#include "isospline/scene/ray_caster.h"
#include "isospline/scene/ray_coherence.h"
#include "isospline/trace/check_ray.h"
#include "isospline/trace/ray_packet.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace isospline {

inline void check_limits(double t_near, double t_far)
{
    if (std::isnan(t_near))
        throw_invalid("t_near", "a number", t_near);
    if (std::isnan(t_far))
        throw_invalid("t_far", "a number", t_far);
}

/// The order in which rays are traced: that of the array, or another one that is set.
class RayOrder {
public:
    static constexpr std::size_t tile = 4;

    /// Traces rays of an array of shape (H, W, 6) or (..., H, W, 6) in tiles of 4 x 4, because such rays are often
    /// those of a picture and then close together. Others keep their order.
    void set_tiles(const Shape& shape)
    {
        if (shape.size() < 2)
            return;
        width_ = static_cast<std::size_t>(shape.back());
        const auto height = static_cast<std::size_t>(shape[shape.size() - 2]);
        tiled_ = width_ % tile == 0 && height % tile == 0 && width_ > 0 && height > 0;
    }

    void set(VisitingOrder order)
    {
        tiled_ = false;
        visiting_ = std::move(order);
    }

    bool is_tiled() const { return tiled_; }

    /// The places in the array of `count` rays, beginning with the `first` of the order, which begins a row of a tile.
    void set_places(std::size_t first, int count, std::array<std::size_t, RayPacket::capacity>& places) const
    {
        if (!visiting_.is_given_order()) {
            for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
                places[i] = visiting_[first + i];
            return;
        }
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); i += tile) {
            const std::size_t begin = (*this)(first + i);
            for (std::size_t j = 0; j < tile; ++j)
                places[i + j] = begin + j;
        }
    }

    /// The place in the array of the i-th ray of the order.
    std::size_t operator()(std::size_t i) const
    {
        if (!tiled_)
            return visiting_[i];
        const std::size_t row_of_tiles = i / (width_ * tile), within_row = i % (width_ * tile);
        const std::size_t tile_in_row = within_row / (tile * tile), within_tile = within_row % (tile * tile);
        return (row_of_tiles * tile + within_tile / tile) * width_ + tile_in_row * tile + within_tile % tile;
    }

private:
    bool tiled_ = false;
    std::size_t width_ = 0;
    VisitingOrder visiting_; ///< of rays that are not tiled
};

/// Fewer rays are not worth sorting.
inline constexpr std::size_t least_sorted = 16384;

/// Rays of a chunk, a number of whole packets; only the last chunk may have fewer.
inline constexpr std::size_t ray_chunk_size = 1024;

/// Rays of shape (..., 6), from their origins and directions if these are given apart.
inline pybind11::object joined(const pybind11::object& rays, const pybind11::object& directions)
{
    return directions.is_none() ? rays : handed("joined_rays")(rays, directions);
}

/// The rays in an array of shape (..., 6), with common limits.
struct GivenRays {
    GivenRays(const pybind11::object& rays, const pybind11::object& directions, double given_t_near, double given_t_far)
        : rows(joined(rays, directions), "rays", 6), shape(rows.leading_shape()), t_near(given_t_near),
          t_far(given_t_far)
    {
        check_limits(t_near, t_far);
    }

    std::size_t count() const { return rows.count(); }

    /// Sets the order in which the rays are traced fastest, and tells how. `coherent` rays keep their order, or that of
    /// tiles, and may be traced in packets; others one by one. If that is not given, it is found out, and rays that are
    /// far from each other are sorted. Rays at volumes on disk that are not coherent are sorted in any case, so that
    /// chunks are read rarely.
    RayCaster::Rays arrange(const SceneSnapshot& scene, bool SeenBy::*sees, std::optional<bool> coherent,
                            const Progress& progress)
    {
        if (!coherent.value_or(false) && scene.reads_sources()) {
            order.set(VisitingOrder(scene, sees, rows, t_near, t_far));
            return RayCaster::Rays::incoherent;
        }
        if (coherent == false || (!coherent && count() < RayCoherence::group_size))
            return RayCaster::Rays::incoherent;
        order.set_tiles(shape);
        if (coherent)
            return RayCaster::Rays::coherent;
        using Closeness = RayCoherence::Closeness;
        const RayCoherence& coherence = scene.coherence(sees);
        const auto look = [&] { return coherence.closeness(count(), [this](std::size_t i) { return ray(i); }); };
        Closeness closeness = look();
        if (closeness != Closeness::packets && order.is_tiled()) {
            order.set({});
            closeness = look();
        }
        if (closeness == Closeness::sorting && count() >= least_sorted) {
            order.set(VisitingOrder(coherence.sorted(
                count(), [this](std::size_t i) { return ray(i); }, progress)));
            closeness = look();
        }
        return closeness == Closeness::packets ? RayCaster::Rays::coherent : RayCaster::Rays::incoherent;
    }

    /// The rays from `begin` to `end` of the order.
    std::vector<Ray> chunk(std::size_t begin, std::size_t end) const
    {
        std::vector<Ray> rays;
        rays.reserve(end - begin);
        for (std::size_t i = begin; i < end; ++i)
            rays.push_back(ray(i));
        return rays;
    }

    /// The i-th ray of the order.
    Ray ray(std::size_t i) const { return {rows.vector(order(i), 0), rows.vector(order(i), 3), t_near, t_far}; }

    /// Calls `body(begin, end)` in parallel for chunks of the order, without the GIL.
    template <typename Body>
    void for_each_chunk(const Progress& progress, const Body& body) const
    {
        try {
            parallel_for((count() + ray_chunk_size - 1) / ray_chunk_size, 1,
                         [&](std::size_t first, std::size_t last) {
                             for (std::size_t i = first; i < last; ++i)
                                 body(i * ray_chunk_size, std::min((i + 1) * ray_chunk_size, count()));
                         },
                         progress);
        } catch (const std::invalid_argument&) {
            check(); // names the first bad ray, not the one that a thread found first
            throw;
        }
    }

    /// Rays of the order in packets, and their places in the array.
    struct Batch {
        Batch(std::size_t size, double t_near, double t_far) : packets(size), places(size)
        {
            for (RayPacket& packet : packets) {
                std::fill_n(packet.t_near, RayPacket::capacity, t_near);
                std::fill_n(packet.t_far, RayPacket::capacity, t_far);
            }
        }
        std::vector<RayPacket> packets;
        std::vector<std::array<std::size_t, RayPacket::capacity>> places;
    };

    /// Calls `body(packets, begin, places)` for the rays of a chunk, in batches of up to `size` packets of up to
    /// `width` rays. `places` are places in the array, `begin` is a position in the order.
    template <typename Body>
    void for_each_batch(std::size_t begin, std::size_t end, int width, std::size_t size, const Body& body) const
    {
        const auto of_packet = static_cast<std::size_t>(width);
        Batch batch(std::min(size, (end - begin + of_packet - 1) / of_packet), t_near, t_far);
        while (begin < end) {
            const std::size_t first = begin;
            std::size_t count = 0;
            for (; count < batch.packets.size() && begin < end; ++count) {
                RayPacket& packet = batch.packets[count];
                packet.count = static_cast<int>(std::min(of_packet, end - begin));
                order.set_places(begin, packet.count, batch.places[count]);
                rows.visit([&](const auto* numbers) { load(numbers, batch.places[count], packet); });
                begin += static_cast<std::size_t>(packet.count);
            }
            body(std::span<const RayPacket>(batch.packets.data(), count), first, std::as_const(batch.places));
        }
    }

    /// Calls `body(packet, begin, places)` for packets of up to `width` rays.
    template <typename Body>
    void for_each_packet(std::size_t begin, std::size_t end, int width, const Body& body) const
    {
        for_each_batch(begin, end, width, 1,
                       [&](std::span<const RayPacket> packets, std::size_t first, const auto& places) {
                           body(packets.front(), first, places.front());
                       });
    }

    RowArray rows;
    Shape shape; ///< of the array of rays
    RayOrder order;
    double t_near, t_far;

private:
    template <typename Number>
    static void load(const Number* rows, const std::array<std::size_t, RayPacket::capacity>& places, RayPacket& packet)
    {
        for (int lane = 0; lane < packet.count; ++lane) {
            const Number* const row = rows + 6 * places[static_cast<std::size_t>(lane)];
            for (int axis = 0; axis < 3; ++axis) {
                packet.origin[axis][lane] = static_cast<double>(row[axis]);
                packet.direction[axis][lane] = static_cast<double>(row[axis + 3]);
            }
        }
    }

    /// Throws if a ray cannot be cast.
    void check() const
    {
        for (std::size_t i = 0; i < count(); ++i) {
            for (std::size_t column = 0; column < 6; ++column)
                if (!std::isfinite(rows(i, column)))
                    throw_invalid("rays", "finite origins and directions",
                                  std::to_string(rows(i, column)) + " in ray " + std::to_string(i));
            if (rows.vector(i, 3) == glm::dvec3(0.0))
                throw_invalid("rays", "directions that are not zero", "(0, 0, 0) in ray " + std::to_string(i));
            check_ray({rows.vector(i, 0), rows.vector(i, 3)}, i);
        }
    }
};

} // namespace isospline
