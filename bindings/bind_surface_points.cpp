#include "arrays.h"
#include "bind.h"
#include "long_call.h"
#include "points.h"
#include "results.h"
#include "thickness_words.h"

#include "isospline/query/sample_surface.h"
#include "isospline/scene/scene.h"
#include "isospline/util/check.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

py::object sample_points(const Isosurface& surface, std::int64_t count, std::int64_t seed, const py::object& progress)
{
    if (count < 0)
        throw_invalid("count", "a number of at least 0", count);
    if (seed < 0 || seed > 0xffffffffll)
        throw_invalid("seed", "0 to 4294967295", seed);
    auto positions = new_array<double>({count, 3}), normals = new_array<double>({count, 3});
    auto ids = new_array<std::uint64_t>({count});
    double *const to_position = positions.mutable_data(), *const to_normal = normals.mutable_data();
    std::uint64_t* const to_id = ids.mutable_data();
    const auto snapshot = surface.snapshot();
    long_call("to sample " + std::to_string(count) + " points", progress, [&](const Progress& report) {
        snapshot->shell(part_of(report, 0.0, 0.1));
        parallel_for(
            static_cast<std::size_t>(count), 256,
            [&](std::size_t begin, std::size_t end) {
                std::vector<SurfaceSample> samples(end - begin);
                sample_surface(*snapshot, static_cast<std::uint32_t>(seed), begin, samples);
                for (std::size_t i = begin; i < end; ++i) {
                    std::copy_n(&samples[i - begin].position[0], 3, to_position + 3 * i);
                    std::copy_n(&samples[i - begin].normal[0], 3, to_normal + 3 * i);
                    to_id[i] = samples[i - begin].primitive_id;
                }
            },
            part_of(report, 0.1, 1.0));
    });
    py::dict result;
    result["points"] = positions;
    result["primitive_ids"] = ids;
    result["primitive_normals"] = normals;
    return as_result("SurfaceSamples", result);
}

py::array_t<double> thickness(const std::shared_ptr<Isosurface>& surface, const py::object& points,
                              const std::string& word, std::optional<double> ripple_height, const py::object& progress)
{
    const RowArray rows(points, "points", 3);
    if (ripple_height)
        check_not_negative("ripple", *ripple_height);
    const double ripple = ripple_height.value_or(default_ripple(*surface));
    const ThicknessMethod method = as_enum(thickness_words, word, "method");
    auto result = new_array<double>(rows.leading_shape());
    double* const to = result.mutable_data();
    long_call("to measure the thickness at " + std::to_string(rows.count()) + " points", progress,
              [&](const Progress& report) {
                  check_points(rows);
                  check_reach(rows);
                  Scene scene;
                  scene.add(std::make_shared<Isosurface>(*surface));
                  const auto shown = scene.snapshot(part_of(report, 0.0, 0.1));
                  const auto& at_level = *std::get<std::shared_ptr<const IsosurfaceSnapshot>>(shown->object(0).object);
                  parallel_for(
                      rows.count(), 64,
                      [&](std::size_t begin, std::size_t end) {
                          std::vector<glm::dvec3> chunk;
                          for (std::size_t row = begin; row < end; ++row)
                              chunk.push_back(rows.vector(row));
                          find_thickness(*shown, at_level, method, ripple, chunk, {to + begin, end - begin});
                      },
                      part_of(report, 0.1, 1.0));
              });
    return result;
}

} // namespace

void bind_surface_points(py::module_& module)
{
    py::class_<Isosurface, std::shared_ptr<Isosurface>>(module.attr("Isosurface"))
        .def("sample_points", &sample_points)
        .def("thickness", &thickness);
}

} // namespace isospline
