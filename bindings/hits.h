// Hits to NumPy arrays: the same for scenes and hoppers.
#pragma once

#include "arrays.h"

#include "isospline/trace/hit.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace isospline {

/// An array of numbers in single or double precision.
class RealArray {
public:
    RealArray(bool single_precision, const Shape& leading, const Shape& trailing = {})
    {
        if (single_precision) {
            auto array = new_array<float>(leading, trailing);
            floats_ = array.mutable_data();
            array_ = std::move(array);
        } else {
            auto array = new_array<double>(leading, trailing);
            doubles_ = array.mutable_data();
            array_ = std::move(array);
        }
    }

    /// May be called without the GIL.
    void set(std::size_t at, double value)
    {
        if (floats_ != nullptr)
            floats_[at] = static_cast<float>(value);
        else
            doubles_[at] = value;
    }
    void set(std::size_t row, const glm::dvec3& vector)
    {
        for (int axis = 0; axis < 3; ++axis)
            set(3 * row + static_cast<std::size_t>(axis), vector[axis]);
    }

    const pybind11::array& array() const { return array_; }

private:
    pybind11::array array_;
    float* floats_ = nullptr;
    double* doubles_ = nullptr;
};

/// The arrays that cast_rays can return, by the names that `outputs` has.
struct HitOutputs {
    bool t_hit = false, geometry_ids = false, primitive_ids = false, primitive_normals = false;
    bool positions = false, primitive_uvs = false, gradient_magnitudes = false;

    /// Whether nothing is asked for that an object has to complete.
    bool only_t_and_ids() const { return !primitive_normals && !positions && !gradient_magnitudes; }
};

inline constexpr Named<bool HitOutputs::*> hit_output_names[] = {
    {"t_hit", &HitOutputs::t_hit},
    {"geometry_ids", &HitOutputs::geometry_ids},
    {"primitive_ids", &HitOutputs::primitive_ids},
    {"primitive_normals", &HitOutputs::primitive_normals},
    {"positions", &HitOutputs::positions},
    {"primitive_uvs", &HitOutputs::primitive_uvs},
    {"gradient_magnitudes", &HitOutputs::gradient_magnitudes},
};

/// What cast_rays returns unless it is told what: as Open3D does.
inline pybind11::tuple default_hit_outputs()
{
    return pybind11::make_tuple("t_hit", "geometry_ids", "primitive_ids", "primitive_normals");
}

/// The arrays that cast_rays returns.
class HitArrays {
public:
    HitArrays(const Shape& shape, const pybind11::handle& names, const pybind11::handle& dtype)
        : outputs(as_flags<HitOutputs>(hit_output_names, names, "outputs"))
    {
        const bool single_precision = is_single_precision(dtype, "dtype");
        if (outputs.t_hit)
            t_hit_.emplace(single_precision, shape);
        if (outputs.geometry_ids)
            geometry_ids_.emplace(shape);
        if (outputs.primitive_ids)
            primitive_ids_.emplace(shape);
        if (outputs.primitive_normals)
            normals_.emplace(single_precision, shape, Shape{3});
        if (outputs.positions)
            positions_.emplace(single_precision, shape, Shape{3});
        if (outputs.primitive_uvs)
            uvs_.emplace(true, shape, Shape{2});
        if (outputs.gradient_magnitudes)
            gradient_magnitudes_.emplace(single_precision, shape);
    }

    /// Sets the items of a ray; may be called without the GIL.
    void set(std::size_t at, const Hit& hit)
    {
        if (t_hit_)
            t_hit_->set(at, hit.t);
        if (geometry_ids_)
            geometry_ids_->data[at] = hit.geometry_id;
        if (primitive_ids_)
            primitive_ids_->data[at] = hit.primitive_id;
        if (normals_)
            normals_->set(at, hit.normal);
        if (positions_)
            positions_->set(at, hit ? hit.position : glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
        if (uvs_) {
            uvs_->set(2 * at, static_cast<double>(hit.uv.x));
            uvs_->set(2 * at + 1, static_cast<double>(hit.uv.y));
        }
        if (gradient_magnitudes_)
            gradient_magnitudes_->set(at, hit.gradient_magnitude);
    }

    pybind11::dict to_dict() const
    {
        pybind11::dict result;
        if (t_hit_)
            result["t_hit"] = t_hit_->array();
        if (geometry_ids_)
            result["geometry_ids"] = geometry_ids_->array;
        if (primitive_ids_)
            result["primitive_ids"] = primitive_ids_->array;
        if (normals_)
            result["primitive_normals"] = normals_->array();
        if (positions_)
            result["positions"] = positions_->array();
        if (uvs_)
            result["primitive_uvs"] = uvs_->array();
        if (gradient_magnitudes_)
            result["gradient_magnitudes"] = gradient_magnitudes_->array();
        return result;
    }

    const HitOutputs outputs;

private:
    template <typename Id>
    struct IdArray {
        explicit IdArray(const Shape& shape) : array(new_array<Id>(shape)), data(array.mutable_data()) {}

        pybind11::array_t<Id> array;
        Id* data;
    };

    std::optional<RealArray> t_hit_, normals_, positions_, uvs_, gradient_magnitudes_;
    std::optional<IdArray<decltype(Hit::geometry_id)>> geometry_ids_;
    std::optional<IdArray<decltype(Hit::primitive_id)>> primitive_ids_;
};

} // namespace isospline
