#include "catch.h"

#include "isospline/math/affine.h"
#include "isospline/render/projection.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace isospline;

namespace {

const double no_number = std::numeric_limits<double>::quiet_NaN();

void require_close(const glm::dvec3& a, const glm::dvec3& b, double margin = 1e-12)
{
    for (int axis = 0; axis < 3; ++axis)
        REQUIRE(a[axis] == Approx(b[axis]).margin(margin));
}

double degrees_between(const Ray& a, const Ray& b)
{
    const double cosine = glm::dot(glm::normalize(a.direction), glm::normalize(b.direction));
    return glm::degrees(std::acos(cosine));
}

std::vector<Camera> some_cameras()
{
    return {PerspectiveCamera{{3, -5, 2}, {0.5, 0.2, 0.1}, {0, 0, 1}, 35.0},
            PerspectiveCamera{{-1, 4, 7}, {2, 2, 2}, {0.3, 1, 0}, 100.0, FieldOfViewAxis::diagonal},
            ProjectionPlaneCamera{{0.3, -4, 0.2}, {-1, -2, 1}, {2.5, 0.1, 0}, {0.1, 0.3, -1.5}},
            ProjectionPlaneCamera{{0, 9, 0}, {-1, 2, 1}, {2, 0, 0}, {0, 0, -1}}, // mirrored
            OrthographicCamera{{1, 2, -6}, {0, 0, 0}, {0, 1, 0}, 3.0}};
}

} // namespace

TEST_CASE("a look-at camera sees its target in the middle, up upwards and right to the right", "[render]")
{
    const Projection projection(PerspectiveCamera{{0, -2, 0}, {0, 5, 0}, {0, 0.5, 1}, 90.0}, {400, 200});
    require_close(projection.ray({200, 100}).origin, {0, -2, 0});
    require_close(projection.ray({200, 100}).direction, {0, 1, 0});
    require_close(projection.ray({200, 0}).direction, {0, 1, 1});
    require_close(projection.ray({400, 100}).direction, {2, 1, 0});
    require_close(projection.ray({0, 0}).direction, {-2, 1, 1});
    // Pixel (0, 0) is the top left one, half a pixel inside.
    require_close(projection.ray({0.5, 0.5}).direction, {-1.995, 1, 0.995});
}

TEST_CASE("a field of view is measured along its axis", "[render]")
{
    const glm::ivec2 size(300, 160);
    PerspectiveCamera camera{{1, 2, 3}, {-2, 4, 0}, {0, 0, 1}, 50.0, FieldOfViewAxis::vertical};
    Projection projection(camera, size);
    REQUIRE(degrees_between(projection.ray({150, 0}), projection.ray({150, 160})) == Approx(50.0));
    camera.field_of_view_axis = FieldOfViewAxis::horizontal;
    projection = Projection(camera, size);
    REQUIRE(degrees_between(projection.ray({0, 80}), projection.ray({300, 80})) == Approx(50.0));
    camera.field_of_view_axis = FieldOfViewAxis::diagonal;
    projection = Projection(camera, size);
    REQUIRE(degrees_between(projection.ray({0, 0}), projection.ray({300, 160})) == Approx(50.0));
    REQUIRE(projection.pixel_aspect_ratio() == Approx(1.0));
}

TEST_CASE("the paper's camera has t = 1 on its plane", "[render]")
{
    const ProjectionPlaneCamera camera{{0.3, -4, 0.2}, {-1, -2, 1}, {2.5, 0.1, 0}, {0.1, 0.3, -1.5}};
    const Projection projection(camera, {50, 20});
    require_close(projection.ray({0, 0}).at(1.0), camera.corner);
    require_close(projection.ray({50, 0}).at(1.0), camera.corner + camera.right);
    require_close(projection.ray({0, 20}).at(1.0), camera.corner + camera.down);
    require_close(projection.ray({10.5, 7.5}).at(1.0), camera.corner + 0.21 * camera.right + 0.375 * camera.down);
    require_close(projection.ray({3, 4}).at(0.0), camera.eye);

    const glm::dvec3 center = camera.corner + 0.5 * (camera.right + camera.down);
    const auto centered = ProjectionPlaneCamera::from_center(camera.eye, center, camera.right, camera.down);
    require_close(centered.corner, camera.corner);
}

