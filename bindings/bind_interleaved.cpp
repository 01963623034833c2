#include "arrays.h"
#include "bind.h"
#include "long_call.h"

#include "isospline/render/interleaved.h"
#include "isospline/render/tiles.h"
#include "isospline/util/error.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace py = pybind11;

namespace isospline {

namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using BoolArray = py::array_t<bool, py::array::c_style | py::array::forcecast>;
using TwoPictures = std::pair<const Image*, const Image*>;

template <typename Number, typename Given>
py::array_t<Number> array_of(const std::vector<Given>& numbers, const glm::ivec2& size)
{
    auto array = new_array<Number>(Shape{size.y, size.x});
    std::copy(numbers.begin(), numbers.end(), array.mutable_data());
    return array;
}

/// Numbers (height, width) of pixels.
template <typename Array>
glm::ivec2 size_of(const Array& numbers, const char* parameter)
{
    if (numbers.ndim() != 2)
        throw_invalid(parameter, "shape (height, width)", numbers.ndim());
    return {numbers.shape(1), numbers.shape(0)};
}

PixelMask as_pixel_mask(const BoolArray& mask, const char* parameter, const glm::ivec2& size)
{
    if (size_of(mask, parameter) != size)
        throw_invalid(parameter, "a bool for each pixel", mask.size());
    return {mask.data(), mask.data() + mask.size()};
}

void check_picture(const Image* image, const glm::ivec2& size, const char* parameter)
{
    if (image == nullptr || image->size != size || image->color.size() != image->pixel_count())
        throw_invalid(parameter, "linear images of one size", "another");
}

void check_guides(const Image& guides)
{
    for (const std::size_t size : {guides.position.size(), guides.normal.size(), guides.geometry_ids.size()})
        if (size != guides.pixel_count())
            throw_invalid("guides", "the layers position, normal and geometry_ids", "an image without one of them");
}

/// The result of `make(progress)`, without Python's lock.
template <typename Make>
auto averaged(const Make& make)
{
    decltype(make(Progress())) result;
    long_call("to average light", py::none(), [&](const Progress& progress) { result = make(progress); });
    return result;
}

py::array_t<bool> edges_of(const Image& guides)
{
    check_guides(guides);
    return array_of<bool>(averaged([&](const Progress& progress) { return edges(guides, progress); }), guides.size);
}

py::array_t<bool> uneven_pixels_of(const std::vector<std::pair<const Image*, float>>& sum, const Image& guides,
                                   const BoolArray& edges)
{
    check_guides(guides);
    const glm::ivec2 size = guides.size;
    std::vector<PictureInSum> pictures;
    for (const auto& [picture, weight] : sum) {
        check_picture(picture, size, "sum");
        pictures.push_back({picture, weight});
    }
    if (pictures.empty())
        throw_invalid("sum", "at least one picture", 0);
    const PixelMask given = as_pixel_mask(edges, "edges", size);
    return array_of<bool>(
        averaged([&](const Progress& progress) { return uneven_pixels(pictures, guides, given, progress); }), size);
}

/// The parts of two lights, (2, 1 or 3, height, width).
py::array_t<float> seen_parts_of(const std::array<TwoPictures, light_count>& lights, const Image& guides,
                                 const BoolArray& edges, const BoolArray& mask, int step, bool by_channel)
{
    check_guides(guides);
    checked_step(step);
    std::array<PicturesOfLight, light_count> pictures{};
    for (std::size_t i = 0; i < light_count; ++i) {
        const auto& [lit, unhidden] = lights[i];
        check_picture(lit, guides.size, "lights");
        check_picture(unhidden, guides.size, "lights");
        pictures[i] = {lit, unhidden};
    }
    const PixelMask at_edges = as_pixel_mask(edges, "edges", guides.size);
    const PixelMask wanted = as_pixel_mask(mask, "mask", guides.size);
    const PartsOfLight kind = by_channel ? PartsOfLight::by_channel : PartsOfLight::one;
    const LightParts parts = averaged(
        [&](const Progress& progress) { return seen_parts(pictures, kind, guides, at_edges, wanted, step, progress); });
    constexpr auto lights_in_all = static_cast<py::ssize_t>(light_count);
    const auto channels = static_cast<py::ssize_t>(parts.size()) / lights_in_all;
    auto array = new_array<float>(Shape{lights_in_all, channels, guides.size.y, guides.size.x});
    float* to = array.mutable_data();
    for (const std::vector<float>& part : parts)
        to = std::copy(part.begin(), part.end(), to);
    return array;
}

py::array_t<float> changes_of(const FloatArray& parts, const Image& guides, const BoolArray& edges)
{
    check_guides(guides);
    const std::size_t count = guides.pixel_count();
    if (parts.ndim() != 4 || parts.shape(0) * parts.shape(1) == 0 || parts.shape(2) != guides.size.y ||
        parts.shape(3) != guides.size.x)
        throw_invalid("parts", "shape (lights, channels, height, width)", to_text(shape_of(parts)));
    LightParts given;
    for (const float* from = parts.data(); from != parts.data() + parts.size(); from += count)
        given.emplace_back(from, from + count);
    const PixelMask at_edges = as_pixel_mask(edges, "edges", guides.size);
    return array_of<float>(
        averaged([&](const Progress& progress) { return changes(given, guides, at_edges, progress); }), guides.size);
}

py::array_t<float> mean_of(const FloatArray& numbers, const FloatArray& weights, std::array<int, 2> first, int step)
{
    checked_step(step);
    const glm::ivec2 size = size_of(numbers, "numbers");
    if (size_of(weights, "weights") != size)
        throw_invalid("weights", "the shape of numbers, (height, width)", "another");
    const std::span given(numbers.data(), static_cast<std::size_t>(numbers.size()));
    const std::span given_weights(weights.data(), static_cast<std::size_t>(weights.size()));
    return array_of<float>(averaged([&](const Progress& progress) {
                               return mean_on_plane(size, {first[0], first[1]}, given, given_weights, step, progress);
                           }),
                           size);
}

py::array_t<float> changes_on_plane_of(const FloatArray& means)
{
    const glm::ivec2 size = size_of(means, "means");
    const std::span given(means.data(), static_cast<std::size_t>(means.size()));
    return array_of<float>(averaged([&](const Progress& progress) { return changes_on_plane(size, given, progress); }),
                           size);
}

py::array_t<bool> widened_mask(const BoolArray& mask, int reach)
{
    const glm::ivec2 size = size_of(mask, "mask");
    const PixelMask given = as_pixel_mask(mask, "mask", size);
    return array_of<bool>(averaged([&](const Progress& progress) { return widened(size, given, reach, progress); }),
                          size);
}

} // namespace

void bind_interleaved(py::module_& module)
{
    module.attr("COARSE_STEP") = coarse_step;
    module.attr("FINE_REACH") = fine_reach;
    module.attr("COARSE_REACH") = coarse_reach;
    module.def("edges", &edges_of, py::arg("guides"));
    module.def("uneven_pixels", &uneven_pixels_of, py::arg("sum"), py::arg("guides"), py::arg("edges"));
    module.def("seen_parts", &seen_parts_of, py::arg("lights"), py::arg("guides"), py::arg("edges"), py::arg("mask"),
               py::arg("step"), py::arg("by_channel"));
    module.def("changes", &changes_of, py::arg("parts"), py::arg("guides"), py::arg("edges"));
    module.def("mean_on_plane", &mean_of, py::arg("numbers"), py::arg("weights"), py::arg("first"), py::arg("step"));
    module.def("changes_on_plane", &changes_on_plane_of, py::arg("means"));
    module.def("widened", &widened_mask, py::arg("mask"), py::arg("reach"));
}

} // namespace isospline
