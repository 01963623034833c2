#include "catch.h"

#include "isospline/math/affine.h"
#include "isospline/render/projection.h"
#include "isospline/render/renderer.h"
#include "isospline/scene/scene.h"
#include "isospline/util/parallel.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

using namespace isospline;

namespace {

/// A ball of radius 1: its model is |x|^2 to within rounding, as sums of k^2 beta^2(x - k) are x^2 + 1/4.
std::shared_ptr<const Isosurface> ball()
{
    constexpr int size = 24;
    constexpr double middle = (size - 1) / 2.0, spacing = 0.125;
    std::vector<double> coefficients;
    for (int z = 0; z < size; ++z)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                coefficients.push_back(std::pow(x - middle, 2) + std::pow(y - middle, 2) + std::pow(z - middle, 2) -
                                       0.75);
    const SampleView view{coefficients.data(),
                          SampleType::float64,
                          glm::ivec3(size),
                          {sizeof(double), size * sizeof(double), size * size * sizeof(double)}};
    VolumeOptions options;
    options.spacing = glm::dvec3(spacing);
    options.origin = glm::dvec3(-middle * spacing);
    options.filter = Filter::none;
    IsosurfaceOptions surface;
    surface.inside = Inside::below;
    return std::make_shared<const Isosurface>(std::make_shared<const Volume>(view, options), 64.0, surface);
}

/// Unit spheres about the origin (geometry 0) and about (4, 0, 0) (geometry 1).
const SceneSnapshot& spheres()
{
    static const std::shared_ptr<const SceneSnapshot> snapshot = [] {
        Scene scene;
        const auto surface = ball();
        scene.add(surface);
        scene.add(surface, glm::translate(glm::dmat4(1.0), glm::dvec3(4.0, 0.0, 0.0)));
        return scene.snapshot();
    }();
    return *snapshot;
}

constexpr Layers layers{.depth = true,
                        .position = true,
                        .normal = true,
                        .albedo = true,
                        .gradient_magnitude = true,
                        .curvature = true,
                        .geometry_ids = true,
                        .primitive_ids = true};

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
    options.layers = layers;
    options.size = {150, 97};
    options.shading = Outline{2.0};
    const Image image = render(spheres(), camera, options);
    const Projection projection(camera, options.size);
    int hit_count = 0;
    for (int y = 0; y < 97; ++y) {
        for (int x = 0; x < 150; ++x) {
            const std::size_t pixel = static_cast<std::size_t>(y * 150 + x);
            const Ray ray = projection.ray({x + 0.5, y + 0.5});
            Hit hit;
            spheres().cast_rays({&ray, 1}, {&hit, 1});
            REQUIRE(image.geometry_ids[pixel] == hit.geometry_id);
            REQUIRE(image.primitive_ids[pixel] == hit.primitive_id);
            REQUIRE(image.color[pixel].a == (hit ? 1.0f : 0.0f));
            if (!hit) {
                REQUIRE(image.depth[pixel] == std::numeric_limits<float>::infinity());
                REQUIRE(image.normal[pixel] == glm::vec3(0.0f));
                continue;
            }
            ++hit_count;
            // Of the sphere: closest to the origin its rays of this picture meet no other.
            REQUIRE(glm::length(hit.position) == Approx(1.0).epsilon(1e-12));
            const double n_v = glm::dot(hit.position, glm::normalize(ray.direction));
            REQUIRE(image.color[pixel].g == Approx(std::pow(1.0 - n_v * n_v, 2)).margin(1e-6));
            REQUIRE(image.depth[pixel] == Approx(hit.position.y + 10.0));
            REQUIRE(glm::distance(image.position[pixel], glm::vec3(hit.position)) < 1e-6f);
            REQUIRE(glm::distance(image.normal[pixel], glm::vec3(hit.position)) < 1e-6f);
        }
    }
    REQUIRE(hit_count > 2000);
}

