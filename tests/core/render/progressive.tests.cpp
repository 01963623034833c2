#include "catch.h"

#include "isospline/render/progressive.h"
#include "isospline/scene/scene.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <vector>

using namespace isospline;

TEST_CASE("a path traced picture does not depend on threads and steps", "[render][threads]")
{
    // Two walls in a corner, one of them a mirror almost, under a lamp.
    Scene scene;
    scene.add(std::make_shared<Mesh>(std::vector<glm::dvec3>{{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}},
                                     std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}}));
    scene.add(std::make_shared<Mesh>(std::vector<glm::dvec3>{{5, 5, 0}, {-5, 5, 0}, {5, 5, 5}, {-5, 5, 5}},
                                     std::vector<glm::uvec3>{{0, 1, 2}, {1, 3, 2}}));
    PathTracer path_tracer;
    path_tracer.lights = {SphereLight{{0, 0, 4}, 0.5, glm::dvec3(10.0)}, EnvironmentLight{glm::dvec3(0.1)}};
    path_tracer.material_of_geometry[1] = Material{glm::dvec3(0.9), 1.0, 0.1};
    const PerspectiveCamera camera{{0, -12, 4}, {0, 0, 1}, {0, 0, 1}, 40.0};

    const auto picture = [&](int threads, std::initializer_list<int> steps) {
        set_thread_count(threads);
        ProgressiveRenderer renderer(scene, camera, {53, 37}, path_tracer, glm::vec4(0.0f), {.variance = true});
        for (const int samples : steps)
            renderer.step(samples);
        set_thread_count(0);
        REQUIRE(renderer.samples() == 4);
        return renderer.image();
    };
    const Image once = picture(1, {4});
    const Image apart = picture(2, {1, 2, 1});
    REQUIRE(once.color == apart.color);
    REQUIRE(once.variance == apart.variance);
    float brightest = 0.0f;
    for (const glm::vec4& color : once.color)
        brightest = std::max(brightest, color.g);
    REQUIRE(brightest > 0.5f);
}

TEST_CASE("progressive rendering refuses bad input by name", "[render]")
{
    Scene scene;
    PathTracer path_tracer;
    path_tracer.max_bounces = -1;
    REQUIRE_THROWS_WITH(ProgressiveRenderer(scene, PerspectiveCamera{}, {4, 4}, path_tracer),
                        ContainsSubstring("max_bounces"));
    path_tracer = {};
    REQUIRE_THROWS_WITH(ProgressiveRenderer(scene, PerspectiveCamera{}, {4, 4}, path_tracer, glm::vec4(2.0f)),
                        ContainsSubstring("background"));
    ProgressiveRenderer renderer(scene, PerspectiveCamera{}, {4, 4}, path_tracer);
    REQUIRE_THROWS_WITH(renderer.step(0), ContainsSubstring("samples"));
    renderer.step();
    REQUIRE(renderer.samples() == 1);
    REQUIRE(renderer.image().color == std::vector<glm::vec4>(16, glm::vec4(0.0f)));
}

TEST_CASE("objects have their own materials, and images have the requested layers", "[render]")
{
    const std::vector<glm::dvec3> corners{{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}};
    const std::vector<glm::uvec3> faces{{0, 1, 2}, {0, 2, 3}};
    Material own, bad;
    own.color = glm::dvec3(0.25, 0.5, 0.75);
    bad.metallic = 2.0;
    Scene scene;
    const auto add = [&](const Material& material) {
        return scene.add(std::make_shared<Mesh>(corners, faces, std::vector<glm::dvec3>(), std::vector<glm::dvec3>(),
                                                std::make_shared<const Material>(material)));
    };
    const std::uint32_t first = add(own);

    const PerspectiveCamera above{{0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 20.0};
    Layers layers{.albedo = true, .curvature = true, .ambient_occlusion = true, .direct = true};
    ProgressiveRenderer renderer(scene, above, {6, 4}, {}, glm::vec4(0.0f), layers);
    REQUIRE(renderer.image().direct.size() == 24);
    renderer.step();
    const Image image = renderer.image();
    REQUIRE(image.albedo == std::vector<glm::vec3>(24, {0.25f, 0.5f, 0.75f}));
    REQUIRE(image.ambient_occlusion == std::vector<float>(24, 1.0f));
    REQUIRE(image.curvature.size() == 24);
    REQUIRE(image.direct[0] == glm::vec3(image.color[0]));

    PathTracer path_tracer;
    path_tracer.material_of_geometry[first].color = glm::dvec3(1.0, 0.0, 0.0);
    ProgressiveRenderer other(scene, above, {6, 4}, path_tracer, glm::vec4(0.0f), {.albedo = true});
    other.step();
    REQUIRE(other.image().albedo == std::vector<glm::vec3>(24, {1.0f, 0.0f, 0.0f}));
    REQUIRE(other.image().direct.empty());
    REQUIRE(other.image().ambient_occlusion.empty());

    path_tracer.material_of_geometry[first + 1] = own;
    REQUIRE_THROWS_WITH(ProgressiveRenderer(scene, above, {6, 4}, path_tracer).step(), ContainsSubstring("materials"));
    layers.ambient_occlusion_samples = 0;
    REQUIRE_THROWS_WITH(ProgressiveRenderer(scene, above, {6, 4}, {}, glm::vec4(0.0f), layers),
                        ContainsSubstring("ambient_occlusion"));
    add(bad);
    REQUIRE_THROWS_WITH(ProgressiveRenderer(scene, above, {6, 4}, {}).step(), ContainsSubstring("metallic"));
}
