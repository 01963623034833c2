#include "bind.h"
#include "color_maps.h"
#include "handed.h"
#include "long_call.h"
#include "thickness_words.h"

#include "isospline/render/distance_field.h"
#include "isospline/render/thickness_field.h"
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
    const auto make = [](const py::object& other, const py::object& cmap, std::optional<Limits> limits, bool is_signed,
                         std::string label) {
        ColorByDistance color{nullptr, as_color_map(cmap, limits.value_or(Limits{0.0, 1.0})), !limits,
                              std::move(label)};
        const py::object scene = handed("as_target")(other, is_signed);
        const double largest = limits ? std::max(std::abs(limits->first), std::abs(limits->second))
                                      : std::numeric_limits<double>::infinity();
        auto shared = scene.cast<std::shared_ptr<Scene>>();
        long_call("to index the other objects", py::none(), [&](const Progress& progress) {
            color.distance = std::make_shared<SceneDistance>(shared, shared->snapshot(progress), is_signed, largest);
        });
        return color;
    };
    const std::string text = R"(The colour of a surface by its distance.

The distance is that of `Scene.closest_points`, from each point to the nearest one of the other objects, in world units,
to a millionth of a cell; it takes some microseconds for each ray of a pixel.

Parameters
----------
other : Isosurface, Mesh, Scene, a mesh of another library, or (N, 3) array_like
    The objects as they are now, in the world of the scene that is rendered; or points.
)" + cmap_parameter + R"(limits : (float, float), optional
    Distances of the first and of the last colour, world units. By default those of 98% of 500 points of the coloured
    objects: from 0, or as far below 0 if they are signed.
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
Image(32 x 24, 45% covered)
)";
    py::class_<ColorByDistance> color_class(module, "ColorByDistance", text.c_str());
    color_class.def(py::init(make), py::arg("other"), py::arg("cmap") = "coolwarm", py::kw_only(),
                    py::arg("limits") = py::none(), py::arg("signed") = true, py::arg("label") = "");
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
            const std::string limits = color.fit_limits ? "" : ", " + limits_text(color.map);
            return "ColorByDistance(" + py::repr(scene).cast<std::string>() + limits + ")";
        });
}

void bind_by_value(py::module_& module)
{
    const auto make = [](const py::object& cmap, std::optional<Limits> limits, std::string label) {
        return ColorByValue{as_color_map(cmap, limits.value_or(Limits{0.0, 1.0})), !limits, std::move(label)};
    };
    const std::string text = R"(The colour of a mesh by the values at its vertices.

Inside of a triangle with the values v and barycentric coordinates b, the value is

.. math:: b_0 v_0 + b_1 v_1 + b_2 v_2

A mesh with different values, but without a colour and colours of its vertices, has this colour by default.

Parameters
----------
)" + cmap_parameter + R"(limits : (float, float), optional
    Values of the first and of the last colour; by default the smallest and the largest value of all meshes with this
    rule whose values have the same name.
label : str
    The title of the colour bar: what the values are, with their unit, such as ``"temperature in K"``. By default
    `Mesh.values_name`.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown map.

Notes
-----
Where a corner's value is NaN, a triangle is grey, as are meshes without values, and isosurfaces. Other values that are
not finite do not count for the default limits. If all values are the same, their colour is the middle one.

Examples
--------
>>> import isospline
>>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
>>> mesh = isospline.Mesh(corners, [(0, 1, 2)], values=[20, 30, 40], values_name="temperature in K")
>>> isospline.render(mesh, size=(32, 24), annotate=True)
Image(32 x 24, 4% covered)
>>> hot = isospline.Mesh(mesh, color=isospline.ColorByValue("magma", limits=(0, 100)))
)";
    py::class_<ColorByValue> color_class(module, "ColorByValue", text.c_str());
    color_class.def(py::init(make), py::arg("cmap") = "viridis", py::kw_only(), py::arg("limits") = py::none(),
                    py::arg("label") = "");
    bind_map(color_class);
    color_class
        .def_readonly("label", &ColorByValue::label, "str: the title of the colour bar; empty if it was not given.")
        .def("__repr__", [](const ColorByValue& color) {
            return "ColorByValue(" + (color.fit_limits ? "" : limits_text(color.map)) + ")";
        });
}

/// The thickness of a surface, with all that Python gets back; NaN if the surface is not known.
class SurfaceThickness : public PointValue {
public:
    ThicknessMethod method = ThicknessMethod::ray;
    std::optional<double> ripple;
    std::shared_ptr<Isosurface> surface; ///< as it was
    glm::dmat4 transform{1.0};           ///< from the surface's world space to the scene's

    static const SurfaceThickness& of(const ColorByThickness& color)
    {
        return dynamic_cast<const SurfaceThickness&>(*color.thickness);
    }

    void index(double scale, const Progress& progress)
    {
        Scene scene;
        scene.add(surface);
        field_.emplace(scene.snapshot(progress), method, ripple.value_or(default_ripple(*surface)),
                       glm::inverse(transform), scale);
    }

    double at(const glm::dvec3& position_world) const override
    {
        return field_ ? field_->at(position_world) : std::nan("");
    }

private:
    std::optional<ThicknessField> field_;
};

