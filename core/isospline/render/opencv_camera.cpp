#include "isospline/render/opencv_camera.h"

#include "isospline/render/projection.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace isospline {

namespace {

void check_intrinsics(const glm::dmat3& k)
{
    for (int column = 0; column < 3; ++column)
        check_finite("intrinsics", k[column]);
    const bool triangular = k[0][1] == 0.0 && k[0][2] == 0.0 && k[1][2] == 0.0 && k[2][2] == 1.0;
    if (!triangular || !(k[0][0] > 0.0 && k[1][1] > 0.0))
        throw_invalid("intrinsics", "rows (fx, skew, cx), (0, fy, cy) and (0, 0, 1) with fx and fy above 0",
                      "columns " + to_text(k[0]) + ", " + to_text(k[1]) + ", " + to_text(k[2]));
}

void check_rotation(const glm::dmat3& r)
{
    const glm::dmat3 product = glm::transpose(r) * r;
    double deviation = 0.0;
    for (int column = 0; column < 3; ++column) {
        check_finite("rotation", r[column]);
        for (int row = 0; row < 3; ++row)
            deviation = std::max(deviation, std::abs(product[column][row] - (row == column ? 1.0 : 0.0)));
    }
    if (deviation > 1e-5)
        throw_invalid("rotation", "a rotation: columns of unit length, perpendicular to each other",
                      "R^T R that is off the identity by " + to_text(deviation));
    if (glm::determinant(r) < 0.0)
        throw_invalid("rotation", "a rotation", "a reflection, of determinant -1");
}

/// Maps a raster position (x, y, 1) to pixel coordinates (u, v, 1).
glm::dmat3 raster_to_pixel(double pixel_center)
{
    const double shift = pixel_center - 0.5;
    return {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, shift, shift, 1.0};
}

} // namespace

ProjectionPlaneCamera from_opencv(const OpenCvCamera& camera, glm::ivec2 size)
{
    check_intrinsics(camera.intrinsics);
    check_rotation(camera.rotation);
    check_finite("translation", camera.translation);
    if (!is_finite(camera.pixel_center))
        throw_invalid("pixel_center", "a finite number", camera.pixel_center);

    // The plane at depth 1: E + R^T K^-1 (u, v, 1).
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    const glm::dmat3 to_plane = to_world * glm::inverse(camera.intrinsics) * raster_to_pixel(camera.pixel_center);
    const glm::dvec3 eye = -(to_world * camera.translation);
    const ProjectionPlaneCamera plane{eye, eye + to_plane[2], static_cast<double>(size.x) * to_plane[0],
                                      static_cast<double>(size.y) * to_plane[1], camera.distortion};
    Projection(plane, size); // which checks size and distortion
    return plane;
}

OpenCvCamera to_opencv(const Camera& camera, glm::ivec2 size, double pixel_center)
{
    if (std::holds_alternative<OrthographicCamera>(camera) || std::holds_alternative<PanoramicCamera>(camera))
        throw_invalid("camera", "a pinhole", "one that is orthographic or panoramic");
    if (!is_finite(pixel_center))
        throw_invalid("pixel_center", "a finite number", pixel_center);
    Camera pinhole = camera;
    LensDistortion distortion;
    if (auto* const plane = std::get_if<ProjectionPlaneCamera>(&pinhole))
        std::swap(distortion, plane->distortion);
    const Projection projection(pinhole, size);
    const glm::dmat3 rotation = glm::transpose(glm::dmat3(projection.right(), -projection.up(), projection.forward()));
    if (glm::determinant(rotation) < 0.0)
        throw_invalid("camera", "one whose image is not mirrored", "edges that turn the other way around");

    // K^-1 takes (u, v, 1) to the point of its ray at depth 1. Rounding may leave traces below its diagonal.
    const Ray corner = projection.ray({0.0, 0.0});
    const glm::dvec3 right = projection.ray({1.0, 0.0}).direction - corner.direction;
    const glm::dvec3 down = projection.ray({0.0, 1.0}).direction - corner.direction;
    const double distance = glm::dot(corner.direction, projection.forward());
    const glm::dmat3 raster_to_camera = rotation * glm::dmat3(right, down, corner.direction) * (1.0 / distance);
    glm::dmat3 intrinsics = raster_to_pixel(pixel_center) * glm::inverse(raster_to_camera);
    intrinsics[0][1] = intrinsics[0][2] = intrinsics[1][2] = 0.0;
    intrinsics[2][2] = 1.0;
    return {intrinsics, rotation, -(rotation * corner.origin), pixel_center, distortion};
}

} // namespace isospline
