#include "arrays.h"
#include "bind.h"
#include "colors.h"

#include "isospline/shade/material.h"
#include "isospline/util/check.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* material_doc =
    R"(The look of a surface: its colour, its opacity, and how it scatters light.

For path tracing, it is a diffuse base under a rough dielectric coat, or a rough metal:

.. math:: f = (1 - m) \frac{c}{\pi} (1 - F_d(i)) (1 - F_d(o))
              + \frac{F(h) D(h) G(i, o)}{4 \langle n, i \rangle \langle n, o \rangle}

with the half vector h of the directions i to the light and o to the viewer, the colour c, the metallic part m, the
distribution D of Trowbridge and Reitz (GGX) of width roughness^2, Smith's masking G and Schlick's Fresnel term

.. math:: F(h) = F_0 + (F_{90} - F_0) (1 - \langle h, o \rangle)^5.

A dielectric has F0 = 0.08 `specular` and F90 = min(50 F0, 1); F90 is 1 for F0 >= 0.02, which is water or
``specular=0.25``. A metal has F0 = c and F90 = 1. Between them, both are interpolated by m. Fd is the F of the
dielectric, at the normal. With ``specular=0`` and ``metallic=0`` this is Lambert's law.

Parameters
----------
color : str, float, (3,) float, or a rule such as ColorByVolume, optional
    A name, sRGB from 0 to 1, or a rule. The colours of a mesh's vertices are multiplied by it. By default,
    the light decides: a `PathTracer` uses 0.8, and a shading its own colour.
metallic, roughness, specular : float
    0 to 1; a roughness below 0.03 counts as 0.03. A `PathTracer` uses them, and a `Studio` uses `specular`.
cap_color : as color, optional
    Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default `color`. A rule, such as
    ``ColorByVolume(volume, "gray")``, is not lit: its colours are those of its colour bar.
opacity : float
    0 to 1. Path tracers draw all surfaces opaque.
silhouette_opacity : float, optional
    As in `Phong`.
silhouette_exponent : float
    As in `Phong`.
name : str
    What legends call objects of this material.

Raises
------
ValueError
    For numbers outside of these ranges, and unknown names of colours.

Notes
-----
An object's material is, in this order: the one that ``PathTracer(materials=)`` has for it; its own, from
``Mesh(..., material=)`` or ``Isosurface(..., material=)``; or ``PathTracer(material=)``.

References
----------
S. Lagarde, C. de Rousiers, "Moving Frostbite to physically based rendering", SIGGRAPH 2014 course (F90); B. Walter et
al., "Microfacet models for refraction through rough surfaces", EGSR 2007; E. Heitz, "Understanding the
masking-shadowing function in microfacet-based BRDFs", JCGT 3(2), 2014.

Examples
--------
>>> import isospline
>>> bone = isospline.Material((0.9, 0.85, 0.7), roughness=0.6)
>>> gold = isospline.Material((1.0, 0.77, 0.34), metallic=1, roughness=0.25)
)";

} // namespace

void bind_material(py::module_& module)
{
    py::class_<Material, std::shared_ptr<Material>> material_class(module, "Material", material_doc);
    bind_color_of(material_class, "color", &Material::color);
    bind_color_of(material_class, "cap_color", &Material::cap_color);
    material_class
        .def(py::init([](const py::object& color, double metallic, double roughness, double specular,
                         const py::object& cap_color, double opacity, std::optional<double> silhouette_opacity,
                         double silhouette_exponent, std::string name) {
                 Material material{as_cap_color(color, "color"),
                                   metallic,
                                   roughness,
                                   specular,
                                   as_cap_color(cap_color, "cap_color"),
                                   opacity,
                                   silhouette_opacity,
                                   silhouette_exponent,
                                   std::move(name)};
                 validate(material);
                 return material;
             }),
             py::arg("color") = py::none(), py::kw_only(), py::arg("metallic") = 0.0,
             py::arg("roughness") = Material().roughness, py::arg("specular") = Material().specular,
             py::arg("cap_color") = py::none(), py::arg("opacity") = 1.0, py::arg("silhouette_opacity") = py::none(),
             py::arg("silhouette_exponent") = Material().silhouette_exponent, py::arg("name") = "")
        .def_readonly("opacity", &Material::opacity)
        .def_readonly("silhouette_opacity", &Material::silhouette_opacity)
        .def_readonly("silhouette_exponent", &Material::silhouette_exponent)
        .def_readonly("name", &Material::name)
        .def_readonly("metallic", &Material::metallic)
        .def_readonly("roughness", &Material::roughness)
        .def_readonly("specular", &Material::specular)
        .def(
            "evaluate",
            [](const Material& material, const py::object& to_viewer, const py::object& to_light) {
                const RowArray viewer(to_viewer, "to_viewer", 3), light(to_light, "to_light", 3);
                if (viewer.leading_shape() != light.leading_shape())
                    throw_invalid("to_light", "the shape of to_viewer, " + to_text(viewer.leading_shape()),
                                  to_text(light.leading_shape()));
                py::array_t<double> result = new_array<double>(viewer.leading_shape(), {3});
                if (!std::holds_alternative<glm::dvec3>(color_of(material)))
                    throw_invalid("color", "a constant colour, because no point is given", to_text(material.color));
                const Scattering scattering(material);
                for (std::size_t i = 0; i < viewer.count(); ++i) {
                    const glm::dvec3 f = scattering.evaluate(viewer.vector(i), light.vector(i));
                    std::copy(&f[0], &f[0] + 3, result.mutable_data() + 3 * i);
                }
                return result;
            },
            py::arg("to_viewer"), py::arg("to_light"),
            R"(The scattering function f, for unit directions away from a surface whose normal is (0, 0, 1).

Parameters
----------
to_viewer, to_light : (..., 3) array_like
    Both of the same shape.

Returns
-------
(..., 3) float64 array
    For red, green and blue, per steradian; zero if a direction is below the surface.

Raises
------
ValueError
    If the colour is a rule, because it then depends on the point, and for different shapes.
)")
        .def("__repr__", [](const Material& material) {
            return "Material(" + to_text(material.color) + ", metallic=" + to_text(material.metallic) +
                   ", roughness=" + to_text(material.roughness) + ", specular=" + to_text(material.specular) +
                   ", cap_color=" + to_text(material.cap_color) +
                   (material.opacity < 1.0 ? ", opacity=" + to_text(material.opacity) : "") +
                   (material.name.empty() ? "" : ", name=\"" + material.name + "\"") + ")";
        });
}

} // namespace isospline
