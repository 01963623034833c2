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
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* volume_doc = R"(A continuous model of a regular volume of samples.

.. math:: f(\mathbf{x}) = \sum_{\mathbf{k}} c_{\mathbf{k}} \, \beta^n(\mathbf{x} - \mathbf{k})

A recursive filter along each axis computes the coefficients c from the samples [1]_ [2]_. They are stored as
float32. Samples sit at the voxels' centres; a position in the world is origin + direction @ (spacing * index), with
index = (x, y, z).

Parameters
----------
data : (nz, ny, nx) array, or (nx, ny, nz) for axes="xyz"
    Finite samples of any boolean, integer or floating type, memory order and byte order. They are read in place; long
    double is converted to float64 first.
spacing : float or (3,) array_like, world units
    Distance between samples along x, y and z; one number for all three.
origin : (3,) array_like, world units
    Position of sample (0, 0, 0).
direction : (3, 3) array_like, optional
    Its columns are the directions of the axes x, y and z in the world, as in ITK and VTK; linearly independent. By
    default, they are those of the world.
degree : int
    Degree n of the B-spline, 0 to 5. Isosurfaces need 1, 2 or 3.
boundary : {"mirror", "periodic"}
    How the samples continue outside of the volume, for the filter and for the model: symmetrically about the first and
    the last sample, or periodically (scipy.ndimage's "mirror" and "grid-wrap").
filter : {"interpolate", "none", "smoothing"}
    "interpolate": the model passes through the samples. "none": the samples are used as coefficients, which smooths
    the model. "smoothing": along each axis, the spline of degree n that minimises

    .. math:: \sum_k (f(k) - s(k))^2 + \lambda \int \left(\frac{d^m s}{dx^m}\right)^2 dx,
              \quad m = \lfloor n/2 \rfloor + 1

    with :math:`\lambda` = `smoothing` and x in samples. For degree 0, the roughness is the sum of the squared
    differences of neighbours.
smoothing : float
    Weight of the roughness, 0 to 1e9; 0 unless filter="smoothing".
axes : {"zyx", "xyz"}
    Order of the axes of `data`: "zyx" as in NumPy arrays from ITK, VTK, tifffile and zarr, "xyz" as in arrays from
    nibabel. Points, directions and spacing are always (x, y, z).
unit : str
    Unit of world coordinates, such as "mm", for scale bars and tables.
patient : bool
    Whether the world is a patient's: x, y and z run to the left, to the back and to the head (LPS).
progress : callable, optional
    Called with the finished fraction; cancels if it returns a false value other than None.

Raises
------
TypeError
    For samples that are complex, objects or text.
ValueError
    For samples that are not three-dimensional, empty, or not finite (the message names the first index), and for any
    other parameter out of range.
MemoryError
    Raised at the beginning if the coefficients would not fit into memory.

References
----------
.. [1] P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001.
.. [2] M. Unser, A. Aldroubi, M. Eden, "B-spline signal processing: Parts I and II", IEEE Transactions on Signal
   Processing 41(2), 1993.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> z, y, x = np.mgrid[0:8, 0:9, 0:10].astype(np.float32)
>>> volume = isospline.Volume(x + 10 * y, spacing=(0.5, 1, 1))
>>> volume.shape
(8, 9, 10)
>>> volume.sample([[2.0, 3.0, 4.0]]).round(3)
array([34.])
>>> volume.sample([[2.0, 3.0, 4.0]], derivative=1).shape
(1, 3)
)";

constexpr const char* sample_doc = R"(The model, or its derivatives, at points.

Outside of the volume the model continues by its boundary rule. Points that are not finite give NaN.

Parameters
----------
points : (..., 3) float array, world units
    Positions x, y, z.
derivative : {0, 1, 2}
    0 for values, 1 for gradients, 2 for Hessians, by world coordinates. For degree 0 all derivatives are zero; for
    degree 1, second derivatives along one axis of the volume are zero.

Returns
-------
(...), (..., 3) or (..., 3, 3) float64 array
    In values, values per world unit, or values per world unit squared.

Raises
------
ValueError
    For points of another shape, and another `derivative`.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> volume = isospline.Volume(np.eye(4)[:, :, None] * np.ones(5))
>>> float(volume.sample([[2, 1, 1]])[0].round(6))
1.0
)";

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

