#include "bind.h"
#include "cameras.h"
#include "colors.h"
#include "environment.h"
#include "layers.h"
#include "long_call.h"
#include "looks.h"

#include "isospline/render/progressive.h"
#include "isospline/scene/scene.h"
#include "isospline/util/cancellable_mutex.h"

#include <algorithm>
#include <array>
#include <cstdint>
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

/// A renderer that serves one caller at a time.
struct SceneRenderer {
    SceneRenderer(Scene& rendered, const Camera& camera, const glm::ivec2& size, PathTracer path_tracer,
                  const glm::vec4& background, const Layers& layers, ColorEncoding color_encoding, const Crop& crop)
        : renderer(rendered, camera, size, std::move(path_tracer), background, layers, as_window(crop)),
          encoding(color_encoding)
    {
    }

    /// Throws if a call in the parent process had not finished when this process was forked.
    void check(const CancellableMutex::Lock& lock)
    {
        was_abandoned = was_abandoned || lock.is_taken_over();
        if (was_abandoned)
            throw std::logic_error("this process was forked while another thread used the renderer: reset() it");
    }

    ProgressiveRenderer renderer;
    const ColorEncoding encoding;
    CancellableMutex mutex;     ///< of the renderer, for one caller at a time
    bool was_abandoned = false; ///< under the mutex
};

void step(SceneRenderer& self, int samples, const py::object& progress)
{
    long_call("to render", progress, [&](const Progress& report) {
        const CancellableMutex::Lock lock(self.mutex, report);
        self.check(lock);
        self.renderer.step(samples, report);
    });
}

constexpr int parts_of_sum = sizeof(PathSums::Sum) / sizeof(double);
static_assert(parts_of_sum == 7 && sizeof(glm::dvec3) == 3 * sizeof(double));

/// How many numbers an item has. clang-tidy takes this for the length of an array.
template <typename Number, typename Item>
constexpr py::ssize_t numbers_of = sizeof(Item) / sizeof(Number); // NOLINT(bugprone-sizeof-expression)

/// A copy of the numbers, pixel by pixel.
template <typename Number, typename Item>
py::array_t<Number> rows_of(const std::vector<Item>& items)
{
    constexpr py::ssize_t columns = numbers_of<Number, Item>;
    auto array = new_array<Number>(Shape{static_cast<py::ssize_t>(items.size()), columns});
    std::copy_n(reinterpret_cast<const Number*>(items.data()), array.size(), array.mutable_data());
    return array;
}

template <typename Number, typename Item>
std::vector<Item> items_of(const py::dict& state, const char* name, const char* parameter)
{
    const auto rows = state.contains(name) ? state[name].cast<py::object>() : py::object(py::none());
    constexpr py::ssize_t columns = numbers_of<Number, Item>;
    const char* const expected = "the arrays of ProgressiveRenderer.state()";
    if (!py::isinstance<py::array_t<Number>>(rows))
        throw_invalid(parameter, expected, std::string("another type of ") + name);
    const py::array_t<Number, py::array::c_style | py::array::forcecast> numbers(rows);
    if (numbers.ndim() != 2 || numbers.shape(1) != columns)
        throw_invalid(parameter, expected, std::string(name) + " of shape " + to_text(shape_of(numbers)));
    std::vector<Item> items(static_cast<std::size_t>(numbers.shape(0)));
    std::copy_n(numbers.data(), numbers.size(), reinterpret_cast<Number*>(items.data()));
    return items;
}

/// The state of the samples so far, for checkpoints.
py::dict state(SceneRenderer& self)
{
    PathSums sums;
    long_call("to copy the samples", py::none(), [&](const Progress& progress) {
        const CancellableMutex::Lock lock(self.mutex, progress);
        self.check(lock);
        sums = self.renderer.path_sums();
    });
    py::dict arrays;
    arrays["sums"] = rows_of<double>(sums.sums);
    arrays["directs"] = rows_of<double>(sums.directs);
    arrays["tile_samples"] = rows_of<std::int32_t>(sums.tile_samples);
    arrays["through_centers"] = sums.through_centers;
    return arrays;
}

