#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "long_call.h"

#include "isospline/render/progressive.h"
#include "isospline/scene/scene.h"
#include "isospline/util/check.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* material_doc =
    R"(How a surface scatters light: a diffuse base below a rough dielectric coat, or a rough metal.

.. math:: f = (1 - m) \frac{c}{\pi} (1 - F_d(i)) (1 - F_d(o))
              + \frac{F(h) D(h) G(i, o)}{4 \langle n, i \rangle \langle n, o \rangle}

with the half vector h of the directions i to the light and o to the viewer, the base colour c, the metallic part m, the
distribution D of Trowbridge and Reitz (GGX) of width roughness^2, Smith's masking G and Schlick's Fresnel term F, which
at normal incidence is 0.08 `specular` for a dielectric and c for a metal. With ``specular=0`` and ``metallic=0`` it is
Lambert's law.

Parameters
----------
base_color : float or (3,) float
    Linear, 0 to 1.
metallic, roughness, specular : float
    0 to 1. A roughness below 0.03 is taken as that.

Raises
------
ValueError
    For numbers outside of these ranges.

References
----------
B. Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007; E. Heitz, "Understanding the
masking-shadowing function in microfacet-based BRDFs", JCGT 3(2), 2014.

Examples
--------
>>> import isospline
>>> bone = isospline.Material((0.9, 0.85, 0.7), roughness=0.6)
>>> gold = isospline.Material((1.0, 0.77, 0.34), metallic=1, roughness=0.25)
)";

constexpr const char* path_tracer_doc =
    R"(Light on all paths, by chance: soft shadows, reflections, and light from surface to surface.

The picture's noise falls with the root of the number of samples; `Image.variance` tells how much is left. Random
numbers are a function of pixel, sample and seed, so that the picture is the same, bit for bit, for any number of
threads.

Parameters
----------
material : Material
    Of all objects but those in `materials`.
materials : dict of geometry id to Material
lights : sequence of lights, optional
    `PositionalLight` (whose intensity here falls off with the square of the distance), `DirectionalLight` (irradiance),
    `RectangleLight`, `SphereLight` and one `EnvironmentLight` at most; by default ``EnvironmentLight(1)``.
max_bounces : int
    Hits of a path that scatter, at least 0.
seed : int
    Another one gives other noise.

Raises
------
ValueError
    For negative bounces and more than one environment.

Examples
--------
>>> import isospline
>>> lamp = isospline.SphereLight((3, -3, 5), 1.0, radiance=10)
>>> integrator = isospline.PathTracer(lights=[lamp, isospline.EnvironmentLight(0.2)])
>>> integrator.max_bounces
16
)";

/// A renderer, the scene that it sees, and one caller at a time.
struct SceneRenderer {
    SceneRenderer(Scene& rendered, const Camera& camera, const glm::ivec2& size, PathTracer path_tracer,
                  const glm::vec4& background)
        : scene(rendered), renderer(rendered, camera, size, std::move(path_tracer), background)
    {
    }

    Scene& scene;
    ProgressiveRenderer renderer;
    std::mutex mutex;
};

void step(SceneRenderer& self, int samples, const py::object& progress)
{
    long_call(progress, [&](const Progress& report) {
        const std::lock_guard lock(self.mutex);
        const auto held = self.renderer.samples() == 0 ? self.scene.hold() : self.scene.hold_committed();
        self.renderer.step(samples, report);
    });
}

void reset(SceneRenderer& self, const std::optional<Camera>& camera)
{
    const py::gil_scoped_release no_gil;
    const std::lock_guard lock(self.mutex);
    if (camera)
        self.renderer.reset(*camera);
    else
        self.renderer.reset();
}

void bind_material(py::module_& module)
{
    py::class_<Material>(module, "Material", material_doc)
        .def(py::init([](const py::object& base_color, double metallic, double roughness, double specular) {
                 const Material material{as_color(base_color, "base_color"), metallic, roughness, specular};
                 validate(material);
                 return material;
             }),
             py::arg("base_color") = Material().base_color.x, py::kw_only(), py::arg("metallic") = 0.0,
             py::arg("roughness") = Material().roughness, py::arg("specular") = Material().specular)
        .def_property_readonly("base_color", [](const Material& material) { return to_array(material.base_color); })
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
    For red, green and blue, per steradian; zero where a direction is below the surface.
)")
        .def("__repr__", [](const Material& material) {
            return "Material(" + to_text(material.base_color) + ", metallic=" + to_text(material.metallic) +
                   ", roughness=" + to_text(material.roughness) + ", specular=" + to_text(material.specular) + ")";
        });
}

} // namespace

void bind_path_tracer(py::module_& module)
{
    bind_material(module);

    py::class_<PathTracer>(module, "PathTracer", path_tracer_doc)
        .def(py::init([](const Material& material, std::map<std::uint32_t, Material> materials,
                         std::optional<std::vector<Emitter>> lights, int max_bounces, std::uint32_t seed) {
                 PathTracer path_tracer{material, std::move(materials), {EnvironmentLight{}}, max_bounces, seed};
                 if (lights)
                     path_tracer.lights = std::move(*lights);
                 validate(path_tracer);
                 return path_tracer;
             }),
             py::arg("material") = Material(), py::kw_only(),
             py::arg("materials") = std::map<std::uint32_t, Material>(), py::arg("lights") = py::none(),
             py::arg("max_bounces") = PathTracer().max_bounces, py::arg("seed") = 0)
        .def_readonly("material", &PathTracer::material)
        .def_readonly("materials", &PathTracer::material_of_geometry)
        .def_readonly("lights", &PathTracer::lights)
        .def_readonly("max_bounces", &PathTracer::max_bounces)
        .def_readonly("seed", &PathTracer::seed)
        .def("__repr__", [](const PathTracer& path_tracer) {
            return "PathTracer(" + py::repr(py::cast(path_tracer.material)).cast<std::string>() +
                   ", lights=" + py::repr(py::cast(path_tracer.lights)).cast<std::string>() +
                   ", max_bounces=" + std::to_string(path_tracer.max_bounces) +
                   ", seed=" + std::to_string(path_tracer.seed) + ")";
        });

    py::class_<SceneRenderer>(module, "ProgressiveRenderer", "What isospline.ProgressiveRenderer is made of.")
        .def(py::init([](Scene& scene, const Camera& camera, std::array<int, 2> size, const PathTracer& integrator,
                         const py::object& background) {
                 return std::make_unique<SceneRenderer>(scene, camera, glm::ivec2(size[0], size[1]), integrator,
                                                        as_background(background, "background"));
             }),
             py::keep_alive<1, 2>(), py::arg("scene"), py::arg("camera"), py::kw_only(), py::arg("size"),
             py::arg("integrator"), py::arg("background"))
        .def("step", &step, py::arg("samples"), py::kw_only(), py::arg("progress"))
        .def("reset", &reset, py::arg("camera"))
        .def("image",
             [](SceneRenderer& self) {
                 const py::gil_scoped_release no_gil;
                 const std::lock_guard lock(self.mutex);
                 return std::make_unique<Image>(self.renderer.image());
             })
        .def_property_readonly("samples", [](SceneRenderer& self) {
            const py::gil_scoped_release no_gil;
            const std::lock_guard lock(self.mutex);
            return self.renderer.samples();
        });
}

} // namespace isospline
