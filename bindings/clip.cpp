#include "clip.h"

#include "arrays.h"
#include "mistakes.h"
#include "values.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

void add_clip(std::vector<HalfSpace>& clip, const py::handle& part)
{
    if (is_value(part, "HalfSpace")) {
        const glm::dvec3 point = as_vector(part.attr("point"), "point");
        const glm::dvec3 normal = as_vector(part.attr("normal"), "normal");
        const glm::dvec3 scaled = normal / std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
        clip.push_back({scaled, glm::dot(scaled, point)});
    } else if (is_value(part, "Box")) {
        const auto sides =
            half_spaces(Box{as_vector(part.attr("minimum"), "minimum"), as_vector(part.attr("maximum"), "maximum")});
        clip.insert(clip.end(), sides.begin(), sides.end());
    } else {
        throw_wrong_type("clip", "a HalfSpace, a Box or a sequence of them", part);
    }
}

} // namespace

std::vector<HalfSpace> as_clip(const py::object& value)
{
    std::vector<HalfSpace> clip;
    if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
        for (const py::handle part : value)
            add_clip(clip, part);
    } else if (!value.is_none()) {
        add_clip(clip, value);
    }
    return clip;
}

} // namespace isospline
