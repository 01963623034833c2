// The smooth surfaces of labels, for isospline.labels.
#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/label/label_field.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

using LabelArray = py::array_t<std::int32_t, py::array::c_style>;

std::unique_ptr<LabelField> label_field(const LabelArray& labels, std::int32_t label, std::int32_t background,
                                        const py::object& deviations, const py::object& progress)
{
    const glm::ivec3 shape(labels.shape(2), labels.shape(1), labels.shape(0));
    const glm::dvec3 scale = as_vector(deviations, "deviations");
    std::unique_ptr<LabelField> field;
    long_call("to smooth a label", progress, [&](const Progress& report) {
        field = std::make_unique<LabelField>(LabelMap{labels.data(), shape}, label, background, scale, report);
    });
    return field;
}

double enclose(LabelField& field, double voxels)
{
    double error = 0.0;
    long_call("to smooth a label", py::none(), [&](const Progress& report) { error = field.enclose(voxels, report); });
    return error;
}

py::array_t<float> samples(const LabelField& field)
{
    auto array = new_grid<float>(field.shape(), Axes::zyx);
    const std::vector<float> numbers = field.samples();
    std::copy(numbers.begin(), numbers.end(), array.mutable_data());
    return array;
}

} // namespace

void bind_labels(py::module_& module)
{
    py::class_<LabelField>(module, "LabelField")
        .def(py::init(&label_field), py::arg("labels"), py::arg("label"), py::arg("background"), py::arg("deviations"),
             py::arg("progress") = py::none())
        .def_property_readonly("voxel_count", &LabelField::voxel_count)
        .def("enclose", &enclose, py::arg("voxels"))
        .def("samples", &samples);
}

} // namespace isospline
