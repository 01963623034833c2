// Errors for arguments of a wrong type; isospline/mistakes.py puts the values into words.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>

namespace isospline {

/// `parameter: expected ..., got ...`, and what was likely meant.
[[noreturn]] inline void throw_wrong_type(const char* parameter, const std::string& expected,
                                          const pybind11::handle& value)
{
    namespace py = pybind11;
    const py::object sentence = py::module_::import("isospline.mistakes").attr("sentence")(parameter, expected, value);
    throw py::type_error(sentence.cast<std::string>());
}

/// What a parameter holds, an object of a class of ours. None is none, whatever pybind11 makes of it for pointers.
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