TEST_CASE("a perspective camera and its projection plane give the same rays", "[render]")
{
    const glm::ivec2 size(64, 48);
    const Projection look_at(PerspectiveCamera{{3, -5, 2}, {0.5, 0.2, 0.1}, {0, 0, 1}, 35.0}, size);
    const glm::dvec3 corner = look_at.ray({0, 0}).at(7.0);
    const glm::dvec3 right = look_at.ray({64, 0}).at(7.0) - corner;
    const glm::dvec3 down = look_at.ray({0, 48}).at(7.0) - corner;
    const Projection plane(ProjectionPlaneCamera{{3, -5, 2}, corner, right, down}, size);
    require_close(plane.forward(), look_at.forward());
    require_close(plane.up(), look_at.up());
    for (const glm::dvec2 raster : {glm::dvec2(0.5), glm::dvec2(63.5, 3.5), glm::dvec2(20, 47)})
        require_close(plane.ray(raster).direction, 7.0 * look_at.ray(raster).direction);
}

TEST_CASE("orthographic rays are parallel, a pixel apart", "[render]")
{
    const Projection projection(OrthographicCamera{{0, 0, 10}, {0, 0, 3}, {0, 1, 0}, 4.0}, {200, 100});
    require_close(projection.ray({100, 50}).origin, {0, 0, 10});
    require_close(projection.ray({0, 0}).origin, {-4, 2, 10});
    require_close(projection.ray({0.5, 0.5}).origin, {-3.98, 1.98, 10});
    require_close(projection.ray({17, 33}).direction, {0, 0, -1});
    REQUIRE(projection.depth({1, 2, 3}) == Approx(7.0));
}

TEST_CASE("matrices take the points of a pixel's ray back to the pixel", "[render]")
{
    std::mt19937 random(4);
    std::uniform_real_distribution<double> uniform;
    const glm::ivec2 size(123, 77);
    for (const Camera& camera : some_cameras()) {
        const Projection projection(camera, size);
        const glm::dmat4 to_ndc = projection.world_to_ndc().value();
        const glm::dmat4 to_camera = projection.world_to_camera();
        double last_z = -std::numeric_limits<double>::infinity();
        for (int trial = 0; trial < 50; ++trial) {
            const glm::dvec2 raster(123.0 * uniform(random), 77.0 * uniform(random));
            const glm::dvec3 position = projection.ray(raster).at(0.1 + 20.0 * uniform(random));

            const glm::dvec4 ndc = to_ndc * glm::dvec4(position, 1.0);
            REQUIRE(123.0 * ndc.x / ndc.w == Approx(raster.x).margin(1e-9));
            REQUIRE(77.0 * ndc.y / ndc.w == Approx(raster.y).margin(1e-9));
            REQUIRE(ndc.w > 0.0);
            REQUIRE(transform_point(to_camera, position).z == Approx(projection.depth(position)));
        }
        for (const double t : {0.5, 1.0, 2.0, 10.0}) {
            const glm::dvec4 ndc = to_ndc * glm::dvec4(projection.ray({30, 20}).at(t), 1.0);
            REQUIRE(ndc.z / ndc.w > last_z);
            last_z = ndc.z / ndc.w;
        }
        // Camera space is rigid, and has the image's right and up.
        const glm::dvec3 left_point = projection.ray({10, 40}).at(3.0), right_point = projection.ray({90, 40}).at(3.0);
        const glm::dvec3 a = transform_point(to_camera, left_point), b = transform_point(to_camera, right_point);
        REQUIRE(b.x > a.x);
        REQUIRE(glm::distance(a, b) == Approx(glm::distance(left_point, right_point)));
        REQUIRE(transform_point(to_camera, projection.ray({60, 5}).at(3.0)).y >
                transform_point(to_camera, projection.ray({60, 70}).at(3.0)).y);
    }
}

