#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/render/interleaved.h"
#include "isospline/util/error.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;

py::array_t<float> array_of(const std::vector<float>& numbers, const glm::ivec2& size)
{
    auto array = new_array<float>(Shape{size.y, size.x});
    std::copy(numbers.begin(), numbers.end(), array.mutable_data());
    return array;
}

std::vector<py::array_t<float>> seen_parts_of(const std::vector<std::pair<const Image*, const Image*>>& lights,
                                              const Image& guides)
{
    const std::size_t count = guides.pixel_count();
    for (const std::size_t size : {guides.position.size(), guides.normal.size(), guides.geometry_ids.size()})
        if (size != count)
            throw_invalid("guides", "the layers position, normal and geometry_ids", "an image without one of them");
    std::vector<PicturesOfLight> pictures;
    for (const auto& [lit, unhidden] : lights) {
        for (const Image* const image : {lit, unhidden})
            if (image == nullptr || image->size != guides.size || image->color.size() != count)
                throw_invalid("lights", "linear images of the guides' size", "another");
        pictures.push_back({lit, unhidden});
    }
    std::vector<std::vector<float>> parts;
    long_call("to average light", py::none(),
              [&](const Progress& progress) { parts = seen_parts(pictures, guides, progress); });
    std::vector<py::array_t<float>> arrays;
    for (const std::vector<float>& part : parts)
        arrays.push_back(array_of(part, guides.size));
    return arrays;
}

py::array_t<float> mean_of(const FloatArray& numbers, const FloatArray& weights)
{
    if (numbers.ndim() != 2 || weights.ndim() != 2 || numbers.shape(0) != weights.shape(0) ||
        numbers.shape(1) != weights.shape(1))
        throw_invalid("weights", "the shape of numbers, (height, width)", "another");
    const glm::ivec2 size(numbers.shape(1), numbers.shape(0));
    const std::span given(numbers.data(), static_cast<std::size_t>(numbers.size()));
    const std::span given_weights(weights.data(), static_cast<std::size_t>(weights.size()));
    std::vector<float> means;
    long_call("to average light", py::none(),
              [&](const Progress& progress) { means = mean_on_plane(size, given, given_weights, progress); });
    return array_of(means, size);
}

} // namespace

void bind_interleaved(py::module_& module)
{
    module.attr("BLOCK_REACH") = block_reach;
    module.def("seen_parts", &seen_parts_of, py::arg("lights"), py::arg("guides"));
    module.def("mean_on_plane", &mean_of, py::arg("numbers"), py::arg("weights"));
}

} // namespace isospline
