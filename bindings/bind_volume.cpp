#include "bind.h"

#include "arrays.h"
#include "handed.h"
#include "long_call.h"
#include "points.h"
#include "samples.h"
#include "visiting_order.h"

#include "isospline/spline/sample.h"
#include "isospline/spline/volume.h"
#include "isospline/util/parallel.h"

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

/// `data[3, 2, 1]`, with the index in the axis order of the user's array.
std::string item_text(const glm::ivec3& index, Axes axes)
{
    std::string text = to_text(array_shape(index, axes));
    text.front() = '[';
    text.back() = ']';
    return "data" + text;
}

std::shared_ptr<Volume> make_volume(const py::object& data, const py::object& spacing, const py::object& origin,
                                    const py::object& direction, int degree, const std::string& boundary,
                                    const std::string& filter, double smoothing, const std::string& axes,
                                    const std::string& unit, bool patient, const py::object& progress)
{
    VolumeOptions options;
    if (const py::array edges = as_array(spacing, "spacing", "iuf", "one number or three"); edges.ndim() == 0)
        options.spacing = glm::dvec3(edges.cast<double>());
    else
        options.spacing = as_vector(edges, "spacing");
    options.origin = as_vector(origin, "origin");
    if (!direction.is_none())
        options.direction = as_matrix3(direction, "direction");
    options.degree = degree;
    options.boundary = as_enum(boundary_words, boundary, "boundary");
    options.filter = as_enum(filter_words, filter, "filter");
    options.smoothing = smoothing;
    options.axes = as_enum(axes_words, axes, "axes");
    options.unit = unit;
    options.patient = patient;

    handed("refuse_images")(data);
    py::array array = as_array(data, "data", "biuf", "a three-dimensional array of real numbers");
    if (array.ndim() != 3)
        throw_invalid("data", "three dimensions",
                      "shape " + to_text(shape_of(array)) +
                          (array.ndim() == 4 ? "; did you mean a volume for each time, Volume(series[0])?" : ""));
    if (array.size() == 0)
        throw_invalid("data", "at least one sample along each axis", "shape " + to_text(shape_of(array)));
    if (array.dtype().kind() == 'f' && array.dtype().itemsize() > 8)
        array = array.attr("astype")(py::dtype::of<double>());
    const SampleView samples = sample_view(array, options.axes);

    std::shared_ptr<Volume> volume;
    try {
        long_call("to make a volume of " + to_text(shape_of(array)) + " samples", progress,
                  [&](const Progress& report) { volume = std::make_shared<Volume>(samples, options, report); });
    } catch (const NonFiniteSample& error) {
        throw_invalid("data", "finite numbers",
                      std::to_string(error.value) + " at " + item_text(error.index, options.axes));
    }
    return volume;
}

py::array sample(const Volume& volume, const py::object& points, int derivative, const py::object& progress)
{
    if (derivative < 0 || derivative > 2)
        throw_invalid("derivative", "0, 1 or 2", derivative);
    const RowArray rows(points, "points", 3);
    const Shape trailing(static_cast<std::size_t>(derivative), 3);
    auto result = new_array<double>(rows.leading_shape(), trailing);
    double* const to = result.mutable_data();

    long_call("to sample " + std::to_string(rows.count()) + " points", progress, [&](const Progress& report) {
        constexpr std::size_t grain = 4096;
        const VisitingOrder order(volume, rows);
        const auto body = [&](std::size_t begin, std::size_t end) {
            for (std::size_t time = begin; time < end; ++time) {
                const std::size_t row = order[time];
                const glm::dvec3 position_world = rows.vector(row);
                if (derivative == 0) {
                    to[row] = value_at(volume, position_world);
                } else if (derivative == 1) {
                    const glm::dvec3 gradient = gradient_at(volume, position_world);
                    std::copy_n(&gradient[0], 3, to + 3 * row);
                } else {
                    const glm::dmat3 hessian = hessian_at(volume, position_world);
                    std::copy_n(&hessian[0][0], 9, to + 9 * row);
                }
            }
        };
        parallel_for(rows.count(), grain, body, report);
    });
    return result;
}