py::array sample(const Volume& volume, const py::object& points, int derivative)
{
    if (derivative < 0 || derivative > 2)
        throw_invalid("derivative", "0, 1 or 2", derivative);
    const RowArray rows(points, "points", 3);
    const Shape trailing(static_cast<std::size_t>(derivative), 3);
    auto result = new_array<double>(rows.leading_shape(), trailing);
    double* const to = result.mutable_data();

    long_call("to sample " + std::to_string(rows.count()) + " points", py::none(), [&](const Progress& report) {
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

std::string representation(const Volume& volume)
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
    py::class_<Volume, std::shared_ptr<Volume>>(module, "Volume", volume_doc)
        .def(py::init(&make_volume), py::arg("data"), py::kw_only(), py::arg("spacing") = py::make_tuple(1.0, 1.0, 1.0),
             py::arg("origin") = py::make_tuple(0.0, 0.0, 0.0), py::arg("direction") = py::none(),
             py::arg("degree") = 2, py::arg("boundary") = "mirror", py::arg("filter") = "interpolate",
             py::arg("smoothing") = 0.0, py::arg("axes") = "zyx", py::arg("unit") = "", py::arg("patient") = false,
             py::arg("progress") = py::none())
        .def("sample", &sample, py::arg("points"), py::kw_only(), py::arg("derivative") = 0, sample_doc)
        .def_property_readonly(
            "coefficients", &coefficients,
            "float64 array of the data's shape: exactly the coefficients of the model, in a new array. The volume "
            "stores them in float32, minus the middle of the data's range.")
        .def_property_readonly(
            "shape",
            [](const Volume& volume) {
                return py::tuple(py::cast(array_shape(volume.shape(), volume.options().axes)));
            },
            "Shape of the data, in the order of its axes.")
        .def_property_readonly("affine", &Volume::index_to_world, "(4, 4) float64 array: index (x, y, z, 1) to world.")
        .def_property_readonly(
            "bounds", [](const Volume& volume) { return to_array(volume.bounds()); },
            "(2, 3) float64 array: lower and upper corner of the model's box in the world. It ends at the faces of\n"
            "the outer voxels for even degrees, at their centres for odd ones.")
        .def_property_readonly(
            "spacing", [](const Volume& volume) { return volume.options().spacing; },
            "(3,) float64 array: world units between samples along x, y and z.")
        .def_property_readonly(
            "origin", [](const Volume& volume) { return volume.options().origin; },
            "(3,) float64 array: world position of sample (0, 0, 0).")
        .def_property_readonly(
            "direction", [](const Volume& volume) { return volume.options().direction; },
            "(3, 3) float64 array: its columns are the directions of the axes x, y and z.")
        .def_property_readonly("degree", &Volume::degree, "Degree of the B-spline.")
        .def_property_readonly(
            "boundary", [](const Volume& volume) { return to_word(boundary_words, volume.boundary()); },
            "How the samples continue outside of the volume: \"mirror\" or \"periodic\".")
        .def_property_readonly(
            "filter", [](const Volume& volume) { return to_word(filter_words, volume.filter()); },
            "How the coefficients were computed from the samples: \"interpolate\", \"none\" or \"smoothing\".")
        .def_property_readonly(
            "smoothing", [](const Volume& volume) { return volume.options().smoothing; }, "Weight of the roughness.")
        .def_property_readonly(
            "axes", [](const Volume& volume) { return to_word(axes_words, volume.options().axes); },
            "Order of the data's axes: \"zyx\" or \"xyz\".")
        .def_property_readonly(
            "unit", [](const Volume& volume) { return volume.options().unit; },
            "Unit of world coordinates, such as \"mm\"; empty if it is not known.")
        .def_property_readonly(
            "patient", [](const Volume& volume) { return volume.options().patient; },
            "Whether the world is a patient's: x, y and z run to the left, to the back and to the head (LPS).")
        .def_property_readonly("minimum", &Volume::minimum, "Smallest sample.")
        .def_property_readonly("maximum", &Volume::maximum, "Largest sample.")
        .def_property_readonly("_identity", &identity_of, "A number that no other volume of the process has had.")
        .def_property_readonly("_offset", &Volume::offset, "What is added to the stored coefficients.")
        .def_property_readonly("_stored_coefficients", &stored_coefficients,
                               "The float32 coefficients minus the offset, of shape (nz, ny, nx), in a new array.")
        .def_property_readonly("memory", &Volume::memory, "Bytes held by this object.")
        .def("__repr__", &representation);
}

} // namespace isospline
