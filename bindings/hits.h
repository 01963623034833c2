// Converts hits to NumPy arrays, for scenes and hoppers.
#pragma once

#include "arrays.h"

#include "isospline/scene/hit_derivatives.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/ray_packet.h"

#include <glm/gtc/matrix_access.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace isospline {

/// The arrays that a caller provides for results, by name.
class GivenArrays {
public:
    explicit GivenArrays(const pybind11::handle& out)
    {
        namespace py = pybind11;
        if (out.is_none())
            return;
        if (!py::isinstance<py::dict>(out))
            throw_wrong_type("out", "a dict of arrays, such as an earlier result", out);
        arrays_ = py::reinterpret_borrow<py::dict>(out);
    }

    /// The array of this name, which must have the right type and shape; a new array if there is none.
    template <typename Number>
    pybind11::array_t<Number> take(const char* name, Shape shape, const Shape& trailing = {}) const
    {
        namespace py = pybind11;
        shape.insert(shape.end(), trailing.begin(), trailing.end());
        if (!arrays_ || !arrays_.contains(name))
            return py::array_t<Number>(shape);
        const py::object given = arrays_[name];
        const std::string parameter = std::string("out[\"") + name + "\"]";
        const auto dtype = py::dtype::of<Number>();
        const std::string type = py::str(dtype);
        if (!py::isinstance<py::array_t<Number, py::array::c_style>>(given))
            throw_wrong_type(parameter.c_str(), "a C-contiguous array of " + type, given);
        auto array = py::reinterpret_borrow<py::array_t<Number>>(given);
        if (shape_of(array) != shape)
            throw_invalid(parameter.c_str(), "shape " + to_text(shape), to_text(shape_of(array)));
        if (!array.writeable())
            throw_invalid(parameter.c_str(), "an array that can be written to", "one that is read-only");
        return array;
    }

    /// Throws for a name that is not among the outputs.
    void check_names(const pybind11::handle& outputs) const
    {
        namespace py = pybind11;
        for (const auto& [name, array] : arrays_)
            if (!outputs.contains(name))
                throw_invalid("out", "arrays of names in outputs=", std::string(py::repr(name)));
    }

private:
    pybind11::dict arrays_;
};

