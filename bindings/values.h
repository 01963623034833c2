// Values: frozen dataclasses in Python, whose constructors have checked their parameters, and structs in C++.
#pragma once

#include "arrays.h"
#include "colors.h"
#include "handed.h"

#include "isospline/util/value_class.h"

#include <glm/vec3.hpp>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <tuple>
#include <utility>

namespace isospline {

/// Whether an object is an instance of the class of values with this name.
bool is_value(const pybind11::handle& object, const char* name);

/// A parameter of a value, exactly as it was given.
pybind11::object value_part(const pybind11::handle& value, const char* name);

inline void read(const pybind11::object& part, const char* name, glm::dvec3& member)
{
    member = as_vector(part, name);
}

inline void read(const pybind11::object& part, const char* name, Color& member)
{
    member = as_surface_color(part, name);
}

inline void read(const pybind11::object& part, const char* name, CapColor& member)
{
    member = as_cap_color(part, name);
}

template <typename Member>
void read(const pybind11::object& part, const char*, Member& member)
{
    member = part.cast<Member>();
}

inline pybind11::object written(const Color& member)
{
    return to_python(member);
}

inline pybind11::object written(const CapColor& member)
{
    return to_python(member);
}

template <typename Member>
pybind11::object written(const Member& member)
{
    return pybind11::cast(member);
}

/// The conversion of a struct with a ValueClass.
template <typename Struct>
struct ConversionByParameters {
    static constexpr const auto& name = ValueClass<Struct>::name;

    static Struct from_python(pybind11::handle value)
    {
        Struct result;
        for_each_parameter([&](const auto& parameter) {
            read(value_part(value, parameter.name), parameter.name, result.*parameter.member);
        });
        return result;
    }

    static pybind11::object to_python(const Struct& value)
    {
        pybind11::dict parameters;
        for_each_parameter(
            [&](const auto& parameter) { parameters[parameter.name] = written(value.*parameter.member); });
        return handed(name)(**parameters);
    }

private:
    template <typename Function>
    static void for_each_parameter(const Function& function)
    {
        std::apply([&](const auto&... parameter) { (function(parameter), ...); }, ValueClass<Struct>::parameters);
    }
};

/// How a struct and its class of values are converted. Specializations have the `name` of the class, and the functions
/// `from_python`, which takes an instance, and `to_python`.
template <typename Struct>
struct ValueConversion;

template <typename Struct>
requires requires
{
    ValueClass<Struct>::parameters;
}
struct ValueConversion<Struct> : ConversionByParameters<Struct> {};

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

namespace pybind11::detail {

template <typename Struct>
requires requires
{
    isospline::ValueConversion<Struct>::name;
}
class type_caster<Struct> : public isospline::ValueCaster<Struct> {};

} // namespace pybind11::detail
