#include "catch.h"

#include "isospline/render/opencv_camera.h"
#include "isospline/render/projection.h"

#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <limits>

using namespace isospline;

namespace {

const glm::ivec2 size(640, 360);

OpenCvCamera some_camera()
{
    const glm::dmat3 intrinsics(810, 0, 0, 2.5, 790, 0, 300.25, 190.75, 1);
    const glm::dmat3 rotation(glm::rotate(glm::dmat4(1.0), 2.1, glm::dvec3(1, -2, 0.5)));
    return {intrinsics, rotation, {0.3, -1.2, 6.5}, 0.0};
}

} // namespace

TEST_CASE("a ray of an OpenCV camera goes through the points that K [R | t] maps to its pixel", "[render]")
{
    OpenCvCamera camera = some_camera();
    for (const double pixel_center : {0.0, 0.5}) {
        camera.pixel_center = pixel_center;
        const Projection projection(from_opencv(camera, size), size);
        for (const glm::ivec2 pixel : {glm::ivec2(0, 0), glm::ivec2(639, 0), glm::ivec2(311, 207)}) {
            const glm::dvec3 point = projection.ray(glm::dvec2(pixel) + 0.5).at(3.7);
            const glm::dvec3 image = camera.intrinsics * (camera.rotation * point + camera.translation);
            REQUIRE(image.z == Approx(3.7)); // t is the depth
            REQUIRE(image.x / image.z == Approx(pixel.x + pixel_center).margin(1e-9));
            REQUIRE(image.y / image.z == Approx(pixel.y + pixel_center).margin(1e-9));
        }
    }
}

TEST_CASE("a camera that goes to OpenCV and back is the same", "[render]")
{
    const OpenCvCamera camera = some_camera();
    const OpenCvCamera again = to_opencv(from_opencv(camera, size), size);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) {
            REQUIRE(again.intrinsics[column][row] == Approx(camera.intrinsics[column][row]).margin(1e-9));
            REQUIRE(again.rotation[column][row] == Approx(camera.rotation[column][row]).margin(1e-12));
        }
    for (int axis = 0; axis < 3; ++axis)
        REQUIRE(again.translation[axis] == Approx(camera.translation[axis]).margin(1e-12));
}

TEST_CASE("cameras that OpenCV's form does not describe are refused", "[render]")
{
    const auto refused = [](const OpenCvCamera& camera, const char* parameter) {
        REQUIRE_THROWS_WITH(from_opencv(camera, size), ContainsSubstring(parameter));
    };
    OpenCvCamera camera = some_camera();
    camera.intrinsics[0][1] = 1.0;
    refused(camera, "intrinsics");
    camera = some_camera();
    camera.intrinsics[1][1] = -790.0;
    refused(camera, "intrinsics");
    camera = some_camera();
    camera.rotation = 1.1 * camera.rotation;
    refused(camera, "rotation");
    camera.rotation = glm::dmat3(-1.0);
    refused(camera, "reflection");
    camera = some_camera();
    camera.translation.y = std::numeric_limits<double>::quiet_NaN();
    refused(camera, "translation");
    REQUIRE_THROWS_WITH(from_opencv(some_camera(), {0, 3}), ContainsSubstring("size"));

    REQUIRE_THROWS_WITH(to_opencv(OrthographicCamera{}, size), ContainsSubstring("pinhole"));
    REQUIRE_THROWS_WITH(to_opencv(PanoramicCamera{}, size), ContainsSubstring("pinhole"));
    const ProjectionPlaneCamera mirrored{{0, 9, 0}, {-1, 2, 1}, {2, 0, 0}, {0, 0, -1}};
    REQUIRE_THROWS_WITH(to_opencv(mirrored, size), ContainsSubstring("mirrored"));
}
