#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/scene/scene.h"
#include "isospline/util/parallel.h"

#include <cmath>
#include <string>

namespace py = pybind11;

namespace isospline {

namespace {

/// One array of the hits.
template <typename Number>
py::array_t<Number, py::array::c_style | py::array::forcecast> hit_array(const py::dict& hits, const char* name,
                                                                         const Shape& shape)
{
    const std::string parameter = std::string("hits[\"") + name + "\"]";
    if (!hits.contains(name))
        throw_invalid("hits", std::string("what cast_rays returned, with \"") + name + "\" among its outputs",
                      "a dict without");
    const py::array array = as_array(hits[name], parameter.c_str(), "iuf");
    if (array.dtype().is(py::dtype::of<float>()))
        throw_invalid(parameter.c_str(), "float64, to tell on which side of the surface a ray begins", "float32");
    if (shape_of(array) != shape)
        throw_invalid(parameter.c_str(), "shape " + to_text(shape), to_text(shape_of(array)));
    return array;
}

py::array_t<double> secondary_rays(Scene& scene, const py::object& rays, const py::dict& hits,
                                   const py::object& directions)
{
    const RowArray rows(rays, "rays", 6), towards(directions, "directions", 3);
    const Shape shape = rows.leading_shape();
    if (towards.leading_shape() != shape)
        throw_invalid("directions", "one for each of the rays, " + to_text(shape), to_text(towards.leading_shape()));
    const auto t_hit = hit_array<double>(hits, "t_hit", shape);
    Shape vectors = shape;
    vectors.push_back(3);
    const auto normals = hit_array<double>(hits, "primitive_normals", vectors);
    const auto geometry_ids = hit_array<std::uint32_t>(hits, "geometry_ids", shape);
    const auto primitive_ids = hit_array<std::uint64_t>(hits, "primitive_ids", shape);

    py::array_t<double> result = new_array<double>(shape, {6});
    double* const origins = result.mutable_data();
    const double *const t = t_hit.data(), *const normal = normals.data();
    const std::uint32_t* const geometries = geometry_ids.data();
    const std::uint64_t* const primitives = primitive_ids.data();
    long_call("to make " + std::to_string(rows.count()) + " rays", py::none(), [&](const Progress& progress) {
        const auto snapshot = scene.snapshot(progress);
        for (std::size_t i = 0; i < rows.count(); ++i) {
            const auto in_ray = " in ray " + std::to_string(i);
            if (!std::isfinite(t[i]))
                throw_invalid("hits", "a hit of every ray", "a miss" + in_ray);
            const glm::dvec3 direction = towards.vector(i);
            if (!std::isfinite(glm::dot(direction, direction)) || direction == glm::dvec3(0.0))
                throw_invalid("directions", "finite ones that are not zero", "another" + in_ray);
        }
        parallel_for(
            rows.count(), 1024,
            [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    Hit hit;
                    hit.t = t[i];
                    hit.position = rows.vector(i, 0) + t[i] * rows.vector(i, 3);
                    hit.normal = {normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]};
                    hit.geometry_id = geometries[i];
                    hit.primitive_id = primitives[i];
                    const glm::dvec3 direction = towards.vector(i);
                    const glm::dvec3 origin = snapshot->offset_position(hit, direction);
                    for (int axis = 0; axis < 3; ++axis) {
                        origins[6 * i + static_cast<std::size_t>(axis)] = origin[axis];
                        origins[6 * i + 3 + static_cast<std::size_t>(axis)] = direction[axis];
                    }
                }
            },
            progress);
    });
    return result;
}

} // namespace

void bind_secondary_rays(py::module_& module)
{
    py::class_<Scene> scene(module.attr("Scene"));
    scene.def("secondary_rays", &secondary_rays);
}

} // namespace isospline
