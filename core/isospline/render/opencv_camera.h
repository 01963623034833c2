// Cameras in the form of OpenCV and most photogrammetry software.
#pragma once

#include "isospline/render/camera.h"

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace isospline {

/// A pinhole in OpenCV's form: the point X of the world appears at (u, v), with w (u, v, 1) = K (R X + t) and w > 0.
/// x points to the right, y down and z forward. With distortion, K is applied to the distorted X / Z and
/// Y / Z.
struct OpenCvCamera {
    glm::dmat3 intrinsics{1.0};  ///< K: focal lengths, skew and principal point in pixels; last row (0, 0, 1)
    glm::dmat3 rotation{1.0};    ///< R, world to camera
    glm::dvec3 translation{0.0}; ///< t
    /// u and v in the centre of the top left pixel: 0 in OpenCV, 1/2 in COLMAP and others.
    double pixel_center = 0.0;
    LensDistortion distortion{};
};

/// The camera with the same rays for an image of a size. Throws std::invalid_argument for numbers that are not
/// finite, a K that is not upper triangular with positive focal lengths and a last row of (0, 0, 1), an R that is not
/// a rotation, and a distortion that folds the image.
ProjectionPlaneCamera from_opencv(const OpenCvCamera& camera, glm::ivec2 size);

/// The inverse. A lens is ignored. Throws std::invalid_argument for cameras that are not a pinhole (orthographic,
/// panoramic) and for those whose image is mirrored.
OpenCvCamera to_opencv(const Camera& camera, glm::ivec2 size, double pixel_center = 0.0);

} // namespace isospline
