#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/scene/scene.h"
#include "isospline/util/check.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

py::array_t<double> extent_of(Scene& scene, const py::object& directions)
{
    const RowArray rows(directions, "directions", 3);
    std::vector<glm::dvec3> both_ways;
    for (std::size_t i = 0; i < rows.count(); ++i) {
        check_finite("directions", rows.vector(i));
        both_ways.push_back(-rows.vector(i));
        both_ways.push_back(rows.vector(i));
    }
    auto result = new_array<double>(rows.leading_shape(), {2});
    double* next = result.mutable_data();
    long_call("to find the extent of a scene", py::none(), [&](const Progress& progress) {
        const std::vector<double> reach = scene.snapshot(progress)->reach(both_ways, progress);
        for (std::size_t i = 0; i < reach.size(); ++i)
            *next++ = i % 2 == 0 ? -reach[i] : reach[i];
    });
    return result;
}

} // namespace

void bind_extent(py::module_& module)
{
    py::class_<Scene, std::shared_ptr<Scene>>(module.attr("Scene")).def("extent", &extent_of);
}

} // namespace isospline
