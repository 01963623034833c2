// Converts NumPy arrays and Python values to C++ and back. All checks of dtype, shape and layout are here. Errors name
// the parameter, the expected and the given value: ValueError for shapes and values, TypeError for types.
#pragma once

#include "gil.h"
#include "glm_casters.h"
#include "mistakes.h"
#include "warn.h"

#include "isospline/spline/volume.h"
#include "isospline/util/error.h"

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace isospline {

using Shape = std::vector<pybind11::ssize_t>;

/// `(3, 4)`, as NumPy prints it.
inline std::string to_text(const Shape& shape)
{
    std::string text = "(";
    for (std::size_t i = 0; i < shape.size(); ++i)
        text.append(i > 0 ? ", " : "").append(std::to_string(shape[i]));
    return text + (shape.size() == 1 ? ",)" : ")");
}

/// `64 x 48 pixels`.
inline std::string size_text(int width, int height)
{
    return std::to_string(width) + " x " + std::to_string(height) + " pixels";
}

inline Shape shape_of(const pybind11::array& array)
{
    return Shape(array.shape(), array.shape() + array.ndim());
}

/// Refuses masked arrays: NumPy would use the values under the mask as data.
inline void refuse_masked(const pybind11::handle& value, const char* parameter)
{
    namespace py = pybind11;
    if (!py::hasattr(value, "mask") || !py::isinstance<py::array>(value))
        return;
    const auto masked = py::module_::import("numpy").attr("ma");
    if (!py::isinstance(value, masked.attr("MaskedArray")))
        return;
    const auto count = masked.attr("count_masked")(value).cast<std::size_t>();
    if (count > 0)
        throw_invalid(parameter, "an array without masked values: fill them, array.filled(value)",
                      std::to_string(count) + " masked");
}

/// The NumPy array of a tensor of another library, by its own `numpy()` or DLPack; any other value as it is. NumPy
/// would read the items of such a tensor one by one. DLPack comes second: NumPy first calls it with keywords, which
/// bindings of earlier versions of DLPack, as Open3D's, refuse with the text of all numbers in the message.
inline pybind11::object as_host_array(const pybind11::handle& value, const char* parameter, const char* expected)
{
    namespace py = pybind11;
    auto given = py::reinterpret_borrow<py::object>(value);
    if (py::isinstance<py::array>(value))
        return given;
    // Tensors of PyTorch with gradients have to be detached: NumPy takes numbers alone.
    if (py::hasattr(value, "requires_grad") && py::hasattr(value, "detach")) {
        if (py::bool_(value.attr("requires_grad")))
            warn(std::string(parameter) + ": a tensor that requires a gradient is read without it; "
                                          "isospline.derivatives.cast_vjp has the derivatives of hits");
        given = given.attr("detach")();
    }
    if (py::hasattr(given, "__array__"))
        return given;
    const bool has_numpy = py::hasattr(given, "numpy") && PyCallable_Check(given.attr("numpy").ptr()) != 0;
    if (!has_numpy && !py::hasattr(value, "__dlpack__"))
        return given;
    try {
        return has_numpy ? py::object(given.attr("numpy")())
                         : py::object(py::module_::import("numpy").attr("from_dlpack")(given));
    } catch (const py::error_already_set&) {
        throw_wrong_type(parameter, std::string(expected) + " in the memory of the CPU", value);
    }
}

/// Bytes of booleans other than 0 count as 1, as for NumPy.
inline pybind11::array with_plain_booleans(pybind11::array array)
{
    if (array.dtype().kind() != 'b' || array.size() == 0)
        return array;
    const pybind11::object bytes = array.attr("view")("u1");
    return bytes.attr("max")().cast<int>() > 1 ? pybind11::array(bytes.attr("astype")("bool")) : array;
}

/// numpy.asarray(value), without reading a tensor item by item. The dtype must be one of the given kinds: b boolean, i
/// and u integer, f floating point.
inline pybind11::array as_array(const pybind11::handle& value, const char* parameter, std::string_view kinds = "biuf",
                                const char* expected = "an array of real numbers")
{
    namespace py = pybind11;
    refuse_masked(value, parameter);
    const py::object given = as_host_array(value, parameter, expected);
    auto array = stay_at_exit([&] { return py::array::ensure(given); });
    if (!array)
        PyErr_Clear();
    if (!array || kinds.find(array.dtype().kind()) == std::string_view::npos)
        throw_wrong_type(parameter, expected, array && array.ndim() > 0 && array.dtype().kind() != 'O' ? array : given);
    return with_plain_booleans(std::move(array));
}

/// An array of shape (..., columns), such as rays (..., 6) or points (..., 3), whose numbers are read as float64.
/// C-contiguous float32 and float64 arrays are read in place; others are copied.
class RowArray {
    static constexpr int aligned_doubles =
        pybind11::array::c_style | pybind11::array::forcecast | pybind11::detail::npy_api::NPY_ARRAY_ALIGNED_;

public:
    RowArray(const pybind11::handle& value, const char* parameter, pybind11::ssize_t columns)
        : array_(as_array(value, parameter, "iuf")), columns_(static_cast<std::size_t>(columns))
    {
        namespace py = pybind11;
        if (array_.ndim() < 1 || array_.shape(array_.ndim() - 1) != columns)
            throw_invalid(parameter, "shape (..., " + std::to_string(columns) + ")", to_text(shape_of(array_)));
        count_ = static_cast<std::size_t>(array_.size() / columns);
        single_precision_ = array_.dtype().kind() == 'f' && array_.dtype().itemsize() == sizeof(float);
        if (py::isinstance<py::array_t<float, py::array::c_style>>(array_) && is_aligned<float>()) {
            floats_ = static_cast<const float*>(array_.data());
            return;
        }
        if (!py::isinstance<py::array_t<double, py::array::c_style>>(array_) || !is_aligned<double>())
            array_ = stay_at_exit([&] { return py::array_t<double, aligned_doubles>(array_); });
        doubles_ = static_cast<const double*>(array_.data());
    }

    std::size_t count() const { return count_; }
    /// Whether the given numbers are float32.
    bool is_single_precision() const { return single_precision_; }
    /// The shape without its last axis: the shape of a result with one item a row.
    Shape leading_shape() const
    {
        Shape shape = shape_of(array_);
        shape.pop_back();
        return shape;
    }
    /// May be called without the GIL.
    double operator()(std::size_t row, std::size_t column) const
    {
        const std::size_t at = row * columns_ + column;
        // One of both is not null. NOLINTNEXTLINE(clang-analyzer-core.NullDereference)
        return floats_ != nullptr ? static_cast<double>(floats_[at]) : doubles_[at];
    }
    /// Calls `body` with the numbers of all rows, const float* or const double*.
    template <typename Body>
    void visit(const Body& body) const
    {
        if (floats_ != nullptr)
            body(floats_);
        else
            body(doubles_);
    }
    /// The three columns that begin at `column`.
    glm::dvec3 vector(std::size_t row, std::size_t column = 0) const
    {
        return {(*this)(row, column), (*this)(row, column + 1), (*this)(row, column + 2)};
    }

private:
    template <typename Number>
    bool is_aligned() const
    {
        return reinterpret_cast<std::uintptr_t>(array_.data()) % alignof(Number) == 0;
    }

    pybind11::array array_;
    std::size_t columns_;
    std::size_t count_ = 0;
    bool single_precision_ = false;
    const float* floats_ = nullptr;
    const double* doubles_ = nullptr;
};

/// An array of float64 of exactly this shape, in C order.
inline pybind11::array_t<double, pybind11::array::c_style> as_doubles(const pybind11::handle& value,
                                                                      const char* parameter, const Shape& shape)
{
    namespace py = pybind11;
    const auto array = as_array(value, parameter, "iuf", ("numbers of shape " + to_text(shape)).c_str());
    if (shape_of(array) != shape)
        throw_invalid(parameter, "shape " + to_text(shape), to_text(shape_of(array)));
    return py::array_t<double, py::array::c_style | py::array::forcecast>(array);
}

inline glm::dvec3 as_vector(const pybind11::handle& value, const char* parameter)
{
    const auto numbers = as_doubles(value, parameter, {3});
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

/// A matrix as NumPy indexes it, [row, column].
inline glm::dmat3 as_matrix3(const pybind11::handle& value, const char* parameter)
{
    const auto numbers = as_doubles(value, parameter, {3, 3});
    glm::dmat3 matrix;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            matrix[column][row] = numbers.at(row, column);
    return matrix;
}

inline glm::dmat4 as_matrix4(const pybind11::handle& value, const char* parameter)
{
    const auto numbers = as_doubles(value, parameter, {4, 4});
    glm::dmat4 matrix;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            matrix[column][row] = numbers.at(row, column);
    return matrix;
}

/// (2, 3): lower and upper corner.
inline pybind11::array_t<double> to_array(const Box& box)
{
    pybind11::array_t<double> array(Shape{2, 3});
    for (int axis = 0; axis < 3; ++axis) {
        array.mutable_at(0, axis) = box.lower[axis];
        array.mutable_at(1, axis) = box.upper[axis];
    }
    return array;
}

/// A new array of shape (leading..., trailing...).
template <typename Number>
pybind11::array_t<Number> new_array(Shape leading, const Shape& trailing = {})
{
    leading.insert(leading.end(), trailing.begin(), trailing.end());
    return pybind11::array_t<Number>(leading);
}

/// The same array, made read-only for Python.
template <typename Array>
Array read_only(Array array)
{
    array.attr("flags").attr("writeable") = false;
    return array;
}

/// A volume's shape (x, y, z) in the axis order of the user's array.
inline Shape array_shape(const glm::ivec3& shape, Axes axes)
{
    if (axes == Axes::xyz)
        return {shape.x, shape.y, shape.z};
    return {shape.z, shape.y, shape.x};
}

/// Bytes between neighbours along x, y and z of a three-dimensional array.
inline std::array<std::ptrdiff_t, 3> grid_strides(const pybind11::array& array, Axes axes)
{
    if (axes == Axes::xyz)
        return {array.strides(0), array.strides(1), array.strides(2)};
    return {array.strides(2), array.strides(1), array.strides(0)};
}

/// A new array over a grid. It is indexed in the axis order of the user's array, and x varies fastest in memory: item
/// (x, y, z) is at x + shape.x * (y + shape.y * z) of its data.
template <typename Number>
pybind11::array_t<Number> new_grid(const glm::ivec3& shape, Axes axes)
{
    namespace py = pybind11;
    if (axes == Axes::xyz)
        return py::array_t<Number, py::array::f_style>(array_shape(shape, axes));
    return py::array_t<Number, py::array::c_style>(array_shape(shape, axes));
}

/// The Python names of an enumeration's values.
template <typename Enum>
using EnumWords = std::vector<std::pair<const char*, Enum>>;

/// A name and its value.
template <typename Value>
struct Named {
    const char* name;
    Value value;
};

/// The names in quotes, with commas between them.
template <typename Value, std::size_t Count>
std::string list_of(const Named<Value> (&known)[Count])
{
    std::string list;
    for (const auto& each : known)
        list += (list.empty() ? "\"" : ", \"") + std::string(each.name) + "\"";
    return list;
}

/// A struct of flags in which the flags named by a sequence are set.
template <typename Flags, std::size_t Count>
Flags as_flags(const Named<bool Flags::*> (&known)[Count], const pybind11::handle& value, const char* parameter)
{
    namespace py = pybind11;
    const auto is_name = [](const py::handle& each) { return py::isinstance<py::str>(each); };
    if (is_name(value) || !py::isinstance<py::iterable>(value))
        throw_wrong_type(parameter, std::string("a sequence of names, such as (\"") + known[0].name + "\",)", value);
    Flags flags;
    for (const py::handle& each : py::reinterpret_borrow<py::iterable>(value)) {
        if (!is_name(each))
            throw_wrong_type(parameter, "names", each);
        const auto name = each.cast<std::string>();
        const auto* const found = std::find_if(std::begin(known), std::end(known),
                                               [&](const auto& candidate) { return candidate.name == name; });
        if (found == std::end(known))
            throw_invalid(parameter, "names among " + list_of(known), "\"" + name + "\"");
        flags.*(found->value) = true;
    }
    return flags;
}

/// Whether a dtype is float32; the alternative is float64.
inline bool is_single_precision(const pybind11::handle& value, const char* parameter)
{
    namespace py = pybind11;
    py::dtype dtype;
    try {
        dtype = py::dtype::from_args(py::reinterpret_borrow<py::object>(value));
    } catch (const py::error_already_set&) {
        throw_wrong_type(parameter, "float32 or float64", value);
    }
    const bool single_precision = dtype.is(py::dtype::of<float>());
    if ((!single_precision && !dtype.is(py::dtype::of<double>())))
        throw_invalid(parameter, "float32 or float64", std::string(py::str(dtype)));
    return single_precision;
}

/// The value of a name.
template <typename Enum>
Enum as_enum(const EnumWords<Enum>& words, const std::string& word, const char* parameter)
{
    std::string expected;
    for (const auto& [name, value] : words) {
        if (word == name)
            return value;
        expected += (expected.empty() ? "\"" : " or \"") + std::string(name) + "\"";
    }
    throw_invalid(parameter, expected, "\"" + word + "\"");
}

/// The name of a value.
template <typename Enum>
const char* to_word(const EnumWords<Enum>& words, Enum value)
{
    for (const auto& [name, named] : words)
        if (named == value)
            return name;
    return "";
}

} // namespace isospline
