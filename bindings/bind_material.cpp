#include "arrays.h"
#include "bind.h"
#include "colors.h"

#include "isospline/shade/material.h"
#include "isospline/util/check.h"

#include <algorithm>
#include <memory>
#include <string>
#include <variant>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* material_doc =
    R"(How a surface scatters light: a diffuse base under a rough dielectric coat, or a rough metal.

.. math:: f = (1 - m) \frac{c}{\pi} (1 - F_d(i)) (1 - F_d(o))
              + \frac{F(h) D(h) G(i, o)}{4 \langle n, i \rangle \langle n, o \rangle}

with the half vector h of the directions i to the light and o to the viewer, the base colour c, the metallic part m, the
distribution D of Trowbridge and Reitz (GGX) of width roughness^2, Smith's masking G and Schlick's Fresnel term

.. math:: F(h) = F_0 + (F_{90} - F_0) (1 - \langle h, o \rangle)^5.

A dielectric has F0 = 0.08 `specular` and F90 = min(50 F0, 1); F90 is 1 for F0 >= 0.02, which is water or
``specular=0.25``. A metal has F0 = c and F90 = 1. Between them, both are interpolated by m. Fd is the F of the
dielectric, at the normal. With ``specular=0`` and ``metallic=0`` this is Lambert's law.

Parameters
----------
base_color : float, (3,) float, ColorByVolume, ColorByCurvature, ColorByNormal or ColorByDepth
    Linear, 0 to 1, or a rule. The colours of a mesh's vertices are multiplied by it.
metallic, roughness, specular : float
    0 to 1. A roughness below 0.03 counts as 0.03.
cap_color : as base_color, optional
    Colour of caps (`Isosurface(..., capped=True)` or ``closed=True``); by default the base colour. The camera sees a
    rule, such as ``ColorByVolume(volume, "gray")``, without light: its colours are those of its colour bar.

Raises
------
ValueError
    For numbers outside of these ranges.

Notes
-----
An object's material is, in this order: the one that `PathTracer(materials=)` has for its geometry id; its own, from
``Mesh(..., material=)`` or ``Isosurface(..., material=)``; or `PathTracer(material=)`.

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
    py::class_<Material, std::shared_ptr<Material>>(module, "Material", material_doc)
        .def(py::init([](const py::object& base_color, double metallic, double roughness, double specular,
                         const py::object& cap_color) {
                 Material material{as_surface_color(base_color, "base_color"), metallic, roughness, specular,
                                   as_cap_color(cap_color, "cap_color")};
                 validate(material);
                 return material;
             }),
             py::arg("base_color") = std::get<glm::dvec3>(Material().base_color).x, py::kw_only(),
             py::arg("metallic") = 0.0, py::arg("roughness") = Material().roughness,
             py::arg("specular") = Material().specular, py::arg("cap_color") = py::none())
        .def_readonly("base_color", &Material::base_color)
        .def_readonly("cap_color", &Material::cap_color)
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
                if (!std::holds_alternative<glm::dvec3>(material.base_color))
                    throw_invalid("base_color", "a constant colour, because no point is given",
                                  to_text(material.base_color));
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

Returns
-------
(..., 3) float64 array
    For red, green and blue, per steradian; zero if a direction is below the surface.

Raises
------
ValueError
    If the base colour is a rule, because it then depends on the point.
)")
        .def("__repr__", [](const Material& material) {
            return "Material(" + to_text(material.base_color) + ", metallic=" + to_text(material.metallic) +
                   ", roughness=" + to_text(material.roughness) + ", specular=" + to_text(material.specular) +
                   ", cap_color=" + to_text(material.cap_color) + ")";
        });
}

} // namespace isospline
