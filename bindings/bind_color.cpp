#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "long_call.h"

#include "isospline/render/distance_field.h"
#include "isospline/scene/scene.h"
#include "isospline/util/check.h"

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace py = pybind11;

namespace isospline {

namespace {

using Limits = std::pair<double, double>;

const EnumWords<CurvatureKind> kind_words{{"mean", CurvatureKind::mean},
                                          {"gaussian", CurvatureKind::gaussian},
                                          {"maximum", CurvatureKind::maximum},
                                          {"minimum", CurvatureKind::minimum}};

/// Python code looks up the names of colour maps.
ColorMap as_color_map(const py::object& cmap, Limits limits)
{
    const py::object table = py::module_::import("isospline.colors").attr("color_map")(cmap);
    const RowArray rows(table, "cmap", 3);
    ColorMap map{{}, {limits.first, limits.second}};
    for (std::size_t i = 0; i < rows.count(); ++i)
        map.colors.push_back(rows.vector(i));
    validate(map);
    return map;
}

py::array_t<double> colors_of(const ColorMap& map)
{
    auto array = new_array<double>({static_cast<py::ssize_t>(map.colors.size())}, {3});
    for (std::size_t i = 0; i < map.colors.size(); ++i)
        for (int channel = 0; channel < 3; ++channel)
            array.mutable_at(static_cast<py::ssize_t>(i), channel) = map.colors[i][channel];
    return array;
}

std::string limits_text(const ColorMap& map)
{
    return "limits=(" + to_text(map.limits.x) + ", " + to_text(map.limits.y) + ")";
}

/// The common members of all colours by a number.
template <typename GivenColor>
void bind_map(py::class_<GivenColor>& color_class)
{
    color_class
        .def_property_readonly(
            "cmap",
            [](const GivenColor& color) {
                return py::module_::import("isospline.colors").attr("encoded")(colors_of(color.map));
            },
            "(N, 3) float64 array: colours, sRGB, at equal steps from the first limit to the second.")
        .def("_cmap",
             [](const GivenColor& color) {
                 return py::module_::import("isospline.colors").attr("linear")(colors_of(color.map));
             })
        .def_property_readonly("limits", [](const GivenColor& color) -> std::optional<Limits> {
            if constexpr (std::is_same_v<GivenColor, ColorByDepth>)
                if (color.fit_limits)
                    return std::nullopt;
            return Limits{color.map.limits.x, color.map.limits.y};
        });
}

void bind_by_volume(py::module_& module)
{
    const auto make = [](const py::object& given, const py::object& cmap, std::optional<Limits> limits,
                         const py::object& transform, std::string label) {
        auto volume = as_object<Volume>(py::module_::import("isospline.interop.conversions")
                                            .attr("as_volume")(given, "volume", " whose values give the colours"),
                                        "volume");
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
    py::class_<ColorByVolume> color_class(module, "ColorByVolume",
                                          R"(The colour of a surface by the value of a volume's model there.

Parameters
----------
volume : Volume, VolumeData or (nz, ny, nx) array
    Any volume of any degree; it need not be the volume of the surface. Outside of its domain, it continues by its
    boundary rule.
cmap : str, matplotlib Colormap or (N, 3) array_like
    The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
    Between them, colours are interpolated in linear light.
limits : (float, float), optional
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
)");
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
    py::class_<ColorByCurvature> color_class(module, "ColorByCurvature", R"(The colour of a surface by its curvature.

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
cmap : str, matplotlib Colormap or (N, 3) array_like
    The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
    Between them, colours are interpolated in linear light.
limits : (float, float)
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
)");
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

/// The distance from a scene, which Python gets back.
class SceneDistance : public DistanceField {
public:
    SceneDistance(std::shared_ptr<Scene> scene, std::shared_ptr<const SceneSnapshot> snapshot, bool is_signed,
                  double largest)
        : DistanceField(std::move(snapshot), is_signed, largest), scene_(std::move(scene)), is_signed_(is_signed)
    {
    }

    static const SceneDistance& of(const ColorByDistance& color)
    {
        return dynamic_cast<const SceneDistance&>(*color.distance);
    }
    const std::shared_ptr<Scene>& scene() const { return scene_; }
    bool is_signed() const { return is_signed_; }

private:
    std::shared_ptr<Scene> scene_;
    bool is_signed_;
};

void bind_by_distance(py::module_& module)
{
    const auto make = [](const py::object& other, const py::object& cmap, Limits limits, bool is_signed,
                         std::string label) {
        ColorByDistance color{nullptr, as_color_map(cmap, limits), std::move(label)};
        const py::object scene =
            py::module_::import("isospline.interop.conversions").attr("as_target")(other, is_signed);
        const double largest = std::max(std::abs(limits.first), std::abs(limits.second));
        auto shared = scene.cast<std::shared_ptr<Scene>>();
        long_call("to index the other objects", py::none(), [&](const Progress& progress) {
            color.distance = std::make_shared<SceneDistance>(shared, shared->snapshot(progress), is_signed, largest);
        });
        return color;
    };
    py::class_<ColorByDistance> color_class(module, "ColorByDistance", R"(The colour of a surface by its distance.

The distance is that of `Scene.closest_points`, from each point to the nearest one of the other objects, in world units,
to a millionth of a cell; it takes some microseconds for each ray of a pixel.

Parameters
----------
other : Isosurface, Mesh, Scene, a mesh of another library, or (N, 3) array_like
    The objects as they are now, in the world of the scene that is rendered; or points.
cmap : str, matplotlib Colormap or (N, 3) array_like
    The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
    Between them, colours are interpolated in linear light.
limits : (float, float)
    Distances of the first and of the last colour, world units.
signed : bool
    Whether distances are negative inside of the other objects, of which meshes must be closed, as in
    `Scene.signed_distance`.
label : str
    The title of the colour bar; by default "distance" or "signed distance", with the unit.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown map, objects without points, and signed distances of points.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.sphere(0.7)
>>> scan = isospline.Isosurface(field.volume(32), field.level)
>>> part = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
>>> deviation = isospline.ColorByDistance(part, limits=(-0.5, 0.5))
>>> isospline.render(scan, color=deviation, size=(32, 24))
Image(32 x 24, 42% covered)
)");
    color_class.def(py::init(make), py::arg("other"), py::arg("cmap") = "coolwarm", py::kw_only(), py::arg("limits"),
                    py::arg("signed") = true, py::arg("label") = "");
    bind_map(color_class);
    color_class
        .def_property_readonly(
            "other",
            [](const ColorByDistance& color) -> py::object { return py::cast(SceneDistance::of(color).scene()); },
            "Scene: the objects from which the distance is measured.")
        .def_property_readonly(
            "signed", [](const ColorByDistance& color) { return SceneDistance::of(color).is_signed(); },
            "bool: whether distances are negative inside of the other objects.")
        .def_readonly("label", &ColorByDistance::label, "str: the title of the colour bar; empty if it was not given.")
        .def("__repr__", [](const ColorByDistance& color) {
            const py::object scene = py::cast(SceneDistance::of(color).scene());
            return "ColorByDistance(" + py::repr(scene).cast<std::string>() + ", " + limits_text(color.map) + ")";
        });
}

void bind_by_depth(py::module_& module)
{
    const auto make = [](const py::object& cmap, std::optional<Limits> limits) {
        return ColorByDepth{as_color_map(cmap, limits.value_or(Limits{0.0, 1.0})), !limits};
    };
    py::class_<ColorByDepth> color_class(module, "ColorByDepth", R"(The colour of a surface by its depth in the image.

Parameters
----------
cmap : str, matplotlib Colormap or (N, 3) array_like
    The name of a matplotlib map, a map object, or two or more colours at equal steps, sRGB from 0 to 1 or named.
    Between them, colours are interpolated in linear light.
limits : (float, float), optional
    Depths of the first and of the last colour, world units, as in `Image.depth`; by default the smallest and the
    largest depth of the corners of the scene's box.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown map.
)");
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
    bind_by_distance(module);
}

} // namespace isospline