py::array coefficients(const Volume& volume)
{
    const glm::ivec3 shape = volume.shape();
    const double offset = volume.offset();
    auto result = new_grid<double>(shape, volume.options().axes);
    double* const to = result.mutable_data();
    const auto copy = [&](std::size_t begin, std::size_t end) {
        std::vector<float> row(static_cast<std::size_t>(shape.x));
        for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
            for (int y = 0; y < shape.y; ++y) {
                volume.copy({0, y, z}, {shape.x, 1, 1}, row.data(), 0, 0);
                double* const to_row = to + shape.x * (y + static_cast<std::ptrdiff_t>(shape.y) * z);
                for (int x = 0; x < shape.x; ++x)
                    to_row[x] = static_cast<double>(row[static_cast<std::size_t>(x)]) + offset;
            }
    };
    long_call("to copy the coefficients", py::none(),
              [&](const Progress& report) { parallel_for(static_cast<std::size_t>(shape.z), 1, copy, report); });
    return result;
}

/// The coefficients as they are stored, minus the volume's offset, [z, y, x].
py::array stored_coefficients(const Volume& volume)
{
    const glm::ivec3 shape = volume.shape();
    auto result = new_grid<float>(shape, Axes::zyx);
    const auto row = static_cast<std::ptrdiff_t>(shape.x);
    volume.copy(glm::ivec3(0), shape, result.mutable_data(), row, row * shape.y);
    return result;
}

/// Python may make several objects of one volume, one after the other. Called with the GIL.
std::uint64_t identity_of(const std::shared_ptr<Volume>& volume)
{
    struct Known {
        std::weak_ptr<const Volume> volume;
        std::uint64_t number;
    };
    static std::map<const Volume*, Known> known;
    static std::uint64_t count = 0;
    std::erase_if(known, [](const auto& each) { return each.second.volume.expired(); });
    const auto [found, is_new] = known.try_emplace(volume.get(), Known{volume, count});
    count += is_new;
    return found->second.number;
}

std::string describe(const Volume& volume)
{
    const auto& options = volume.options();
    std::ostringstream text;
    text << "Volume(shape=" << to_text(array_shape(volume.shape(), options.axes)) << ", axes=\""
         << to_word(axes_words, options.axes) << "\", spacing=(" << options.spacing.x << ", " << options.spacing.y
         << ", " << options.spacing.z << "), degree=" << options.degree << ", boundary=\""
         << to_word(boundary_words, options.boundary) << "\", filter=\"" << to_word(filter_words, options.filter)
         << "\")";
    return text.str();
}

} // namespace

void bind_volume(py::module_& module)
{
    py::register_local_exception_translator([](std::exception_ptr raised) {
        try {
            if (raised)
                std::rethrow_exception(std::move(raised));
        } catch (const std::length_error& error) {
            PyErr_SetString(PyExc_MemoryError, error.what());
        }
    });

    module.def(
        "_as_array",
        [](const py::object& value, const std::string& parameter) { return as_array(value, parameter.c_str()); },
        py::arg("value"), py::arg("parameter"));
    py::class_<Volume, std::shared_ptr<Volume>>(module, "Volume")
        .def(py::init(&make_volume))
        .def("sample", &sample)
        .def_property_readonly("coefficients", &coefficients)
        .def_property_readonly("shape",
                               [](const Volume& volume) {
                                   return py::tuple(py::cast(array_shape(volume.shape(), volume.options().axes)));
                               })
        .def_property_readonly("affine", &Volume::index_to_world)
        .def_property_readonly("bounds", [](const Volume& volume) { return to_array(volume.bounds()); })
        .def_property_readonly("spacing", [](const Volume& volume) { return volume.options().spacing; })
        .def_property_readonly("origin", [](const Volume& volume) { return volume.options().origin; })
        .def_property_readonly("direction", [](const Volume& volume) { return volume.options().direction; })
        .def_property_readonly("degree", &Volume::degree)
        .def_property_readonly("boundary",
                               [](const Volume& volume) { return to_word(boundary_words, volume.boundary()); })
        .def_property_readonly("filter", [](const Volume& volume) { return to_word(filter_words, volume.filter()); })
        .def_property_readonly("smoothing", [](const Volume& volume) { return volume.options().smoothing; })
        .def_property_readonly("axes", [](const Volume& volume) { return to_word(axes_words, volume.options().axes); })
        .def_property_readonly("unit", [](const Volume& volume) { return volume.options().unit; })
        .def_property_readonly("patient", [](const Volume& volume) { return volume.options().patient; })
        .def_property_readonly("minimum", &Volume::minimum)
        .def_property_readonly("maximum", &Volume::maximum)
        .def_property_readonly("_identity", &identity_of)
        .def_property_readonly("_offset", &Volume::offset)
        .def_property_readonly("_stored_coefficients", &stored_coefficients)
        .def_property_readonly("memory", &Volume::memory)
        .def("__repr__", [](const Volume& volume) { return describe(volume); });
}

} // namespace isospline