void resume(SceneRenderer& self, const py::dict& arrays, const py::object& progress)
{
    constexpr const char* parameter = "checkpoint";
    PathSums sums{items_of<double, PathSums::Sum>(arrays, "sums", parameter),
                  items_of<double, glm::dvec3>(arrays, "directs", parameter),
                  items_of<std::int32_t, int>(arrays, "tile_samples", parameter), py::bool_(arrays["through_centers"])};
    long_call("to continue a picture", progress, [&](const Progress& report) {
        const CancellableMutex::Lock lock(self.mutex, report);
        self.check(lock);
        self.renderer.resume(std::move(sums), parameter, report);
    });
}

void reset(SceneRenderer& self, const std::optional<Camera>& camera)
{
    long_call("to begin a picture", py::none(), [&](const Progress& progress) {
        const CancellableMutex::Lock lock(self.mutex, progress);
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
    py::class_<PathTracer>(module, "PathTracer")
        .def(py::init([](const Material& material, std::map<std::uint32_t, Material> materials,
                         std::optional<std::vector<Emitter>> lights, int max_bounces, std::uint32_t seed) {
                 PathTracer path_tracer{material, std::move(materials), {EnvironmentLight{}}, max_bounces, seed};
                 if (lights)
                     path_tracer.lights = std::move(*lights);
                 validate(path_tracer);
                 return path_tracer;
             }),
             py::arg("material"), py::kw_only(), py::arg("materials") = py::dict(), py::arg("lights") = py::none(),
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

    py::class_<SceneRenderer>(module, "ProgressiveRenderer")
        .def(py::init([](Scene& scene, const Camera& camera, std::array<int, 2> size, const PathTracer& path_tracer,
                         const py::object& background, const py::object& layers, int ambient_occlusion_samples,
                         const std::string& encoding, const Crop& crop) {
                 return naming_memory("to render " + size_text(size[0], size[1]), [&] {
                     return std::make_unique<SceneRenderer>(scene, camera, glm::ivec2(size[0], size[1]), path_tracer,
                                                            as_background(background, "background"),
                                                            as_layers(layers, ambient_occlusion_samples),
                                                            as_enum(color_encodings, encoding, "encoding"), crop);
                 });
             }),
             py::keep_alive<1, 2>(), py::arg("scene"), py::arg("camera"), py::kw_only(), py::arg("size"),
             py::arg("path_tracer"), py::arg("background"), py::arg("layers"), py::arg("ambient_occlusion_samples"),
             py::arg("encoding"), py::arg("crop") = py::none())
        .def("step", &step, py::arg("samples"), py::kw_only(), py::arg("progress"))
        .def("reset", &reset, py::arg("camera"))
        .def("state", &state)
        .def("resume", &resume, py::arg("state"), py::kw_only(), py::arg("progress"))
        .def_property_readonly("noise",
                               [](SceneRenderer& self) {
                                   double noise = 0.0;
                                   long_call("to measure noise", py::none(), [&](const Progress& progress) {
                                       const CancellableMutex::Lock lock(self.mutex, progress);
                                       self.check(lock);
                                       noise = self.renderer.noise();
                                   });
                                   return noise;
                               })
        .def("image",
             [](SceneRenderer& self) {
                 auto image = std::make_unique<Image>();
                 long_call("to copy the image", py::none(), [&](const Progress& progress) {
                     const CancellableMutex::Lock lock(self.mutex, progress);
                     self.check(lock);
                     *image = self.renderer.image(self.encoding);
                 });
                 return image;
             })
        .def_property_readonly("samples", [](SceneRenderer& self) {
            int samples = 0;
            long_call("to count samples", py::none(), [&](const Progress& progress) {
                const CancellableMutex::Lock lock(self.mutex, progress);
                self.check(lock);
                samples = self.renderer.samples();
            });
            return samples;
        });
}

} // namespace isospline
