#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "lights.h"

#include "isospline/shade/shading.h"
#include "isospline/util/check.h"

#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

template <typename Validated>
Validated checked(Validated value)
{
    validate(value);
    return value;
}

/// The parameters of a model's opacity, as in its constructor.
template <typename Model>
std::string opacity_text(const Model& model)
{
    std::string text = ", opacity=" + to_text(model.opacity);
    if (model.silhouette_opacity)
        text += ", silhouette_opacity=" + to_text(*model.silhouette_opacity) +
                ", silhouette_exponent=" + to_text(model.silhouette_exponent);
    return text;
}

void bind_phong(py::module_& module)
{
    const Phong defaults;
    py::class_<Phong>(module, "Phong", R"(Phong's illumination model in the paper's form.

.. math:: I = k_a I_a + \sum_k I_k (k_d \langle N, L_k \rangle + k_s \langle V, R_k \rangle^{n_s}),
          \quad R_k = 2 N \langle N, L_k \rangle - L_k

with the unit normal N, the unit vectors L_k to the lights and V to the viewer. Negative products count as zero.
Every intensity has a red, a green and a blue part. The surface's colour multiplies the ambient and the diffuse term;
highlights have the colour of the light.

Parameters
----------
color : str, float, (3,) float, or a rule such as ColorByVolume
    Colour of the surface: a name, sRGB from 0 to 1, or a rule. The colours of a mesh's vertices are
    multiplied by it.
ambient, diffuse, specular : float
    The coefficients k_a, k_d and k_s, at least 0.
specular_exponent : float
    n_s, at least 0.
ambient_light : float or (3,) float
    I_a.
lights : sequence of PositionalLight and DirectionalLight, optional
    By default two directional lights that move with the camera: one over the viewer's left shoulder, and one from the
    right, a quarter as bright. With an empty sequence there is only the ambient term.
two_sided : bool
    Flips normals with negative <N, V> to face the viewer, so that the inside of an open or cut surface is lit like its
    outside. With False, it is exactly the paper's formula.
shadows : bool
    Whether isosurfaces and meshes cast shadows. Translucent ones let a part of the light through, by their opacity.
shadow_samples : int
    Shadow rays per hit to each light with an `angle`, 1 to 65536. The rays of a pixel spread over the light, too.
opacity : float
    0 to 1; below 1, objects behind show through, see `render`.
silhouette_opacity : float, optional
    0 to 1: the opacity at the silhouette, for example 1 to keep edges visible. The opacity at a point is
    o + (silhouette_opacity - o) (1 - abs(<N, V>))^silhouette_exponent, where o is `opacity` and V the unit vector
    against the ray. By default it is `opacity` everywhere.
silhouette_exponent : float
    Above 0; the larger, the thinner the silhouette.
cap_color : as color, optional
    Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default that of the surface. A rule, such as
    ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.

Raises
------
ValueError
    For numbers that are negative or not finite, opacities above 1, a silhouette exponent of 0, and a number of shadow
    rays out of range.

References
----------
P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, section 6;
D. S. Kay, D. Greenberg, "Transparency for computer synthesized images", SIGGRAPH 1979 (opacity at silhouettes).

Examples
--------
>>> import isospline
>>> isospline.Phong(color=(1, 0.8, 0.6), lights=[isospline.PositionalLight((10, -20, 30))]).specular_exponent
30.0
)")
        .def(py::init([](const py::object& color, double ambient, double diffuse, double specular,
                         double specular_exponent, const py::object& ambient_light,
                         std::optional<std::vector<Light>> lights, bool two_sided, bool shadows, int shadow_samples,
                         double opacity, std::optional<double> silhouette_opacity, double silhouette_exponent,
                         const py::object& cap_color) {
                 return checked(Phong{as_surface_color(color, "color"), ambient, diffuse, specular, specular_exponent,
                                      as_color(ambient_light, "ambient_light"), std::move(lights), two_sided, shadows,
                                      shadow_samples, opacity, silhouette_opacity, silhouette_exponent,
                                      as_cap_color(cap_color, "cap_color")});
             }),
             py::kw_only(), py::arg("color") = 1.0, py::arg("ambient") = defaults.ambient,
             py::arg("diffuse") = defaults.diffuse, py::arg("specular") = defaults.specular,
             py::arg("specular_exponent") = defaults.specular_exponent, py::arg("ambient_light") = 1.0,
             py::arg("lights") = py::none(), py::arg("two_sided") = true, py::arg("shadows") = false,
             py::arg("shadow_samples") = defaults.shadow_samples, py::arg("opacity") = defaults.opacity,
             py::arg("silhouette_opacity") = py::none(), py::arg("silhouette_exponent") = defaults.silhouette_exponent,
             py::arg("cap_color") = py::none())
        .def_readonly("ambient", &Phong::ambient)
        .def_readonly("diffuse", &Phong::diffuse)
        .def_readonly("specular", &Phong::specular)
        .def_readonly("specular_exponent", &Phong::specular_exponent)
        .def_readonly("ambient_light", &Phong::ambient_light)
        .def_readonly("lights", &Phong::lights)
        .def_readonly("two_sided", &Phong::two_sided)
        .def_readonly("shadows", &Phong::shadows)
        .def_readonly("shadow_samples", &Phong::shadow_samples)
        .def_readonly("opacity", &Phong::opacity)
        .def_readonly("silhouette_opacity", &Phong::silhouette_opacity)
        .def_readonly("silhouette_exponent", &Phong::silhouette_exponent)
        .def("__repr__", [](const Phong& phong) {
            std::ostringstream representation;
            representation << "Phong(color=" << to_text(phong.color) << ", ambient=" << phong.ambient
                           << ", diffuse=" << phong.diffuse << ", specular=" << phong.specular
                           << ", specular_exponent=" << phong.specular_exponent
                           << ", ambient_light=" << to_text(phong.ambient_light)
                           << ", lights=" << py::repr(py::cast(phong.lights)).cast<std::string>()
                           << ", two_sided=" << (phong.two_sided ? "True" : "False")
                           << ", shadows=" << (phong.shadows ? "True" : "False")
                           << ", shadow_samples=" << phong.shadow_samples << opacity_text(phong)
                           << ", cap_color=" << to_text(phong.cap_color) << ")";
            return representation.str();
        });
}

