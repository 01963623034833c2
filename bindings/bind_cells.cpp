// The cells of a volume, their primitive ids, and their coefficients.
#include "bind.h"

#include "arrays.h"
#include "long_call.h"
#include "points.h"

#include "isospline/math/affine.h"
#include "isospline/spline/coefficient_weights.h"
#include "isospline/spline/volume.h"
#include "isospline/util/parallel.h"

#include <glm/common.hpp>
#include <glm/ext/vector_int3_sized.hpp>
#include <glm/vector_relational.hpp>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

template <typename Number>
py::array_t<Number, py::array::c_style | py::array::forcecast> as_integers(const py::object& value,
                                                                           const char* parameter)
{
    return as_array(value, parameter, "iu", "an array of integers");
}

py::array_t<std::int32_t> cell_at(const Volume& volume, const py::object& primitive_ids)
{
    const auto ids = as_integers<std::uint64_t>(primitive_ids, "primitive_ids");
    auto result = new_array<std::int32_t>(shape_of(ids), {3});
    std::int32_t* to = result.mutable_data();
    const std::uint64_t* const end = ids.data() + ids.size();
    for (const std::uint64_t* id = ids.data(); id != end; ++id) {
        if (*id >= volume.cell_count())
            throw_invalid("primitive_ids", "ids of cells, below " + std::to_string(volume.cell_count()), *id);
        const glm::ivec3 cell = volume.cell_at(*id);
        for (int axis = 0; axis < 3; ++axis)
            *to++ = cell[axis];
    }
    return result;
}

py::array_t<std::uint64_t> primitive_id(const Volume& volume, const py::object& cells)
{
    const auto indices = as_integers<std::int64_t>(cells, "cells");
    Shape shape = shape_of(indices);
    if (shape.empty() || shape.back() != 3)
        throw_invalid("cells", "shape (..., 3)", to_text(shape));
    shape.pop_back();
    auto result = new_array<std::uint64_t>(shape);
    const glm::i64vec3 cell_shape(volume.cell_shape());
    const std::int64_t* from = indices.data();
    std::uint64_t* const begin = result.mutable_data();
    for (std::uint64_t* to = begin; to != begin + result.size(); ++to, from += 3) {
        const glm::i64vec3 cell(from[0], from[1], from[2]);
        if (glm::any(glm::lessThan(cell, glm::i64vec3(0))) || glm::any(glm::greaterThanEqual(cell, cell_shape)))
            throw_invalid("cells", "x, y, z below " + to_text(Shape{cell_shape.x, cell_shape.y, cell_shape.z}),
                          to_text(Shape{cell.x, cell.y, cell.z}));
        *to = volume.primitive_id(glm::ivec3(cell));
    }
    return result;
}

py::tuple coefficient_weights(const Volume& volume, const py::object& points, const py::object& progress)
{
    const RowArray positions(points, "points", 3);
    constexpr double farthest = 1e9; // cells are numbered by int
    const std::size_t count = coefficient_count(volume);
    const auto columns = static_cast<py::ssize_t>(count);
    auto indices = new_array<std::int64_t>(positions.leading_shape(), {columns});
    auto weights = new_array<double>(positions.leading_shape(), {columns});
    auto gradients = new_array<double>(positions.leading_shape(), {columns, 3});
    std::int64_t* const to_index = indices.mutable_data();
    double *const to_weight = weights.mutable_data(), *const to_gradient = gradients.mutable_data();
    const auto set_weights = [&](std::size_t row, std::span<CoefficientWeight> found) {
        const glm::dvec3 index = transform_point(volume.world_to_index(), positions.vector(row));
        set_coefficient_weights(volume, glm::ivec3(glm::floor(index + volume.lattice_shift())), index,
                                volume.world_to_index(), found);
        for (std::size_t i = 0, next = row * count; i < count; ++i, ++next) {
            to_index[next] = found[i].place;
            to_weight[next] = found[i].weight;
            std::copy_n(&found[i].gradient[0], 3, to_gradient + 3 * next);
        }
    };
    long_call("to find the weights of " + std::to_string(positions.count()) + " points", progress,
              [&](const Progress& report) {
                  check_points(positions);
                  for (std::size_t row = 0; row < positions.count(); ++row) {
                      const glm::dvec3 index = transform_point(volume.world_to_index(), positions.vector(row));
                      if (!(std::max({std::abs(index.x), std::abs(index.y), std::abs(index.z)}) < farthest))
                          throw_invalid("points", "points within 1e9 voxels of the volume",
                                        to_text(positions.vector(row)) + " in point " + std::to_string(row));
                  }
                  parallel_for(
                      positions.count(), 256,
                      [&](std::size_t begin, std::size_t end) {
                          std::vector<CoefficientWeight> found(count);
                          for (std::size_t row = begin; row < end; ++row)
                              set_weights(row, found);
                      },
                      report);
              });
    return py::make_tuple(indices, weights, gradients);
}

} // namespace

void bind_cells(py::module_& module)
{
    py::class_<Volume, std::shared_ptr<Volume>> volume(module.attr("Volume"));
    volume.def("coefficient_weights", &coefficient_weights)
        .def("cell_at", &cell_at)
        .def("primitive_id", &primitive_id)
        .def_property_readonly("cell_count", &Volume::cell_count);
}

} // namespace isospline
