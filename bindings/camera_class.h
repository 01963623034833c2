// The common members of all camera classes in Python.
#pragma once

#include "arrays.h"
#include "long_call.h"

#include "isospline/render/camera.h"
#include "isospline/render/projection.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <array>

namespace isospline {

/// Returns the camera after checking that it gives an image.
template <typename GivenCamera>
GivenCamera checked(const GivenCamera& camera)
{
    Projection(camera, glm::ivec2(1));
    return camera;
}

inline pybind11::array_t<double> rays_of(const Camera& camera, std::array<int, 2> size)
{
    const Projection projection(camera, {size[0], size[1]});
    auto rays = new_array<double>({size[1], size[0]}, {6});
    auto values = rays.mutable_unchecked<3>();
    long_call("to make the rays of " + size_text(size[0], size[1]), pybind11::none(), [&](const Progress& progress) {
        const auto fill = [&](std::size_t begin, std::size_t end) {
            for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
                for (int x = 0; x < size[0]; ++x) {
                    const Ray ray = projection.ray({x + 0.5, y + 0.5});
                    for (int axis = 0; axis < 3; ++axis) {
                        values(y, x, axis) = ray.origin[axis];
                        values(y, x, axis + 3) = ray.direction[axis];
                    }
                }
        };
        parallel_for(static_cast<std::size_t>(size[1]), 4, fill, progress);
    });
    return rays;
}

template <typename GivenCamera>
pybind11::class_<GivenCamera> bind_camera_class(pybind11::module_& module, const char* name, const char* documentation)
{
    return pybind11::class_<GivenCamera>(module, name, documentation)
        .def(
            "rays", [](const GivenCamera& camera, std::array<int, 2> size) { return rays_of(camera, size); },
            pybind11::arg("size"), R"(The rays through the centres of all pixels.

Parameters
----------
size : (int, int)
    Width and height of the image in pixels.

Returns
-------
(height, width, 6) float64 array
    Origins and directions, world units; the first pixel is the top left one. A direction of a perspective camera
    has the component 1 along the viewing direction, so that t is the depth. A direction of a projection plane goes
    from the eye to the plane. All others have unit length. With a lens, these are the rays through its centre.
)")
        .def_property_readonly(
            "world_to_camera",
            [](const GivenCamera& camera) { return Projection(camera, glm::ivec2(1)).world_to_camera(); },
            R"((4, 4) float64 array: maps column vectors of world space to camera space.

Camera space is that of OpenEXR and RenderMan: x to the right, y up, z forward from the eye; it is left-handed.)");
}

/// For cameras that a matrix describes.
template <typename GivenCamera>
void bind_world_to_ndc(pybind11::class_<GivenCamera>& camera_class)
{
    camera_class.def(
        "world_to_ndc",
        [](const GivenCamera& camera, std::array<int, 2> size) {
            const auto matrix = Projection(camera, {size[0], size[1]}).world_to_ndc();
            if (!matrix)
                throw_invalid("camera", "one whose lens has no distortion, which no matrix describes", "one that has");
            return *matrix;
        },
        pybind11::arg("size"), R"(Maps column vectors of world space to the image; divide by the fourth part.

(0, 0) is the top left corner of the image and (1, 1) the bottom right one, as in OpenEXR and RenderMan.

Parameters
----------
size : (int, int)
    Width and height of the image in pixels.

Returns
-------
(4, 4) float64 array

Raises
------
ValueError
    For a lens with distortion, which no matrix describes.
)");
}

} // namespace isospline