/// An array of numbers in single or double precision.
class RealArray {
public:
    RealArray(const GivenArrays& given, const char* name, bool single_precision, const Shape& leading,
              const Shape& trailing = {})
    {
        if (single_precision) {
            auto array = given.take<float>(name, leading, trailing);
            floats_ = array.mutable_data();
            array_ = std::move(array);
        } else {
            auto array = given.take<double>(name, leading, trailing);
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
    /// A finite t stays finite in single precision: an infinite one means a miss.
    void set_t(std::size_t at, double t)
    {
        constexpr double largest = std::numeric_limits<float>::max();
        set(at, floats_ != nullptr && std::isfinite(t) ? std::clamp(t, -largest, largest) : t);
    }

    template <glm::length_t Length>
    void set(std::size_t row, const glm::vec<Length, double>& vector)
    {
        for (glm::length_t axis = 0; axis < Length; ++axis)
            set(static_cast<std::size_t>(Length) * row + static_cast<std::size_t>(axis), vector[axis]);
    }

    /// The matrix in rows.
    void set(std::size_t place, const glm::dmat3& matrix)
    {
        for (int row = 0; row < 3; ++row)
            set(3 * place + static_cast<std::size_t>(row), glm::row(matrix, row));
    }

    const pybind11::array& array() const { return array_; }

private:
    pybind11::array array_;
    float* floats_ = nullptr;
    double* doubles_ = nullptr;
};

/// The arrays that cast_rays can return, by their names in `outputs`.
struct HitOutputs {
    bool t_hit = false, geometry_ids = false, primitive_ids = false, primitive_normals = false;
    bool positions = false, primitive_uvs = false, gradient_magnitudes = false;
    bool dt_dlevel = false, dt_dorigin = false, dt_ddirection = false, grazing = false;
    bool dnormal_dlevel = false, dnormal_dorigin = false, dnormal_ddirection = false;
    bool coefficient_indices = false, coefficient_weights = false, coefficient_gradients = false;

    bool of_t() const { return dt_dlevel || dt_dorigin || dt_ddirection || grazing; }
    bool of_normals() const { return dnormal_dlevel || dnormal_dorigin || dnormal_ddirection; }
    bool of_coefficients() const { return coefficient_indices || coefficient_weights || coefficient_gradients; }
    bool derivatives() const { return of_t() || of_normals() || of_coefficients(); }
    /// Whether only arrays are requested that need no data from objects.
    bool only_t_and_ids() const { return !primitive_normals && !positions && !gradient_magnitudes && !derivatives(); }
};

inline constexpr Named<bool HitOutputs::*> hit_output_names[] = {
    {"t_hit", &HitOutputs::t_hit},
    {"geometry_ids", &HitOutputs::geometry_ids},
    {"primitive_ids", &HitOutputs::primitive_ids},
    {"primitive_normals", &HitOutputs::primitive_normals},
    {"positions", &HitOutputs::positions},
    {"primitive_uvs", &HitOutputs::primitive_uvs},
    {"gradient_magnitudes", &HitOutputs::gradient_magnitudes},
    {"dt_dlevel", &HitOutputs::dt_dlevel},
    {"dt_dorigin", &HitOutputs::dt_dorigin},
    {"dt_ddirection", &HitOutputs::dt_ddirection},
    {"grazing", &HitOutputs::grazing},
    {"dnormal_dlevel", &HitOutputs::dnormal_dlevel},
    {"dnormal_dorigin", &HitOutputs::dnormal_dorigin},
    {"dnormal_ddirection", &HitOutputs::dnormal_ddirection},
    {"coefficient_indices", &HitOutputs::coefficient_indices},
    {"coefficient_weights", &HitOutputs::coefficient_weights},
    {"coefficient_gradients", &HitOutputs::coefficient_gradients},
};

/// The arrays that cast_rays returns.
class HitArrays {
public:
    /// `dtype` None means the type of the rays. `out` is None or has arrays to write to.
    HitArrays(const RowArray& rays, const pybind11::handle& names, const pybind11::handle& dtype,
              const pybind11::handle& out)
        : outputs(as_flags<HitOutputs>(hit_output_names, names, "outputs"))
    {
        const Shape shape = rays.leading_shape();
        const bool single_precision =
            dtype.is_none() ? rays.is_single_precision() : isospline::is_single_precision(dtype, "dtype");
        const GivenArrays given(out);
        given.check_names(names);
        if (outputs.t_hit)
            t_hit_.emplace(given, "t_hit", single_precision, shape);
        if (outputs.geometry_ids)
            geometry_ids_.emplace(given, "geometry_ids", shape);
        if (outputs.primitive_ids)
            primitive_ids_.emplace(given, "primitive_ids", shape);
        if (outputs.primitive_normals)
            normals_.emplace(given, "primitive_normals", single_precision, shape, Shape{3});
        if (outputs.positions)
            positions_.emplace(given, "positions", single_precision, shape, Shape{3});
        if (outputs.primitive_uvs)
            uvs_.emplace(given, "primitive_uvs", true, shape, Shape{2});
        if (outputs.gradient_magnitudes)
            gradient_magnitudes_.emplace(given, "gradient_magnitudes", single_precision, shape);
        if (outputs.dt_dlevel)
            dt_dlevel_.emplace(given, "dt_dlevel", single_precision, shape);
        if (outputs.dt_dorigin)
            dt_dorigin_.emplace(given, "dt_dorigin", single_precision, shape, Shape{3});
        if (outputs.dt_ddirection)
            dt_ddirection_.emplace(given, "dt_ddirection", single_precision, shape, Shape{3});
        if (outputs.grazing)
            grazing_.emplace(given, "grazing", shape);
        if (outputs.dnormal_dlevel)
            dnormal_dlevel_.emplace(given, "dnormal_dlevel", single_precision, shape, Shape{3});
        if (outputs.dnormal_dorigin)
            dnormal_dorigin_.emplace(given, "dnormal_dorigin", single_precision, shape, Shape{3, 3});
        if (outputs.dnormal_ddirection)
            dnormal_ddirection_.emplace(given, "dnormal_ddirection", single_precision, shape, Shape{3, 3});
        given_ = given;
        shape_ = shape;
        single_precision_ = single_precision;
    }

    /// Makes the arrays of coefficients; `count` influence a hit. Called with the GIL, before set_derivatives().
    void make_coefficients(std::size_t count)
    {
        coefficient_count_ = count;
        const Shape trailing{static_cast<Shape::value_type>(count)};
        if (outputs.coefficient_indices)
            coefficient_indices_.emplace(given_, "coefficient_indices", shape_, trailing);
        if (outputs.coefficient_weights)
            coefficient_weights_.emplace(given_, "coefficient_weights", single_precision_, shape_, trailing);
        if (outputs.coefficient_gradients)
            coefficient_gradients_.emplace(given_, "coefficient_gradients", single_precision_, shape_,
                                           Shape{trailing.front(), 3});
    }

    /// The object of the last hit: most hits that follow each other have the same one.
    struct LastObject {
        HitDerivatives derivatives;
        std::uint32_t geometry_id = invalid_id;
    };

    /// Sets what depends on the rays, direction_of(lane), and the objects, object_of(geometry id). May be called
    /// without the GIL.
    template <typename Places, typename DirectionOf, typename ObjectOf>
    void set_derivatives(const Places& places, std::size_t count, LaneMask hit_lanes, std::span<const Hit> hits,
                         const DirectionOf& direction_of, const ObjectOf& object_of, LastObject& last)
    {
        static const Hit miss;
        std::vector<CoefficientWeight> weights(coefficient_count_);
        for (std::size_t lane = 0; lane < count; ++lane) {
            const Hit& hit = (hit_lanes >> lane & 1u) != 0 && hits[lane] ? hits[lane] : miss;
            if (hit && hit.geometry_id != last.geometry_id)
                last = {HitDerivatives(object_of(hit.geometry_id)), hit.geometry_id};
            const std::size_t at = places[lane];
            const glm::dvec3 along = direction_of(lane);
            const bool grazes = hit && is_grazing(hit, along), moves = hit && !grazes;
            if (dt_dlevel_)
                dt_dlevel_->set(at, moves ? last.derivatives.t_by_level(hit, along) : 0.0);
            if (grazing_)
                grazing_->data[at] = grazes;
            if (dt_dorigin_ || dt_ddirection_) {
                const glm::dvec3 by_origin = moves ? t_by_origin(hit, along) : glm::dvec3(0.0);
                if (dt_dorigin_)
                    dt_dorigin_->set(at, by_origin);
                if (dt_ddirection_)
                    dt_ddirection_->set(at, moves ? hit.t * by_origin : glm::dvec3(0.0));
            }
            if (outputs.of_normals()) {
                const NormalDerivatives of_normal =
                    moves ? last.derivatives.of_normal(hit, along) : NormalDerivatives();
                if (dnormal_dlevel_)
                    dnormal_dlevel_->set(at, of_normal.by_level);
                if (dnormal_dorigin_)
                    dnormal_dorigin_->set(at, of_normal.by_origin);
                if (dnormal_ddirection_)
                    dnormal_ddirection_->set(at, of_normal.by_direction);
            }
            if (coefficient_count_ > 0) {
                last.derivatives.set_coefficient_weights(hit, weights);
                for (std::size_t i = 0; i < coefficient_count_; ++i) {
                    const std::size_t place = at * coefficient_count_ + i;
                    if (coefficient_indices_)
                        coefficient_indices_->data[place] = weights[i].place;
                    if (coefficient_weights_)
                        coefficient_weights_->set(place, weights[i].weight);
                    if (coefficient_gradients_)
                        coefficient_gradients_->set(place, weights[i].gradient);
                }
            }
        }
    }

    /// Sets the items of `count` rays at these places. Rays in `hit_lanes` have hits, the others miss. May be called
    /// without the GIL.
    template <typename Places>
    void set(const Places& places, std::size_t count, LaneMask hit_lanes, std::span<const Hit> hits)
    {
        static const Hit miss;
        const auto for_each = [&](const auto& set_item) {
            for (std::size_t lane = 0; lane < count; ++lane)
                set_item(places[lane], (hit_lanes >> lane & 1u) != 0 ? hits[lane] : miss);
        };
        if (t_hit_)
            for_each([&](std::size_t at, const Hit& hit) { t_hit_->set_t(at, hit.t); });
        if (geometry_ids_)
            for_each([&](std::size_t at, const Hit& hit) { geometry_ids_->data[at] = hit.geometry_id; });
        if (primitive_ids_)
            for_each([&](std::size_t at, const Hit& hit) { primitive_ids_->data[at] = hit.primitive_id; });
        if (normals_)
            for_each([&](std::size_t at, const Hit& hit) { normals_->set(at, hit.normal); });
        if (positions_)
            for_each([&](std::size_t at, const Hit& hit) {
                positions_->set(at, hit ? hit.position : glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
            });
        if (uvs_)
            for_each([&](std::size_t at, const Hit& hit) { uvs_->set(at, glm::dvec2(hit.uv)); });
        if (gradient_magnitudes_)
            for_each([&](std::size_t at, const Hit& hit) { gradient_magnitudes_->set(at, hit.gradient_magnitude); });
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
        const auto add = [&](const char* name, const std::optional<RealArray>& numbers) {
            if (numbers)
                result[name] = numbers->array();
        };
        add("dt_dlevel", dt_dlevel_);
        add("dt_dorigin", dt_dorigin_);
        add("dt_ddirection", dt_ddirection_);
        if (grazing_)
            result["grazing"] = grazing_->array;
        add("dnormal_dlevel", dnormal_dlevel_);
        add("dnormal_dorigin", dnormal_dorigin_);
        add("dnormal_ddirection", dnormal_ddirection_);
        if (coefficient_indices_)
            result["coefficient_indices"] = coefficient_indices_->array;
        add("coefficient_weights", coefficient_weights_);
        add("coefficient_gradients", coefficient_gradients_);
        return result;
    }

    const HitOutputs outputs;

private:
    template <typename Id>
    struct IdArray {
        IdArray(const GivenArrays& given, const char* name, const Shape& shape, const Shape& trailing = {})
            : array(given.take<Id>(name, shape, trailing)), data(array.mutable_data())
        {
        }

        pybind11::array_t<Id> array;
        Id* data;
    };

    std::optional<RealArray> t_hit_, normals_, positions_, uvs_, gradient_magnitudes_;
    std::optional<RealArray> dt_dlevel_, dt_dorigin_, dt_ddirection_;
    std::optional<RealArray> dnormal_dlevel_, dnormal_dorigin_, dnormal_ddirection_;
    std::optional<RealArray> coefficient_weights_, coefficient_gradients_;
    std::optional<IdArray<bool>> grazing_;
    std::optional<IdArray<std::int64_t>> coefficient_indices_;
    GivenArrays given_{pybind11::none()};
    Shape shape_;
    bool single_precision_ = false;
    std::size_t coefficient_count_ = 0;
    std::optional<IdArray<decltype(Hit::geometry_id)>> geometry_ids_;
    std::optional<IdArray<decltype(Hit::primitive_id)>> primitive_ids_;
};

} // namespace isospline
