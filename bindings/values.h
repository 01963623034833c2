// Values: frozen dataclasses in Python, whose constructors have checked their parameters, and structs in C++.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <utility>

namespace isospline {

/// Whether an object is an instance of the class of values with this name.
bool is_value(const pybind11::handle& object, const char* name);

/// The class of values with this name.
pybind11::object value_class(const char* name);

/// How a struct and its class of values are converted. Its specializations have the `name` of the class, and the
/// functions `from_python`, which takes an instance, and `to_python`.
template <typename Struct>
struct ValueConversion;

/// A type_caster of pybind11 for a struct with a ValueConversion.
template <typename Struct>
class ValueCaster {
    using Conversion = ValueConversion<Struct>;

public:
    static constexpr auto name = pybind11::detail::const_name(Conversion::name);
    template <typename Wanted>
    using cast_op_type = pybind11::detail::movable_cast_op_type<Wanted>;

    bool load(pybind11::handle source, bool)
    {
        if (!is_value(source, Conversion::name))
            return false;
        value_ = Conversion::from_python(source);
        return true;
    }
    static pybind11::handle cast(const Struct& value, pybind11::return_value_policy, pybind11::handle)
    {
        return Conversion::to_python(value).release();
    }
    explicit operator Struct*() { return &*value_; }
    explicit operator Struct&() { return *value_; }
    explicit operator Struct&&() && { return std::move(*value_); }

private:
    std::optional<Struct> value_;
};

} // namespace isospline
