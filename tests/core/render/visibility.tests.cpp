// Shadow rays from surfaces chosen at random give, on average, the light of rays from all surfaces.
#include "catch.h"
#include "volumes.h"

#include "isospline/render/renderer.h"
#include "isospline/scene/scene.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <memory>

using namespace isospline;

namespace {

constexpr int side = 48, block = 4;

/// Means of colour and coverage over blocks of 4 x 4 pixels.
std::vector<glm::dvec4> block_means(const Image& image)
{
    std::vector<glm::dvec4> means(side / block * side / block);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            means[static_cast<std::size_t>(y / block * (side / block) + x / block)] +=
                glm::dvec4(image.color[static_cast<std::size_t>(y * side + x)]) / double(block * block);
    return means;
}

/// A surface of noise, and a part of it in front of itself.
const SceneSnapshot& surfaces()
{
    static const std::shared_ptr<const SceneSnapshot> snapshot = [] {
        const auto surface = std::make_shared<Isosurface>(noise_volume({14, 13, 12}, 2), 0.6);
        Scene scene;
        scene.add(surface);
        scene.add(surface, glm::translate(glm::dmat4(1.0), glm::dvec3(5.0, -9.0, 3.0)));
        return scene.settle();
    }();
    return *snapshot;
}

template <typename Model>
Shading translucent(Model model, const glm::dvec3& color, double opacity)
{
    model.color = color;
    model.opacity = opacity;
    return model;
}

template <typename Model>
void require_equal_means(const Model& model)
{
    const Box bounds = surfaces().bounds();
    const glm::dvec3 target = (bounds.lower + bounds.upper) / 2.0;
    const OrthographicCamera camera{target + glm::dvec3(3.0, -40.0, 6.0), target, {0, 0, 1}, 24.0};
    RenderOptions options;
    options.size = glm::ivec2(side);
    options.samples = 64;
    options.shading_of_geometry.emplace(0u, translucent(model, {0.9, 0.6, 0.3}, 0.4));
    options.shading_of_geometry.emplace(1u, translucent(model, {0.3, 0.5, 0.9}, 0.25));
    const std::vector<glm::dvec4> expected = block_means(render(surfaces(), camera, options));
    options.shadow_rays = ShadowRays::at_random;
    const std::vector<glm::dvec4> found = block_means(render(surfaces(), camera, options));

    glm::dvec4 sum(0.0), bias(0.0);
    double largest = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const glm::dvec4 difference = found[i] - expected[i];
        sum += expected[i];
        bias += difference;
        for (int part = 0; part < 3; ++part)
            largest = std::max(largest, std::abs(difference[part]));
        REQUIRE(difference.a == 0.0);
    }
    CAPTURE(largest);
    for (int part = 0; part < 3; ++part)
        REQUIRE(std::abs(bias[part]) < 0.004 * sum[part]);
    REQUIRE(largest > 0.0);
    REQUIRE(largest < 0.03);
}

} // namespace

TEST_CASE("ambient occlusion of surfaces chosen at random", "[render]")
{
    AmbientOcclusion occlusion;
    occlusion.samples = GENERATE(1, 3);
    occlusion.distance = 10.0;
    require_equal_means(occlusion);
}

TEST_CASE("soft shadows on surfaces chosen at random", "[render]")
{
    Phong phong;
    phong.ambient = 0.0;
    phong.shadows = true;
    phong.shadow_samples = GENERATE(1, 3);
    phong.lights = {DirectionalLight({1.0, 1.2, -0.9}, glm::dvec3(1.0), 20.0),
                    DirectionalLight({-1.0, 0.5, -0.2}, glm::dvec3(0.5))};
    require_equal_means(phong);
}
