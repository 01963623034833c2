#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/measure/integrals.h"
#include "isospline/query/solid.h"

#include <cstddef>
#include <sstream>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* measurement_doc = R"(A measured number and an estimate of how far off it may be.

Numbers of Python and NumPy are made of it by ``float(measurement)``.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = isospline.Volume(field.samples(32), **field.grid(32))
>>> area = isospline.Isosurface(volume, field.level).area()
>>> round(area.value, 4), area.error < 0.001
(6.1575, True)
)";

constexpr const char* volume_doc = R"(The volume of the solid that the surface bounds, in world units cubed.

.. math:: V = \int_{f > f_0} \mathrm{d}^3 x

The solid is what `contains` tells: in the volume's domain, on the `inside` side of the level, and not cut away by
`mask` or `clip`, whether capped or not.

Parameters
----------
order : int
    Nodes of the Gauss-Legendre rules along each axis, 2 to 10.
progress : callable, optional
    Called with the finished fraction; cancels where it returns a false value other than None.

Returns
-------
Measurement
    Of the spline model. The error is the difference, in each cell, between rules of `order` and `order` - 1 nodes,
    added up, and a bound on what was too small to be resolved.

Raises
------
ValueError
    For an order out of that range.

Notes
-----
Quadrature on implicitly defined cells [1]_. Where the surface is smooth the error falls geometrically with `order`.
The model itself differs from sampled data of a smooth function by O(h^2) at degree 1 and O(h^4) at degrees 2 and 3, h
being the spacing.

References
----------
.. [1] R. I. Saye, "High-order quadrature methods for implicitly defined surfaces and volumes in hyperrectangles",
   SIAM Journal on Scientific Computing 37(2), 2015.

Examples
--------
>>> import math
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> volume = isospline.Volume(field.samples(32), **field.grid(32))
>>> ball = isospline.Isosurface(volume, field.level).enclosed_volume()
>>> bool(abs(ball.value / (4 / 3 * math.pi * 0.7**3) - 1) < 1e-5)
True
)";

constexpr const char* area_doc = R"(The area of the surface, in world units squared.

.. math:: A = \int_{f = f_0} \mathrm{d}A

Where the surface is capped the caps count. Where it ends, at the border of the volume or at a cut that is not capped,
there is nothing to count.

Parameters
----------
order, progress
    As of `enclosed_volume`.

Returns
-------
Measurement
    With an error as of `enclosed_volume`.

Examples
--------
>>> import math
>>> import isospline
>>> field = isospline.volumes.torus(0.6, 0.25)
>>> volume = isospline.Volume(field.samples(64), **field.grid(64), degree=3)
>>> torus = isospline.Isosurface(volume, field.level).area()
>>> bool(abs(torus.value / (4 * math.pi**2 * 0.6 * 0.25) - 1) < 1e-4)
True
)";

constexpr const char* mean_curvature_doc = R"(The integral of the mean curvature over the surface, in world units.

.. math:: M = \int_{f = f_0} \frac{k_1 + k_2}{2} \, \mathrm{d}A

It is :math:`4 \pi r` of a ball; the mean breadth of a convex solid is :math:`M / 2 \pi`. Caps are flat, and the edges
around them are not counted.

Parameters
----------
order, progress
    As of `enclosed_volume`.

Returns
-------
Measurement
    With an error as of `enclosed_volume`.

Raises
------
ValueError
    For a volume of degree 1, whose surfaces have creases.
)";

constexpr const char* gaussian_curvature_doc = R"(The integral of the Gaussian curvature over the surface.

.. math:: K = \int_{f = f_0} k_1 k_2 \, \mathrm{d}A

Of a closed surface it is :math:`2 \pi \chi`, with the Euler characteristic :math:`\chi`: 2 for each piece, less 2 for
each handle. Where the surface ends at a border or a cut, it is any number.

Parameters
----------
order, progress
    As of `enclosed_volume`.

Returns
-------
Measurement
    With an error as of `enclosed_volume`.

Raises
------
ValueError
    For a volume of degree 1, whose surfaces have creases.

Examples
--------
>>> import math
>>> import isospline
>>> field = isospline.volumes.torus(0.6, 0.25)
>>> volume = isospline.Volume(field.samples(48), **field.grid(48))
>>> torus = isospline.Isosurface(volume, field.level)
>>> round(torus.gaussian_curvature().value / (2 * math.pi), 6) + 0.0
0.0
)";

Measurement measure(const Isosurface& surface, Quantity quantity, int order, const py::object& progress)
{
    const auto snapshot = surface.snapshot();
    const bool is_curvature = quantity == Quantity::mean_curvature || quantity == Quantity::gaussian_curvature;
    const IntegralOptions options{order, quantity != Quantity::volume, is_curvature,
                                  quantity == Quantity::area && snapshot->options().capped};
    Integrals found;
    long_call("to integrate over a surface", progress,
              [&](const Progress& report) { found = integrate(solid_of(*snapshot), options, report); });
    const auto i = static_cast<std::size_t>(quantity);
    return {found.value[i], found.error[i]};
}

std::string representation(const Measurement& measurement)
{
    std::ostringstream text;
    text.precision(12);
    text << "Measurement(value=" << measurement.value;
    text.precision(3);
    text << ", error=" << measurement.error << ")";
    return text.str();
}

} // namespace

void bind_measure(py::module_& module)
{
    py::class_<Measurement>(module, "Measurement", measurement_doc)
        .def(py::init([](double value, double error) {
                 return Measurement{value, error};
             }),
             py::arg("value"), py::arg("error"))
        .def_readonly("value", &Measurement::value, "The number.")
        .def_readonly("error", &Measurement::error, "An estimate of how far off it may be, at least 0.")
        .def("__float__", [](const Measurement& measurement) { return measurement.value; })
        .def("__repr__", &representation);

    py::class_<Isosurface, std::shared_ptr<Isosurface>> surface(module.attr("Isosurface"));
    const auto bind_integral = [&](const char* name, Quantity quantity, const char* doc) {
        surface.def(
            name,
            [quantity](const Isosurface& self, int order, const py::object& progress) {
                return measure(self, quantity, order, progress);
            },
            py::kw_only(), py::arg("order") = 4, py::arg("progress") = py::none(), doc);
    };
    bind_integral("enclosed_volume", Quantity::volume, volume_doc);
    bind_integral("area", Quantity::area, area_doc);
    bind_integral("mean_curvature", Quantity::mean_curvature, mean_curvature_doc);
    bind_integral("gaussian_curvature", Quantity::gaussian_curvature, gaussian_curvature_doc);
}

} // namespace isospline