/// The factor of lengths of a similarity.
double scale_of(const glm::dmat4& transform)
{
    const glm::dmat3 linear(transform);
    const glm::dmat3 squares = glm::transpose(linear) * linear;
    const double square = (squares[0][0] + squares[1][1] + squares[2][2]) / 3.0;
    bool is_similar = square > 0.0 && is_finite(square) && transform[3][3] == 1.0;
    for (int i = 0; i < 3; ++i) {
        is_similar = is_similar && transform[i][3] == 0.0 && is_finite(transform[3][i]);
        for (int j = 0; j < 3; ++j)
            is_similar = is_similar && std::abs(squares[i][j] - (i == j ? square : 0.0)) <= 1e-9 * square;
    }
    if (!is_similar)
        throw_invalid("transform", "a rotation, a translation and a uniform scale, for the thickness",
                      "another matrix");
    return std::sqrt(square);
}

void bind_by_thickness(py::module_& module)
{
    const auto make = [](const py::object& cmap, std::optional<Limits> limits, const std::string& method,
                         std::optional<double> ripple, const std::shared_ptr<Isosurface>& surface,
                         const py::object& transform, std::string label) {
        auto thickness = std::make_shared<SurfaceThickness>();
        ColorByThickness color{thickness, as_color_map(cmap, limits.value_or(Limits{0.0, 1.0})), !limits,
                               std::move(label)};
        thickness->method = as_enum(thickness_words, method, "method");
        if (ripple)
            check_not_negative("ripple", *ripple);
        thickness->ripple = ripple;
        if (!transform.is_none())
            thickness->transform = as_matrix4(transform, "transform");
        const double scale = scale_of(thickness->transform);
        if (!surface)
            return color;
        thickness->surface = std::make_shared<Isosurface>(*surface);
        long_call("to index the surface", py::none(),
                  [&](const Progress& progress) { thickness->index(scale, progress); });
        return color;
    };
    const std::string text = R"(The colour of a surface by the thickness of its solid.

The thickness is that of `Isosurface.thickness`, in world units of the scene. It is that of the solid when the picture
is made, of each surface that has this colour.

Parameters
----------
)" + cmap_parameter + R"(limits : (float, float), optional
    Thicknesses of the first and of the last colour, world units; by default from 0 to what 98% of the area are below,
    of 500 random points of each surface that has this colour.
method : {"ray", "max_sphere"}
    As in `Isosurface.thickness`, of which the other one is the default: "ray" takes some microseconds for each ray of a
    pixel, "max_sphere" milliseconds.
ripple : float, optional
    For "max_sphere", as in `Isosurface.thickness`, in world units of the surface.
surface : Isosurface, optional
    The surface as it is now, whose solid is measured; by default that which has this colour. Points that are not on it
    have the thickness at its nearest point. Meshes need one.
transform : (4, 4) array_like, optional
    Maps the world space of `surface` to the scene's, as in `Scene.add`: a rotation, a translation and a uniform scale.
    By default they are the same.
label : str
    The title of the colour bar; by default "thickness", with the unit.

Raises
------
ValueError
    For limits that are equal or not finite, an unknown map or method, a ripple below 0, and another transform. When the
    picture is made, for a mesh without `surface`, and an object whose transform is not such a one.

Notes
-----
The last colour is that of all larger thicknesses, also of infinite ones, where the solid is open.

A mesh with values shows the thickness by "max_sphere" at its vertices, which is faster than at each pixel:
``Mesh(mesh, values=surface.thickness(mesh.vertices), values_name="thickness")``.

Examples
--------
>>> import isospline
>>> field = isospline.volumes.torus(0.6, 0.25)
>>> torus = isospline.Isosurface(field.volume(32), field.level)
>>> isospline.render(torus, color=isospline.ColorByThickness(), annotate=True, size=(32, 24))
Image(32 x 24, 11% covered)
)";
    py::class_<ColorByThickness> color_class(module, "ColorByThickness", text.c_str());
    color_class.def(py::init(make), py::arg("cmap") = "viridis", py::kw_only(), py::arg("limits") = py::none(),
                    py::arg("method") = "ray", py::arg("ripple") = py::none(), py::arg("surface") = py::none(),
                    py::arg("transform") = py::none(), py::arg("label") = "");
    bind_map(color_class);
    color_class
        .def_property_readonly(
            "method",
            [](const ColorByThickness& color) { return to_word(thickness_words, SurfaceThickness::of(color).method); })
        .def_property_readonly("ripple",
                               [](const ColorByThickness& color) { return SurfaceThickness::of(color).ripple; })
        .def_property_readonly(
            "surface",
            [](const ColorByThickness& color) {
                const auto& surface = SurfaceThickness::of(color).surface;
                return surface ? std::make_shared<Isosurface>(*surface) : nullptr;
            },
            "Isosurface or None: a copy of the surface whose solid is measured.")
        .def_property_readonly(
            "transform", [](const ColorByThickness& color) { return SurfaceThickness::of(color).transform; },
            "(4, 4) float64 array: from the world space of `surface` to the scene's.")
        .def_readonly("label", &ColorByThickness::label, "str: the title of the colour bar; empty if it was not given.")
        .def("__repr__", [](const ColorByThickness& color) {
            return "ColorByThickness(" + (color.fit_limits ? "" : limits_text(color.map)) + ")";
        });
}

} // namespace

void bind_object_colors(py::module_& module)
{
    bind_by_distance(module);
    bind_by_value(module);
    bind_by_thickness(module);
}

} // namespace isospline