void bind_outline(py::module_& module)
{
    py::class_<Outline>(module, "Outline", R"(The paper's outline illumination model.

.. math:: I = (1 - \langle N, V \rangle^2)^{n_o}

with the unit normal N and the unit vector V to the viewer: bright where the surface turns away. It needs no light.
I goes from the surface's colour (0) to the colour of the lines (1).

Parameters
----------
exponent : float
    n_o, at least 0; the larger, the thinner the lines.
color : str, float, (3,) float, or a rule such as ColorByVolume
    Colour of the lines: a name, sRGB from 0 to 1, or a rule.
surface_color : as color
    Colour of the surface between the lines. The colours of a mesh's vertices are multiplied by it.
opacity : float
    0 to 1; below 1, objects behind show through, see `render`.
silhouette_opacity : float, optional
    0 to 1: the opacity at the silhouette, for example 1 to keep edges visible. The opacity at a point is
    o + (silhouette_opacity - o) (1 - abs(<N, V>))^silhouette_exponent, where o is `opacity` and V the unit vector
    against the ray. By default it is `opacity` everywhere.
silhouette_exponent : float
    Above 0; the larger, the thinner the silhouette.
cap_color : as color, optional
    Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default `surface_color`. A rule, such as
    ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.

Raises
------
ValueError
    For numbers that are negative or not finite, opacities above 1, and a silhouette exponent of 0.

References
----------
P. Thévenaz, M. Unser, "High-quality isosurface rendering with exact gradient", ICIP 2001, section 6;
D. S. Kay, D. Greenberg, "Transparency for computer synthesized images", SIGGRAPH 1979 (opacity at silhouettes).

Examples
--------
>>> import isospline
>>> ink_on_paper = isospline.Outline(exponent=3, color=0, surface_color=1)
)")
        .def(py::init([](double exponent, const py::object& color, const py::object& surface_color, double opacity,
                         std::optional<double> silhouette_opacity, double silhouette_exponent,
                         const py::object& cap_color) {
                 return checked(Outline{exponent, as_surface_color(color, "color"),
                                        as_surface_color(surface_color, "surface_color"), opacity, silhouette_opacity,
                                        silhouette_exponent, as_cap_color(cap_color, "cap_color")});
             }),
             py::arg("exponent") = Outline().exponent, py::kw_only(), py::arg("color") = 1.0,
             py::arg("surface_color") = 0.0, py::arg("opacity") = Outline().opacity,
             py::arg("silhouette_opacity") = py::none(), py::arg("silhouette_exponent") = Outline().silhouette_exponent,
             py::arg("cap_color") = py::none())
        .def_readonly("exponent", &Outline::exponent)
        .def_readonly("opacity", &Outline::opacity)
        .def_readonly("silhouette_opacity", &Outline::silhouette_opacity)
        .def_readonly("silhouette_exponent", &Outline::silhouette_exponent)
        .def("__repr__", [](const Outline& outline) {
            std::ostringstream representation;
            representation << "Outline(exponent=" << outline.exponent << ", color=" << to_text(outline.color)
                           << ", surface_color=" << to_text(outline.surface_color) << opacity_text(outline)
                           << ", cap_color=" << to_text(outline.cap_color) << ")";
            return representation.str();
        });
}

