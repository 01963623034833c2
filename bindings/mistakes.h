// Errors for arguments of a wrong type; isospline/mistakes.py describes the values.
#pragma once

#include "handed.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <string>

namespace isospline {

/// `parameter: expected ..., got ...`, with a suggestion of what was probably meant.
[[noreturn]] inline void throw_wrong_type(const char* parameter, const std::string& expected,
                                          const pybind11::handle& value)
{
    namespace py = pybind11;
    const py::object sentence = handed("sentence")(parameter, expected, value);
    throw py::type_error(sentence.cast<std::string>());
}

/// A parameter that must be an object of one of our classes. None is an error, although pybind11 accepts it for
/// pointers.
template <typename Object>
std::shared_ptr<Object> as_object(const pybind11::handle& value, const char* parameter)
{
    namespace py = pybind11;
    if (!py::isinstance<Object>(value)) {
        const std::string name = py::str(py::type::of<Object>().attr("__name__"));
        throw_wrong_type(parameter, (name.front() == 'I' ? "an " : "a ") + name, value);
    }
    return value.cast<std::shared_ptr<Object>>();
}

} // namespace isospline