TEST_CASE("a crop has the pixels of the whole picture", "[render]")
{
    PerspectiveCamera with_lens = camera;
    with_lens.aperture_radius = 0.3;
    RenderOptions options;
    options.layers = layers;
    options.size = {61, 47};
    for (const Shading& shading : {Shading(Phong{}), Shading(Outline{2.0}), Shading(AmbientOcclusion{})}) {
        options.shading = shading;
        options.samples = 4;
        options.crop.reset();
        const Image whole = render(spheres(), with_lens, options);
        REQUIRE(whole.full_size == whole.size);
        for (const Window& window : {Window{{13, 5}, {31, 29}}, Window{{0, 0}, {61, 47}}, Window{{60, 46}, {1, 1}}}) {
            options.crop = window;
            const Image part = render(spheres(), with_lens, options);
            REQUIRE(part.size == window.size);
            REQUIRE(part.first == window.first);
            REQUIRE(part.full_size == options.size);
            for (int y = 0; y < window.size.y; ++y)
                for (int x = 0; x < window.size.x; ++x) {
                    const auto pixel = static_cast<std::size_t>(y * window.size.x + x);
                    const auto of_whole =
                        static_cast<std::size_t>((window.first.y + y) * options.size.x + window.first.x + x);
                    REQUIRE(part.color[pixel] == whole.color[of_whole]);
                    REQUIRE(part.depth[pixel] == whole.depth[of_whole]);
                    REQUIRE(part.primitive_ids[pixel] == whole.primitive_ids[of_whole]);
                }
        }
    }
    for (const Window& window : {Window{{-1, 0}, {4, 4}}, Window{{0, 0}, {0, 4}}, Window{{60, 0}, {2, 4}},
                                 Window{{0, 0}, {4, std::numeric_limits<int>::max()}}}) {
        options.crop = window;
        REQUIRE_THROWS_WITH(render(spheres(), camera, options), ContainsSubstring("crop"));
    }
}