void bind_ambient_occlusion(py::module_& module)
{
    const AmbientOcclusion defaults;
    py::class_<AmbientOcclusion>(module, "AmbientOcclusion", R"(Ambient occlusion: the light of a uniform sky.

.. math:: I = \frac{1}{\pi} \int_\Omega V(\omega) \langle N, \omega \rangle d\omega

over the hemisphere about the normal N, which is flipped to face the viewer. V is the visibility of the sky: 0 if a ray
meets an opaque surface within `distance`, the transmitted part if it meets translucent surfaces only, otherwise 1.

Parameters
----------
samples : int
    Rays per hit, 1 to 65536.
distance : float
    World units, above 0; surfaces farther away hide nothing.
color : str, float, (3,) float, or a rule such as ColorByVolume
    Colour of the surface: a name, sRGB from 0 to 1, or a rule. The colours of a mesh's vertices are
    multiplied by it.
opacity : float
    0 to 1; below 1, objects behind show through, see `render`.
silhouette_opacity : float, optional
    0 to 1: the opacity at the silhouette, for example 1 to keep edges visible. The opacity at a point is
    o + (silhouette_opacity - o) (1 - abs(<N, V>))^silhouette_exponent, where o is `opacity` and V the unit vector
    against the ray. By default it is `opacity` everywhere.
silhouette_exponent : float
    Above 0; the larger, the thinner the silhouette.
cap_color : as color, optional
    Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default that of the surface. A rule, such as
    ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.

Raises
------
ValueError
    For numbers outside of these ranges.

References
----------
D. S. Kay, D. Greenberg, "Transparency for computer synthesized images", SIGGRAPH 1979 (opacity at silhouettes).

Examples
--------
>>> import isospline
>>> isospline.AmbientOcclusion(64, distance=20.0)
AmbientOcclusion(64, distance=20, color=(1, 1, 1), opacity=1, cap_color=None)
)")
        .def(py::init([](int samples, double distance, const py::object& color, double opacity,
                         std::optional<double> silhouette_opacity, double silhouette_exponent,
                         const py::object& cap_color) {
                 return checked(AmbientOcclusion{samples, distance, as_surface_color(color, "color"), opacity,
                                                 silhouette_opacity, silhouette_exponent,
                                                 as_cap_color(cap_color, "cap_color")});
             }),
             py::arg("samples") = defaults.samples, py::kw_only(), py::arg("distance") = defaults.distance,
             py::arg("color") = 1.0, py::arg("opacity") = defaults.opacity, py::arg("silhouette_opacity") = py::none(),
             py::arg("silhouette_exponent") = defaults.silhouette_exponent, py::arg("cap_color") = py::none())
        .def_readonly("samples", &AmbientOcclusion::samples)
        .def_readonly("distance", &AmbientOcclusion::distance)
        .def_readonly("opacity", &AmbientOcclusion::opacity)
        .def_readonly("silhouette_opacity", &AmbientOcclusion::silhouette_opacity)
        .def_readonly("silhouette_exponent", &AmbientOcclusion::silhouette_exponent)
        .def("__repr__", [](const AmbientOcclusion& model) {
            std::ostringstream representation;
            representation << "AmbientOcclusion(" << model.samples << ", distance=" << model.distance
                           << ", color=" << to_text(model.color) << opacity_text(model)
                           << ", cap_color=" << to_text(model.cap_color) << ")";
            return representation.str();
        });
}

} // namespace

void bind_shading(py::module_& module)
{
    bind_phong(module);
    bind_outline(module);
    bind_ambient_occlusion(module);
    py::class_<Phong> phong(module.attr("Phong"));
    bind_color_of(phong, "color", &Phong::color);
    bind_color_of(phong, "cap_color", &Phong::cap_color);
    py::class_<Outline> outline(module.attr("Outline"));
    bind_color_of(outline, "color", &Outline::color);
    bind_color_of(outline, "surface_color", &Outline::surface_color);
    bind_color_of(outline, "cap_color", &Outline::cap_color);
    py::class_<AmbientOcclusion> occlusion(module.attr("AmbientOcclusion"));
    bind_color_of(occlusion, "color", &AmbientOcclusion::color);
    bind_color_of(occlusion, "cap_color", &AmbientOcclusion::cap_color);
}

} // namespace isospline
