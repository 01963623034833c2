#include "bind.h"
#include "colors.h"
#include "layers.h"
#include "long_call.h"

#include "isospline/render/progressive.h"
#include "isospline/scene/scene.h"
#include "isospline/util/turn.h"

#include <pybind11/stl.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

constexpr const char* path_tracer_doc =
    R"(Light on all paths, by chance: soft shadows, reflections, and light from surface to surface.

The picture's noise falls with the root of the number of samples; `Image.variance` tells how much is left. Random
numbers are a function of pixel, sample and seed, so that the picture is the same, bit for bit, for any number of
threads. The only sample of a picture goes through the centre of its pixel and of the lens, so that colour, alpha and
ids are those of one ray. Of several samples each goes through a random place.

Parameters
----------
material : Material
    Of objects that have none of their own, as of ``Mesh(..., material=)`` and ``Isosurface(..., material=)``.
materials : dict of geometry id to Material
    Of these objects of the scene, whether they have one of their own or not.
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
    For negative bounces and more than one environment; when it renders, for a geometry id that the scene does not have.

Examples
--------
>>> import isospline
>>> lamp = isospline.SphereLight((3, -3, 5), 1.0, radiance=10)
>>> integrator = isospline.PathTracer(lights=[lamp, isospline.EnvironmentLight(0.2)])
>>> integrator.max_bounces
16
)";

/// A renderer, and one caller at a time.
struct SceneRenderer {
    SceneRenderer(Scene& rendered, const Camera& camera, const glm::ivec2& size, PathTracer path_tracer,
                  const glm::vec4& background, const Layers& layers, ColorEncoding color_encoding)
        : renderer(rendered, camera, size, std::move(path_tracer), background, layers), encoding(color_encoding)
    {
    }

    /// Throws where a call of the parent's had not finished when this process was forked.
    void check(const Turn::Taken& taken)
    {
        was_abandoned = was_abandoned || taken.was_abandoned();
        if (was_abandoned)
            throw std::logic_error("this process was forked while another thread used the renderer: reset() it");
    }

    ProgressiveRenderer renderer;
    const ColorEncoding encoding;
    Turn turn;
    bool was_abandoned = false; ///< needs the turn
};

void step(SceneRenderer& self, int samples, const py::object& progress)
{
    long_call("to render", progress, [&](const Progress& report) {
        const Turn::Taken taken(self.turn, report);
        self.check(taken);
        self.renderer.step(samples, report);
    });
}

void reset(SceneRenderer& self, const std::optional<Camera>& camera)
{
    long_call("to begin a picture", py::none(), [&](const Progress& progress) {
        const Turn::Taken taken(self.turn, progress);
        self.was_abandoned = false;
        if (camera)
            self.renderer.reset(*camera);
        else
            self.renderer.reset();
    });
}

} // namespace

void bind_path_tracer(py::module_& module)
{
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
                         const py::object& background, const py::object& layers, int ambient_occlusion_samples,
                         const std::string& encoding) {
                 return naming_memory("to render " + size_text(size[0], size[1]), [&] {
                     return std::make_unique<SceneRenderer>(scene, camera, glm::ivec2(size[0], size[1]), integrator,
                                                            as_background(background, "background"),
                                                            as_layers(layers, ambient_occlusion_samples),
                                                            as_enum(color_encodings, encoding, "encoding"));
                 });
             }),
             py::keep_alive<1, 2>(), py::arg("scene"), py::arg("camera"), py::kw_only(), py::arg("size"),
             py::arg("integrator"), py::arg("background"), py::arg("layers"), py::arg("ambient_occlusion_samples"),
             py::arg("encoding"))
        .def("step", &step, py::arg("samples"), py::kw_only(), py::arg("progress"))
        .def("reset", &reset, py::arg("camera"))
        .def("image",
             [](SceneRenderer& self) {
                 auto image = std::make_unique<Image>();
                 long_call("to copy the image", py::none(), [&](const Progress& progress) {
                     const Turn::Taken taken(self.turn, progress);
                     self.check(taken);
                     *image = self.renderer.image(self.encoding);
                 });
                 return image;
             })
        .def_property_readonly("samples", [](SceneRenderer& self) {
            int samples = 0;
            long_call("to count samples", py::none(), [&](const Progress& progress) {
                const Turn::Taken taken(self.turn, progress);
                self.check(taken);
                samples = self.renderer.samples();
            });
            return samples;
        });
}

} // namespace isospline
