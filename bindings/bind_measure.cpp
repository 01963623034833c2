#include "arrays.h"
#include "bind.h"
#include "long_call.h"
#include "results.h"

#include "isospline/math/affine.h"
#include "isospline/math/box.h"
#include "isospline/math/clipped_box.h"
#include "isospline/measure/component_measures.h"
#include "isospline/measure/integrals.h"
#include "isospline/measure/measure_gradient.h"
#include "isospline/query/solid.h"
#include "isospline/util/error.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

/// `order` and `tolerance` are None if they are not given.
IntegralOptions options_of(std::optional<double> tolerance, std::optional<int> order)
{
    if (tolerance && order)
        throw_invalid("order", "None with a tolerance, which chooses it", *order);
    IntegralOptions options;
    options.tolerance = tolerance.value_or(options.tolerance);
    if (order && (*order < 2 || *order > 10))
        throw_invalid("order", "2 to 10", *order);
    options.order = order.value_or(0);
    return options;
}

/// The box, in world space, of the part of a box of cells that the clip of a surface keeps.
Box world_box_within(const Box& box_lattice, const IsosurfaceSnapshot& surface)
{
    Box box;
    for (const glm::dvec3& corner : corners_within(box_lattice, surface.clip_lattice()))
        box.extend(transform_point(surface.volume().lattice_to_world(), corner));
    return box;
}

py::object components(const Isosurface& surface, bool measured, std::optional<double> tolerance,
                      std::optional<int> order, const py::object& progress)
{
    const IntegralOptions options = options_of(tolerance, order);
    const auto snapshot = surface.snapshot();
    std::vector<MeasuredComponent> found;
    long_call(measured ? "to measure components" : "to find components", progress, [&](const Progress& report) {
        const Solid solid = solid_of(*snapshot);
        found = measured ? measure_components(solid, options, report) : count_components(solid, report);
    });
    const auto count = static_cast<py::ssize_t>(found.size());
    py::dict result;
    const auto add_integrals = [&](const char* name, Quantity quantity, auto Integrals::*member) {
        auto array = new_array<double>(Shape{count});
        for (std::size_t i = 0; i < found.size(); ++i)
            array.mutable_data()[i] = (found[i].integrals.*member)[static_cast<std::size_t>(quantity)];
        result[name] = array;
    };
    if (measured) {
        add_integrals("enclosed_volumes", Quantity::volume, &Integrals::value);
        add_integrals("volume_errors", Quantity::volume, &Integrals::error);
        add_integrals("areas", Quantity::area, &Integrals::value);
        add_integrals("area_errors", Quantity::area, &Integrals::error);
    }
    auto bounds = new_array<double>(Shape{count, 2, 3});
    auto cell_counts = new_array<std::int64_t>(Shape{count}), inside_counts = new_array<std::int64_t>(Shape{count});
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Box box = world_box_within(found[i].count.box_lattice, *snapshot);
        std::copy_n(&box.lower[0], 3, bounds.mutable_data() + 6 * i);
        std::copy_n(&box.upper[0], 3, bounds.mutable_data() + 6 * i + 3);
        cell_counts.mutable_data()[i] = static_cast<std::int64_t>(found[i].count.cells);
        inside_counts.mutable_data()[i] = static_cast<std::int64_t>(found[i].count.inside);
    }
    result["bounds"] = bounds;
    result["cell_counts"] = cell_counts;
    result["inside_counts"] = inside_counts;
    return as_result("Components", result);
}

Integrals integrate(const Isosurface& surface, const IntegralOptions& options, const py::object& progress)
{
    const auto snapshot = surface.snapshot();
    Integrals found;
    long_call("to integrate over a surface", progress,
              [&](const Progress& report) { found = integrate(solid_of(*snapshot), options, report); });
    return found;
}

/// The value and the error of a quantity, with names.
void set_measured(py::dict& to, const Integrals& found, Quantity quantity, const char* value, const char* error)
{
    to[value] = found.value[static_cast<std::size_t>(quantity)];
    to[error] = found.error[static_cast<std::size_t>(quantity)];
}

py::object measure(const Isosurface& surface, Quantity quantity, std::optional<double> tolerance,
                   std::optional<int> order, const py::object& progress)
{
    IntegralOptions options = options_of(tolerance, order);
    options.wanted = {};
    options.wanted[static_cast<std::size_t>(quantity)] = true;
    py::dict measured;
    set_measured(measured, integrate(surface, options, progress), quantity, "value", "error");
    return as_result("measurement_of", measured);
}

/// A row of the table of isospline.measure.
py::dict volume_and_area(const Isosurface& surface, std::optional<double> tolerance, std::optional<int> order,
                         const py::object& progress)
{
    const Integrals found = integrate(surface, options_of(tolerance, order), progress);
    py::dict row;
    set_measured(row, found, Quantity::volume, "enclosed_volumes", "volume_errors");
    set_measured(row, found, Quantity::area, "areas", "area_errors");
    return row;
}

/// (the derivative by the level, those by the coefficients as the volume's data are, or None)
py::tuple gradient_of_measures(const Isosurface& surface, double by_volume, double by_area, int order,
                               bool coefficients, const py::object& progress)
{
    const auto snapshot = surface.snapshot();
    MeasureGradient found;
    long_call("to differentiate measures", progress, [&](const Progress& report) {
        found = measure_gradient(solid_of(*snapshot), {by_volume, by_area}, order, coefficients, report);
    });
    if (!coefficients)
        return py::make_tuple(found.by_level, py::none());
    auto by_coefficients = new_grid<double>(snapshot->volume().shape(), snapshot->volume().options().axes);
    std::copy(found.by_coefficients.begin(), found.by_coefficients.end(), by_coefficients.mutable_data());
    return py::make_tuple(found.by_level, by_coefficients);
}

} // namespace

void bind_measure(py::module_& module)
{
    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    const auto bind_integral = [&](const char* name, Quantity quantity) {
        surface.def(name, [quantity](const Isosurface& self, std::optional<double> tolerance, std::optional<int> order,
                                     const py::object& progress) {
            return measure(self, quantity, tolerance, order, progress);
        });
    };
    bind_integral("enclosed_volume", Quantity::volume);
    bind_integral("area", Quantity::area);
    bind_integral("mean_curvature", Quantity::mean_curvature);
    bind_integral("gaussian_curvature", Quantity::gaussian_curvature);
    surface.def("components", &components);
    surface.def("_volume_and_area", &volume_and_area, py::arg("tolerance"), py::arg("order"), py::arg("progress"));
    surface.def("_measure_gradient", &gradient_of_measures, py::arg("by_volume"), py::arg("by_area"), py::arg("order"),
                py::arg("coefficients"), py::arg("progress"));
}

} // namespace isospline