TEST_CASE("with more samples, coverage converges to the exact area, and only colour changes", "[render]")
{
    const OrthographicCamera parallel{{0, -10, 0}, {0, 0, 0}, {0, 0, 1}, 2.5};
    RenderOptions options;
    options.layers = layers;
    options.size = {40, 40};
    const Image single = render(spheres(), parallel, options);
    const double pixel_area = std::pow(2.5 / 40, 2);
    for (const int samples : {9, 16, 64}) {
        options.samples = samples;
        const Image image = render(spheres(), parallel, options);
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
    options.layers = layers;
    options.size = {203, 111};
    options.samples = 4;
    set_thread_count(1);
    const Image one = render(spheres(), camera, options);
    set_thread_count(4);
    const Image four = render(spheres(), camera, options);
    set_thread_count(0);
    REQUIRE(same_bits(one, four));
}

TEST_CASE("the background is visible where there are no surfaces", "[render]")
{
    RenderOptions options;
    options.layers = layers;
    options.size = {64, 64};
    options.shading = Outline{0.0, glm::dvec3(0.5)};
    options.samples = 16;
    options.background = {0.2f, 0.4f, 0.8f, 1.0f};
    const Image image = render(spheres(), OrthographicCamera{{0, -10, 0}, {0, 0, 0}, {0, 0, 1}, 2.5}, options);
    REQUIRE(image.color[0] == glm::vec4(0.2f, 0.4f, 0.8f, 1.0f));
    REQUIRE(image.color[32 * 64 + 32] == glm::vec4(0.5f, 0.5f, 0.5f, 1.0f));
    for (const glm::vec4& color : image.color) {
        // A mixture of both at every pixel.
        const float coverage = (color.r - 0.2f) / 0.3f;
        REQUIRE(color.b == Approx(0.8f + coverage * (0.5f - 0.8f)).margin(1e-6));
        REQUIRE(color.a == 1.0f);
    }

    options.background = {1.0f, 1.0f, 1.0f, 0.25f};
    REQUIRE(render(spheres(), camera, options).color[0] == glm::vec4(0.25f));
    options.background.a = 1.5f;
    REQUIRE_THROWS_AS(render(spheres(), camera, options), std::invalid_argument);
    options.background = {0.0f, -1.0f, 0.0f, 1.0f};
    REQUIRE_THROWS_AS(render(spheres(), camera, options), std::invalid_argument);
}

TEST_CASE("geometries may have shadings of their own", "[render]")
{
    RenderOptions options;
    options.layers = layers;
    options.size = {90, 30};
    options.shading = Outline{0.0, glm::dvec3(1, 0, 0)};
    options.shading_of_geometry.emplace(1u, Outline{0.0, glm::dvec3(0, 1, 0)});
    const Image image = render(spheres(), OrthographicCamera{{2, -10, 0}, {2, 0, 0}, {0, 0, 1}, 3.0}, options);
    const std::size_t middle_row = 15 * 90;
    REQUIRE(image.color[middle_row + 25] == glm::vec4(1, 0, 0, 1));
    REQUIRE(image.color[middle_row + 65] == glm::vec4(0, 1, 0, 1));
    REQUIRE(image.geometry_ids[middle_row + 65] == 1u);
}

TEST_CASE("a Phong without lights is lit from the camera's side", "[render]")
{
    RenderOptions options;
    options.layers = layers;
    options.size = {31, 31};
    for (const glm::dvec3 eye : {glm::dvec3(0, -10, 0), glm::dvec3(-10, 0, 0), glm::dvec3(0, 0, 10)}) {
        const Image image = render(spheres(), PerspectiveCamera{eye, {}, {0.1, 0.2, 0.3}, 20.0}, options);
        REQUIRE(image.color[15 * 31 + 15].g > 0.3f);
    }
}

TEST_CASE("rendering reports its progress and can be cancelled", "[render][threads]")
{
    RenderOptions options;
    options.layers = layers;
    options.size = {300, 300};
    double last = 0.0;
    render(spheres(), camera, options, [&](double fraction) {
        REQUIRE(fraction >= 0.0);
        last = fraction;
        return true;
    });
    REQUIRE(last == 1.0);

    std::atomic<int> reports = 0;
    const Progress cancel = [&](double) { return ++reports < 2; };
    REQUIRE_THROWS_AS(render(spheres(), camera, options, cancel), Cancelled);
    REQUIRE(reports == 2);
}

TEST_CASE("an image has no layers by default, and one of 8-bit sRGB has no linear colour", "[render]")
{
    RenderOptions options;
    options.size = {60, 40};
    options.samples = 2;
    options.background = {0.1f, 0.2f, 0.3f, 0.5f};
    const Image linear = render(spheres(), camera, options);
    REQUIRE(linear.depth.empty());
    REQUIRE(linear.primitive_ids.empty());
    REQUIRE(linear.srgb8.empty());
    REQUIRE(linear.covered_count > 200);
    options.encoding = ColorEncoding::srgb8;
    const Image encoded = render(spheres(), camera, options);
    REQUIRE(encoded.color.empty());
    REQUIRE(encoded.covered_count == linear.covered_count);
    for (std::size_t i = 0; i < linear.pixel_count(); ++i)
        REQUIRE(encoded.srgb8[i] == to_srgb8(linear.color[i]));

    options.layers.variance = true;
    REQUIRE_THROWS_WITH(render(spheres(), camera, options), ContainsSubstring("layers: expected"));
    options.layers = {};
    options.layers.ambient_occlusion_samples = 0;
    REQUIRE_THROWS_WITH(render(spheres(), camera, options), ContainsSubstring("ambient_occlusion_samples: expected"));
}

TEST_CASE("steps of pixels are limited", "[render]")
{
    RenderOptions options;
    options.size = {60, 40};
    for (const int step : {-1, 0, 1 << 28, 1 << 30, std::numeric_limits<int>::max()}) {
        options.step = step;
        REQUIRE_THROWS_WITH(render(spheres(), camera, options), ContainsSubstring("step: expected"));
    }
    options.step = 1 << 20; // the first pixel alone
    REQUIRE(render(spheres(), camera, options).covered_count <= 1);
}
