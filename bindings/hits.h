// Rays from NumPy arrays, hits to NumPy arrays: the same for scenes and hoppers.
#pragma once

#include "arrays.h"

#include "isospline/math/ray.h"
#include "isospline/trace/check_ray.h"
#include "isospline/trace/hit.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace isospline {

inline void check_limits(double t_near, double t_far)
{
    if (std::isnan(t_near))
        throw_invalid("t_near", "a number", t_near);
    if (std::isnan(t_far))
        throw_invalid("t_far", "a number", t_far);
}

/// The order in which rays are traced. Rays of an array of shape (H, W, 6) or (..., H, W, 6) are traced in tiles of 4 x
/// 4, as those of a picture are close together so; others one after the other.
class RayOrder {
public:
    static constexpr std::size_t tile = 4;

    RayOrder(const Shape& shape, bool tiled) : tiled_(tiled && shape.size() >= 2)
    {
        if (!tiled_)
            return;
        width_ = static_cast<std::size_t>(shape.back());
        height_ = static_cast<std::size_t>(shape[shape.size() - 2]);
        tiled_ = width_ % tile == 0 && height_ % tile == 0 && width_ > 0 && height_ > 0;
    }

    /// The place in the array of the ray that is i-th in the order.
    std::size_t operator()(std::size_t i) const
    {
        if (!tiled_)
            return i;
        const std::size_t row_of_tiles = i / (width_ * tile), within_row = i % (width_ * tile);
        const std::size_t tile_in_row = within_row / (tile * tile), within_tile = within_row % (tile * tile);
        return (row_of_tiles * tile + within_tile / tile) * width_ + tile_in_row * tile + within_tile % tile;
    }

private:
    bool tiled_;
    std::size_t width_ = 0, height_ = 0;
};

/// Rays of a chunk; only the last may have fewer.
inline constexpr std::size_t ray_chunk_size = 1024;

/// Calls `body(rays, first)` in parallel for chunks of the rays in an array of shape (..., 6), without the GIL; rays
/// are in the order given, and `first` counts in it.
template <typename Body>
void for_each_chunk(const RowArray& rows, const RayOrder& order, double t_near, double t_far, const Progress& progress,
                    const Body& body)
{
    const auto check = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            for (std::size_t column = 0; column < 6; ++column)
                if (!std::isfinite(rows(i, column)))
                    throw_invalid("rays", "finite origins and directions",
                                  std::to_string(rows(i, column)) + " in ray " + std::to_string(i));
            if (rows.vector(i, 3) == glm::dvec3(0.0))
                throw_invalid("rays", "directions that are not zero", "(0, 0, 0) in ray " + std::to_string(i));
            check_ray({rows.vector(i, 0), rows.vector(i, 3)}, i);
        }
    };
    const auto do_chunk = [&](std::size_t begin) {
        std::vector<Ray> rays(std::min(ray_chunk_size, rows.count() - begin));
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const std::size_t row = order(begin + i);
            Ray& ray = rays[i];
            for (int axis = 0; axis < 3; ++axis) {
                ray.origin[axis] = rows(row, static_cast<std::size_t>(axis));
                ray.direction[axis] = rows(row, static_cast<std::size_t>(axis) + 3);
            }
            ray.t_near = t_near;
            ray.t_far = t_far;
        }
        body(std::span<const Ray>(rays), begin);
    };
    try {
        parallel_for((rows.count() + ray_chunk_size - 1) / ray_chunk_size, 1,
                     [&](std::size_t begin, std::size_t end) {
                         for (std::size_t chunk = begin; chunk < end; ++chunk)
                             do_chunk(chunk * ray_chunk_size);
                     },
                     progress);
    } catch (const std::invalid_argument&) {
        check(0, rows.count()); // names the first of the bad rays, whichever thread came upon one
        throw;
    }
}

/// The arrays that cast_rays returns.
class HitArrays {
public:
    explicit HitArrays(const Shape& shape, bool details = false)
        : t_hit_(new_array<double>(shape)), geometry_ids_(new_array<std::uint32_t>(shape)),
          primitive_ids_(new_array<std::uint32_t>(shape)), normals_(new_array<double>(shape, {3})),
          t_hit_data_(t_hit_.mutable_data()), geometry_ids_data_(geometry_ids_.mutable_data()),
          primitive_ids_data_(primitive_ids_.mutable_data()), normals_data_(normals_.mutable_data())
    {
        if (details)
            details_.emplace(shape);
    }

    /// Sets the items from the `first` of the order on; may be called without the GIL.
    void set(std::span<const Hit> hits, const RayOrder& order, std::size_t first)
    {
        for (std::size_t i = 0; i < hits.size(); ++i) {
            const Hit& hit = hits[i];
            const std::size_t at = order(first + i);
            t_hit_data_[at] = hit.t;
            geometry_ids_data_[at] = hit.geometry_id;
            primitive_ids_data_[at] = hit.primitive_id;
            for (int axis = 0; axis < 3; ++axis)
                normals_data_[3 * at + static_cast<std::size_t>(axis)] = hit.normal[axis];
            if (details_)
                details_->set(hit, at);
        }
    }

    pybind11::dict to_dict() const
    {
        pybind11::dict result;
        result["t_hit"] = t_hit_;
        result["geometry_ids"] = geometry_ids_;
        result["primitive_ids"] = primitive_ids_;
        result["primitive_normals"] = normals_;
        if (details_) {
            result["positions"] = details_->positions;
            result["primitive_uvs"] = details_->uvs;
            result["gradient_magnitudes"] = details_->gradient_magnitudes;
        }
        return result;
    }

private:
    struct Details {
        explicit Details(const Shape& shape)
            : positions(new_array<double>(shape, {3})), gradient_magnitudes(new_array<double>(shape)),
              uvs(new_array<float>(shape, {2})), positions_data(positions.mutable_data()),
              gradient_magnitudes_data(gradient_magnitudes.mutable_data()), uvs_data(uvs.mutable_data())
        {
        }

        void set(const Hit& hit, std::size_t at)
        {
            for (int axis = 0; axis < 3; ++axis)
                positions_data[3 * at + static_cast<std::size_t>(axis)] =
                    hit ? hit.position[axis] : std::numeric_limits<double>::quiet_NaN();
            gradient_magnitudes_data[at] = hit.gradient_magnitude;
            uvs_data[2 * at] = hit.uv.x;
            uvs_data[2 * at + 1] = hit.uv.y;
        }

        pybind11::array_t<double> positions, gradient_magnitudes;
        pybind11::array_t<float> uvs;
        double* positions_data;
        double* gradient_magnitudes_data;
        float* uvs_data;
    };

    pybind11::array_t<double> t_hit_;
    pybind11::array_t<std::uint32_t> geometry_ids_, primitive_ids_;
    pybind11::array_t<double> normals_;
    double* t_hit_data_;
    std::uint32_t* geometry_ids_data_;
    std::uint32_t* primitive_ids_data_;
    double* normals_data_;
    std::optional<Details> details_;
};

/// The same array, which Python cannot write to.
template <typename Array>
Array read_only(Array array)
{
    array.attr("flags").attr("writeable") = false;
    return array;
}

} // namespace isospline
