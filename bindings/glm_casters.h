// Converts GLM's vectors and matrices to NumPy arrays when Python functions and attributes return them. arrays.h reads
// parameters, because a caster does not know their names, with which errors begin.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <pybind11/numpy.h>

#include <vector>

namespace pybind11::detail {

template <>
struct type_caster<glm::dvec3> {
    static constexpr auto name = const_name("numpy.ndarray");

    static handle cast(const glm::dvec3& vector, return_value_policy, handle)
    {
        return array_t<double>(3, &vector[0]).release();
    }
};

/// Indexed as [row, column], like NumPy arrays.
template <glm::length_t Size>
struct type_caster<glm::mat<Size, Size, double, glm::defaultp>> {
    static constexpr auto name = const_name("numpy.ndarray");

    static handle cast(const glm::mat<Size, Size, double, glm::defaultp>& matrix, return_value_policy, handle)
    {
        const auto rows = glm::transpose(matrix);
        return array_t<double>(std::vector<ssize_t>{Size, Size}, &rows[0][0]).release();
    }
};

} // namespace pybind11::detail