TEST_CASE("cameras refuse parameters without an image", "[render]")
{
    const glm::ivec2 size(4, 3);
    const auto message = [](const char* part) { return ContainsSubstring(part); };
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{}, glm::ivec2(0, 3)), message("size"));
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{}, glm::ivec2(3, -1)), message("size"));
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{{1, 2, 3}, {1, 2, 3}}, size), message("target"));
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{{0, 0, 5}, {0, 0, 0}, {0, 0, 1}}, size), message("up"));
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{{0, 0, 5}, {0, 0, 0}, {0, 0, -2}}, size), message("up"));
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{{0, 9, 5}, {0, 0, 0}, {0, 0, 0}}, size), message("up"));
    REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{{0, no_number, 5}}, size), message("eye"));
    for (const double field_of_view : {0.0, -1.0, 180.0, no_number})
        REQUIRE_THROWS_WITH(Projection(PerspectiveCamera{{0, -1, 0}, {0, 0, 0}, {0, 0, 1}, field_of_view}, size),
                            message("field_of_view"));
    for (const double height : {0.0, -1.0, no_number})
        REQUIRE_THROWS_WITH(Projection(OrthographicCamera{{0, -1, 0}, {0, 0, 0}, {0, 0, 1}, height}, size),
                            message("height"));
    REQUIRE_THROWS_WITH(Projection(ProjectionPlaneCamera{{0, -1, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, size),
                        message("down"));
    REQUIRE_THROWS_WITH(Projection(ProjectionPlaneCamera{{5, 0, 5}, {0, 0, 0}, {1, 0, 0}, {0, 0, -1}}, size),
                        message("eye"));
}

TEST_CASE("rays through a lens meet in the plane in focus", "[render]")
{
    PerspectiveCamera camera{{3, -5, 2}, {0.5, 0.2, 0.1}, {0, 0, 1}, 35.0};
    const glm::ivec2 size(64, 48);
    const Projection pinhole(camera, size);
    camera.aperture_radius = 0.3;
    for (const double focus_distance : {2.0, 7.5}) {
        camera.focus_distance = focus_distance;
        const Projection lens(camera, size);
        REQUIRE(lens.has_lens());
        for (const glm::dvec2 place : {glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(-0.3, 0.8)}) {
            const Ray ray = lens.ray({5.5, 40.5}, place);
            require_close(ray.at(focus_distance), pinhole.ray({5.5, 40.5}).at(focus_distance));
            REQUIRE(glm::distance(ray.origin, camera.eye) == Approx(0.3 * glm::length(place)).margin(1e-12));
            REQUIRE(lens.depth(ray.at(1.7)) == Approx(1.7));
        }
    }
    camera.focus_distance.reset(); // the target's
    REQUIRE(glm::distance(Projection(camera, size).ray({32, 24}, {1, 0}).at(glm::distance(camera.eye, camera.target)),
                          camera.target) < 1e-12);
    camera.focus_distance = 0.0;
    REQUIRE_THROWS_WITH(Projection(camera, size), ContainsSubstring("focus_distance"));
    camera.focus_distance = 1.0;
    camera.aperture_radius = -0.1;
    REQUIRE_THROWS_WITH(Projection(camera, size), ContainsSubstring("aperture_radius"));
}

TEST_CASE("a panorama shows longitudes and latitudes", "[render]")
{
    const Projection projection(PanoramicCamera{{1, 2, 3}, {1, 7, 3}, {0, 0, 1}}, {360, 180});
    const auto direction = [&](double x, double y) { return projection.ray({x, y}).direction; };
    require_close(direction(180, 90), {0, 1, 0});
    require_close(direction(270, 90), {1, 0, 0});
    require_close(direction(90, 90), {-1, 0, 0});
    require_close(direction(0, 90), {0, -1, 0});
    require_close(direction(123, 0), {0, 0, 1});
    require_close(direction(180, 135), {0, std::sqrt(0.5), -std::sqrt(0.5)});
    REQUIRE_FALSE(projection.world_to_ndc());
    REQUIRE(projection.pixel_aspect_ratio() == 1.0);
    REQUIRE(projection.depth({1, -1, -1}) == Approx(5.0));
}
