#include "arrays.h"
#include "bind.h"
#include "color_maps.h"
#include "colors.h"
#include "handed.h"

#include "isospline/util/check.h"

#include <glm/matrix.hpp>

#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

const EnumWords<CurvatureKind> kind_words{{"mean", CurvatureKind::mean},
                                          {"gaussian", CurvatureKind::gaussian},
                                          {"maximum", CurvatureKind::maximum},
                                          {"minimum", CurvatureKind::minimum}};

void bind_by_volume(py::module_& module)
{
    const auto make = [](const py::object& given, const py::object& cmap, std::optional<Limits> limits,
                         const py::object& transform, std::string label) {
        auto volume =
            as_object<Volume>(handed("as_volume")(given, "volume", " whose values give the colours"), "volume");
        if (!limits && !(volume->minimum() < volume->maximum()))
            throw_invalid("limits", "two numbers, since all samples of the volume are the same", "None");
        ColorByVolume color;
        color.map = as_color_map(cmap, limits.value_or(Limits{volume->minimum(), volume->maximum()}));
        if (!transform.is_none()) {
            color.volume_to_scene = as_matrix4(transform, "transform");
            color.scene_to_volume = glm::inverse(color.volume_to_scene);
            for (int column = 0; column < 4; ++column)
                if (!is_finite(glm::dvec3(color.scene_to_volume[column])) ||
                    color.scene_to_volume[column][3] != (column == 3))
                    throw_invalid("transform", "an invertible affine map", "another matrix");
        }
        color.volume = std::move(volume);
        color.label = std::move(label);
        return color;
    };
    const std::string text = R"(The colour of a surface by the value of a volume's model there.

Parameters
----------
volume : Volume, VolumeData or (nz, ny, nx) array
    Any volume of any degree; it need not be the volume of the surface. Outside of its domain, it continues by its
    boundary rule.
)" + cmap_parameter + R"(limits : (float, float), optional
    Values of the first and of the last colour; by default the smallest and the largest sample.
transform : (4, 4) array_like, optional
    Maps the volume's world space to the scene's, as in `Scene.add`; by default they are the same.
label : str
    The title of the colour bar: what the values are, with their unit, such as ``"temperature in K"``.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown map, a transform that is singular or not affine. Also if all
    samples are the same and there are no limits.

Examples
--------
>>> import numpy as np
>>> import isospline
>>> temperature = isospline.Volume(np.random.default_rng(1).random((8, 8, 8)))
>>> by_temperature = isospline.Phong(color=isospline.ColorByVolume(temperature, limits=(0, 1)))
)";
    py::class_<ColorByVolume> color_class(module, "ColorByVolume", text.c_str());
    color_class.def(py::init(make), py::arg("volume"), py::arg("cmap") = "viridis", py::kw_only(),
                    py::arg("limits") = py::none(), py::arg("transform") = py::none(), py::arg("label") = "");
    bind_map(color_class);
    color_class
        .def_readonly("label", &ColorByVolume::label, "str: the title of the colour bar; empty if it was not given.")
        .def_property_readonly("volume",
                               [](const ColorByVolume& color) { return std::const_pointer_cast<Volume>(color.volume); })
        .def_readonly("transform", &ColorByVolume::volume_to_scene,
                      "(4, 4) float64 array: maps the volume's world space to the scene's.")
        .def("__repr__", [](const ColorByVolume& color) {
            const py::object volume = py::cast(std::const_pointer_cast<Volume>(color.volume));
            return "ColorByVolume(" + py::repr(volume).cast<std::string>() + ", " + limits_text(color.map) + ")";
        });
}

void bind_by_curvature(py::module_& module)
{
    const auto make = [](const std::string& kind, const py::object& cmap, Limits limits) {
        return ColorByCurvature{as_enum(kind_words, kind, "kind"), as_color_map(cmap, limits)};
    };
    const std::string text = R"(The colour of a surface by its curvature.

The curvature is that of the model, from its exact gradient g and Hessian H in world space,

.. math:: k_{mean} = \pm \frac{|g|^2 \mathrm{tr} H - g^T H g}{2 |g|^3}, \quad
          k_{Gauss} = \frac{g^T \mathrm{adj}(H) g}{|g|^4}

with the sign that makes a solid ball's mean curvature positive: ridges are positive, valleys negative. Models of degree
3 have a continuous Hessian; at degree 2 it jumps between cells. Second derivatives amplify the noise of measured
samples; `Volume(..., filter="smoothing")` reduces it. The curvature of meshes is zero.

Parameters
----------
kind : {"mean", "gaussian", "maximum", "minimum"}
    Mean or Gaussian curvature, or a principal one.
)" + cmap_parameter + R"(limits : (float, float)
    Curvatures of the first and of the last colour, in 1 / world unit; for Gaussian curvature, in 1 / world unit^2.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown kind or map.

References
----------
R. Goldman, "Curvature formulas for implicit curves and surfaces", Computer Aided Geometric Design 22, 2005.

Examples
--------
>>> import isospline
>>> bends = isospline.Phong(color=isospline.ColorByCurvature("mean", "coolwarm", limits=(-0.5, 0.5)))
)";
    py::class_<ColorByCurvature> color_class(module, "ColorByCurvature", text.c_str());
    color_class.def(py::init(make), py::arg("kind") = "mean", py::arg("cmap") = "coolwarm", py::kw_only(),
                    py::arg("limits"));
    bind_map(color_class);
    color_class
        .def_property_readonly("kind", [](const ColorByCurvature& color) { return to_word(kind_words, color.kind); })
        .def("__repr__", [](const ColorByCurvature& color) {
            return "ColorByCurvature(\"" + std::string(to_word(kind_words, color.kind)) + "\", " +
                   limits_text(color.map) + ")";
        });
}

void bind_by_depth(py::module_& module)
{
    const auto make = [](const py::object& cmap, std::optional<Limits> limits) {
        return ColorByDepth{as_color_map(cmap, limits.value_or(Limits{0.0, 1.0})), !limits};
    };
    const std::string text = R"(The colour of a surface by its depth in the image.

Parameters
----------
)" + cmap_parameter + R"(limits : (float, float), optional
    Depths of the first and of the last colour, world units, as in `Image.depth`; by default the smallest and the
    largest depth of the corners of the scene's box.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown map.
)";
    py::class_<ColorByDepth> color_class(module, "ColorByDepth", text.c_str());
    color_class.def(py::init(make), py::arg("cmap") = "viridis", py::kw_only(), py::arg("limits") = py::none());
    bind_map(color_class);
    color_class.def("__repr__", [](const ColorByDepth& color) {
        return "ColorByDepth(" + (color.fit_limits ? "" : limits_text(color.map)) + ")";
    });
}

} // namespace

void bind_color(py::module_& module)
{
    bind_by_volume(module);
    bind_by_curvature(module);
    py::class_<ColorByNormal>(module, "ColorByNormal", R"(The colour of a surface by its normal.

Red, green and blue, linear, are (N + 1) / 2 of the unit outward normal N in world space.
)")
        .def(py::init<>())
        .def("__repr__", [](const ColorByNormal&) { return "ColorByNormal()"; });
    bind_by_depth(module);
}

} // namespace isospline
