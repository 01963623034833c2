#include "catch.h"

#include "isospline/math/affine.h"
#include "isospline/render/projection.h"
#include "isospline/render/renderer.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>

using namespace isospline;

namespace {

/// Unit spheres about the origin (geometry 3) and about (4, 0, 0) (geometry 7).
void cast_at_spheres(std::span<const Ray> rays, std::span<Hit> hits)
{
    for (std::size_t i = 0; i < rays.size(); ++i) {
        hits[i] = Hit();
        for (const auto& [center, id] : {std::pair(glm::dvec3(0.0), 3u), std::pair(glm::dvec3(4.0, 0.0, 0.0), 7u)}) {
            const glm::dvec3 offset = rays[i].origin - center;
            const double a = glm::dot(rays[i].direction, rays[i].direction);
            const double b = glm::dot(offset, rays[i].direction);
            const double discriminant = b * b - a * (glm::dot(offset, offset) - 1.0);
            const double t = (-b - std::sqrt(std::max(discriminant, 0.0))) / a;
            if (discriminant < 0.0 || t < 0.0 || t >= hits[i].t)
                continue;
            hits[i].t = t;
            hits[i].position = rays[i].at(t);
            hits[i].normal = hits[i].position - center;
            hits[i].geometry_id = id;
            hits[i].primitive_id = (std::uint64_t{1} << 40) + id; // images keep all 64 bits
        }
    }
}

const PerspectiveCamera camera{{0, -10, 0}, {0, 0, 0}, {0, 0, 1}, 20.0};

bool same_bits(const Image& a, const Image& b)
{
    const auto same = [](const auto& x, const auto& y) {
        return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
    };
    return same(a.color, b.color) && same(a.depth, b.depth) && same(a.position, b.position) &&
           same(a.normal, b.normal) && same(a.albedo, b.albedo) && same(a.curvature, b.curvature) &&
           same(a.gradient_magnitude, b.gradient_magnitude) && same(a.geometry_ids, b.geometry_ids) &&
           same(a.primitive_ids, b.primitive_ids);
}

} // namespace

TEST_CASE("a rendered sphere is the closed form at every pixel", "[render]")
{
    RenderOptions options;
    options.size = {150, 97};
    options.shading = Outline{2.0};
    const Image image = render(cast_at_spheres, camera, options);
    const Projection projection(camera, options.size);
    int hit_count = 0;
    for (int y = 0; y < 97; ++y) {
        for (int x = 0; x < 150; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y * 150 + x);
            const Ray ray = projection.ray({x + 0.5, y + 0.5});
            Hit hit;
            cast_at_spheres({&ray, 1}, {&hit, 1});
            REQUIRE(image.geometry_ids[pixel] == hit.geometry_id);
            REQUIRE(image.primitive_ids[pixel] == hit.primitive_id);
            REQUIRE(image.color[pixel].a == (hit ? 1.0f : 0.0f));
            if (!hit) {
                REQUIRE(image.depth[pixel] == std::numeric_limits<float>::infinity());
                REQUIRE(image.normal[pixel] == glm::vec3(0.0f));
                continue;
            }
            ++hit_count;
            const double n_v = glm::dot(hit.normal, glm::normalize(ray.direction));
            REQUIRE(image.color[pixel].g == Approx(std::pow(1.0 - n_v * n_v, 2)).margin(1e-6));
            REQUIRE(image.depth[pixel] == Approx(hit.position.y + 10.0));
            REQUIRE(glm::distance(image.position[pixel], glm::vec3(hit.position)) < 1e-6f);
            REQUIRE(glm::distance(image.normal[pixel], glm::vec3(hit.normal)) < 1e-6f);
        }
    }
    REQUIRE(hit_count > 2000);
}

TEST_CASE("more samples take coverage to the exact area, and leave all but colour alone", "[render]")
{
    const OrthographicCamera parallel{{0, -10, 0}, {0, 0, 0}, {0, 0, 1}, 2.5};
    RenderOptions options;
    options.size = {40, 40};
    const Image single = render(cast_at_spheres, parallel, options);
    const double pixel_area = std::pow(2.5 / 40, 2);
    for (const int samples : {9, 16, 64}) {
        options.samples = samples;
        const Image image = render(cast_at_spheres, parallel, options);
        double area = 0.0;
        for (const glm::vec4& color : image.color) {
            REQUIRE(color.a <= 1.0f);
            area += pixel_area * static_cast<double>(color.a);
        }
        REQUIRE(area == Approx(glm::pi<double>()).epsilon(0.02 / samples + 0.0005));
        REQUIRE(image.color[20 * 40 + 20].a == 1.0f);
        Image same_color = image;
        same_color.color = single.color;
        REQUIRE(same_bits(same_color, single));
    }
}

