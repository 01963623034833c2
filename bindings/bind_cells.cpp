// The cells of a volume, and their primitive ids.
#include "bind.h"

#include "arrays.h"

#include "isospline/spline/volume.h"

#include <glm/ext/vector_int3_sized.hpp>
#include <glm/vector_relational.hpp>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* cell_at_doc = R"(The cells of primitive ids.

A cell is a unit cube in which the model is one polynomial: centred on the sample (x, y, z) for even degrees, from there
to (x + 1, y + 1, z + 1) for odd ones. Its primitive id is its place in the grid of all cells, x varying fastest:
``x + nx * (y + ny * z)``, with as many cells as samples along each axis for even degrees, and one fewer for odd ones.
It is the same for every level and every surface of the volume.

Parameters
----------
primitive_ids : (...) integer array
    Ids below `cell_count`, so neither misses nor caps.

Returns
-------
(..., 3) int32 array
    x, y and z of each cell.

Raises
------
ValueError
    For an id that does not belong to a cell, such as that of a cap or of a miss.
TypeError
    For ids that are not integers.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = field.volume(32)
>>> hits = isospline.Scene([isospline.Isosurface(volume, field.level)]).cast_rays([(0.1, -2, 0.2, 0, 1, 0)])
>>> volume.cell_at(hits["primitive_ids"])
array([[17,  5, 19]], dtype=int32)
)";

constexpr const char* primitive_id_doc = R"(The primitive ids of cells: the inverse of `cell_at`.

Parameters
----------
cells : (..., 3) integer array
    x, y and z of each cell, such as `Shell.cells`.

Returns
-------
(...) uint64 array

Raises
------
ValueError
    For a cell outside of the volume, and for another shape.
TypeError
    For indices that are not integers.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> volume = isospline.Volume(np.zeros((5, 6, 7)))
>>> volume.primitive_id([(6, 5, 4), (1, 2, 3)])
array([209, 141], dtype=uint64)
)";

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
            throw_invalid("cells", "x, y, z below " + to_text({cell_shape.x, cell_shape.y, cell_shape.z}),
                          to_text({cell.x, cell.y, cell.z}));
        *to = volume.primitive_id(glm::ivec3(cell));
    }
    return result;
}

} // namespace

void bind_cells(py::module_& module)
{
    py::class_<Volume, std::shared_ptr<Volume>> volume(module.attr("Volume"));
    volume.def("cell_at", &cell_at, py::arg("primitive_ids"), cell_at_doc)
        .def("primitive_id", &primitive_id, py::arg("cells"), primitive_id_doc)
        .def_property_readonly("cell_count", &Volume::cell_count,
                               "Number of cells. Primitive ids of cells are below it, those of caps are not.");
}

} // namespace isospline
