#include "catch.h"
#include "volumes.h"

#include "isospline/scene/scene.h"

#include <glm/ext/matrix_transform.hpp>

#include <cmath>

using namespace isospline;

namespace {

std::shared_ptr<Isosurface> ramp(double level)
{
    static const auto volume = [] {
        std::vector<float> samples;
        for (int i = 0; i < 8 * 8 * 8; ++i)
            samples.push_back(static_cast<float>(i % 8));
        VolumeOptions linear;
        linear.degree = 1;
        return make_volume(samples, {8, 8, 8}, linear);
    }();
    return std::make_shared<Isosurface>(volume, level);
}

std::shared_ptr<const Mesh> square(double x)
{
    return std::make_shared<const Mesh>(std::vector<glm::dvec3>{{x, 0, 0}, {x, 9, 0}, {x, 9, 9}, {x, 0, 9}},
                                        std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}});
}

/// Along x.
double first_t(const SceneSnapshot& snapshot, bool coherent = false)
{
    const Ray ray{{-10.0, 3.3, 3.4}, {1.0, 0.0, 0.0}};
    Hit hit;
    snapshot.cast_rays({&ray, 1}, {&hit, 1}, coherent);
    return hit.t;
}

glm::dmat4 moved(double x)
{
    return glm::translate(glm::dmat4(1.0), glm::dvec3(x, 0.0, 0.0));
}

} // namespace

TEST_CASE("a snapshot stays as it is while the scene and its surfaces change", "[scene]")
{
    Scene scene;
    const auto surface = ramp(2.5);
    const std::uint32_t id = scene.add(surface), behind = scene.add(square(20.0));
    const auto before = scene.snapshot();
    const auto see_before = [&] {
        for (const bool coherent : {false, true})
            REQUIRE(first_t(*before, coherent) == Approx(12.5));
        REQUIRE(before->ids() == std::vector<std::uint32_t>{id, behind});
        REQUIRE(before->bounds().upper.x == 20.0);
    };
    see_before();
    REQUIRE(scene.snapshot() == before);
    REQUIRE(scene.is_current(*before));
    REQUIRE(scene.settle() != before);
    REQUIRE(scene.is_current(*before));

    surface->set_level(4.5);
    REQUIRE(!scene.is_current(*before));
    const auto other_level = scene.snapshot();
    REQUIRE(first_t(*other_level) == Approx(14.5));
    see_before();

    scene.set_transform(id, moved(1.0));
    REQUIRE(first_t(*scene.snapshot()) == Approx(15.5));
    scene.set_visibility(id, {false, true});
    REQUIRE(first_t(*scene.snapshot()) == Approx(30.0));
    scene.remove(id);
    scene.remove(behind);
    REQUIRE(std::isinf(first_t(*scene.snapshot())));
    REQUIRE(first_t(*other_level) == Approx(14.5));
    see_before();
}

TEST_CASE("a snapshot outlives its scene", "[scene]")
{
    std::shared_ptr<const SceneSnapshot> snapshot;
    {
        Scene scene;
        scene.add(ramp(2.5));
        snapshot = scene.snapshot();
    }
    REQUIRE(first_t(*snapshot) == Approx(12.5));
}

TEST_CASE("only what has changed is built", "[scene]")
{
    Scene scene;
    const auto surface = ramp(2.5), other = ramp(3.5);
    const std::uint32_t id = scene.add(surface);
    scene.add(surface, moved(2.0));
    scene.add(other);
    REQUIRE(scene.snapshot()->build_count() == 2);
    scene.set_transform(id, moved(0.5));
    scene.set_visibility(id, {true, false});
    REQUIRE(scene.snapshot()->build_count() == 2);
    other->set_level(1.5);
    REQUIRE(scene.snapshot()->build_count() == 3);
    REQUIRE(first_t(*scene.snapshot()) == Approx(11.5));
}

TEST_CASE("a build that is cancelled leaves the scene to the next one", "[scene]")
{
    Scene scene;
    scene.add(ramp(2.5));
    REQUIRE_THROWS_AS(scene.snapshot([](double) { return false; }), Cancelled);
    REQUIRE(first_t(*scene.snapshot()) == Approx(12.5));
    scene.add(square(1.0));
    REQUIRE_THROWS_AS(scene.snapshot([](double) -> bool { throw std::runtime_error("stop"); }), std::runtime_error);
    REQUIRE(first_t(*scene.snapshot()) == Approx(11.0));
}

TEST_CASE("many scenes live at a time", "[scene]")
{
    // Embree has room for a thousand devices.
    const auto mesh = square(1.0);
    std::vector<Scene> scenes(3000);
    for (Scene& scene : scenes) {
        scene.add(mesh);
        REQUIRE(first_t(*scene.snapshot()) == Approx(11.0));
    }
    REQUIRE(first_t(*scenes.front().snapshot()) == Approx(11.0));
}

TEST_CASE("no object is refused", "[scene]")
{
    Scene scene;
    REQUIRE_THROWS_AS(scene.add(std::shared_ptr<const Isosurface>()), std::invalid_argument);
    REQUIRE_THROWS_AS(scene.add(std::shared_ptr<const Mesh>()), std::invalid_argument);
    REQUIRE(scene.count() == 0);
}