TEST_CASE("an image does not depend on the number of threads", "[render][threads]")
{
    RenderOptions options;
    options.size = {203, 111};
    options.samples = 4;
    set_thread_count(1);
    const Image one = render(cast_at_spheres, camera, options);
    set_thread_count(4);
    const Image four = render(cast_at_spheres, camera, options);
    set_thread_count(0);
    REQUIRE(same_bits(one, four));
}

TEST_CASE("the background shows where surfaces do not cover", "[render]")
{
    RenderOptions options;
    options.size = {64, 64};
    options.shading = Outline{0.0, glm::dvec3(0.5)};
    options.samples = 16;
    options.background = {0.2f, 0.4f, 0.8f, 1.0f};
    const Image image = render(cast_at_spheres, OrthographicCamera{{0, -10, 0}, {0, 0, 0}, {0, 0, 1}, 2.5}, options);
    REQUIRE(image.color[0] == glm::vec4(0.2f, 0.4f, 0.8f, 1.0f));
    REQUIRE(image.color[32 * 64 + 32] == glm::vec4(0.5f, 0.5f, 0.5f, 1.0f));
    for (const glm::vec4& color : image.color) {
        // A mixture of both at every pixel.
        const float coverage = (color.r - 0.2f) / 0.3f;
        REQUIRE(color.b == Approx(0.8f + coverage * (0.5f - 0.8f)).margin(1e-6));
        REQUIRE(color.a == 1.0f);
    }

    options.background = {1.0f, 1.0f, 1.0f, 0.25f};
    REQUIRE(render(cast_at_spheres, camera, options).color[0] == glm::vec4(0.25f));
    options.background.a = 1.5f;
    REQUIRE_THROWS_AS(render(cast_at_spheres, camera, options), std::invalid_argument);
    options.background = {0.0f, -1.0f, 0.0f, 1.0f};
    REQUIRE_THROWS_AS(render(cast_at_spheres, camera, options), std::invalid_argument);
}

TEST_CASE("geometries may have shadings of their own", "[render]")
{
    RenderOptions options;
    options.size = {90, 30};
    options.shading = Outline{0.0, glm::dvec3(1, 0, 0)};
    options.shading_of_geometry.emplace(7u, Outline{0.0, glm::dvec3(0, 1, 0)});
    const Image image = render(cast_at_spheres, OrthographicCamera{{2, -10, 0}, {2, 0, 0}, {0, 0, 1}, 3.0}, options);
    const std::size_t middle_row = 15 * 90;
    REQUIRE(image.color[middle_row + 25] == glm::vec4(1, 0, 0, 1));
    REQUIRE(image.color[middle_row + 65] == glm::vec4(0, 1, 0, 1));
    REQUIRE(image.geometry_ids[middle_row + 65] == 7u);
}

TEST_CASE("a Phong without lights is lit from the camera's side", "[render]")
{
    RenderOptions options;
    options.size = {31, 31};
    for (const glm::dvec3 eye : {glm::dvec3(0, -10, 0), glm::dvec3(-10, 0, 0), glm::dvec3(0, 0, 10)}) {
        const Image image = render(cast_at_spheres, PerspectiveCamera{eye, {}, {0.1, 0.2, 0.3}, 20.0}, options);
        REQUIRE(image.color[15 * 31 + 15].g > 0.3f);
    }
}

TEST_CASE("shadows, ambient occlusion and transparency need a scene", "[render]")
{
    RenderOptions with_shadows, with_occlusion, with_transparency;
    with_shadows.shading.emplace<Phong>().shadows = true;
    REQUIRE_THROWS_AS(render(cast_at_spheres, camera, with_shadows), std::invalid_argument);
    with_occlusion.shading_of_geometry.emplace(7u, AmbientOcclusion{});
    REQUIRE_THROWS_AS(render(cast_at_spheres, camera, with_occlusion), std::invalid_argument);
    with_transparency.shading.emplace<Outline>().opacity = 0.5;
    REQUIRE_THROWS_WITH(render(cast_at_spheres, camera, with_transparency),
                        "opacity: expected 1, as there is no scene, got 0.5");
}

TEST_CASE("rendering reports its progress and can be cancelled", "[render][threads]")
{
    RenderOptions options;
    options.size = {300, 300};
    double last = 0.0;
    render(cast_at_spheres, camera, options, [&](double fraction) {
        REQUIRE(fraction >= 0.0);
        last = fraction;
        return true;
    });
    REQUIRE(last == 1.0);

    std::atomic<int> batches = 0;
    const CastRays counted = [&](std::span<const Ray> rays, std::span<Hit> hits) {
        ++batches;
        cast_at_spheres(rays, hits);
    };
    REQUIRE_THROWS_AS(render(counted, camera, options, [](double) { return false; }), Cancelled);
    REQUIRE(batches < 19 * 19);
}

TEST_CASE("what a ray cast throws ends the rendering", "[render]")
{
    const CastRays broken = [](std::span<const Ray>, std::span<Hit>) { throw std::runtime_error("no device"); };
    REQUIRE_THROWS_WITH(render(broken, camera, {}), "no device");
}
