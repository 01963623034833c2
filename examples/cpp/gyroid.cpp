// A volume of a formula, its isosurface beside a mesh, rays, another level, and a picture: gyroid.exr.
#include <isospline/isospline.h>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <memory>
#include <vector>

namespace {

constexpr int edge = 64;

/// Two periods of a gyroid in each direction. Samples are in the order of C arrays [z][y][x].
std::vector<float> gyroid()
{
    std::vector<float> samples;
    samples.reserve(edge * edge * edge);
    for (int z = 0; z < edge; ++z)
        for (int y = 0; y < edge; ++y)
            for (int x = 0; x < edge; ++x) {
                const glm::dvec3 p = (glm::dvec3(x, y, z) / (edge - 1.0) - 0.5) * 4.0 * M_PI;
                const double value =
                    std::sin(p.x) * std::cos(p.y) + std::sin(p.y) * std::cos(p.z) + std::sin(p.z) * std::cos(p.x);
                samples.push_back(static_cast<float>(value));
            }
    return samples;
}

void run()
{
    // The model: a quadratic B-spline through the samples. Strides are in bytes, for x, y and z.
    const std::vector<float> samples = gyroid();
    constexpr std::ptrdiff_t size = sizeof(float);
    const isospline::SampleView view{
        samples.data(), isospline::SampleType::float32, {edge, edge, edge}, {size, edge * size, edge * edge * size}};
    const auto volume = std::make_shared<isospline::Volume>(view);

    // Its surface at level 0, closed at the border of the volume, in a scene.
    isospline::IsosurfaceOptions of_surface;
    of_surface.closed = true;
    const auto surface = std::make_shared<isospline::Isosurface>(volume, 0.0, of_surface);
    isospline::Scene scene;
    scene.add(surface);

    // A triangle mesh in the same scene: a square below it. Objects have geometry ids, in the order of adding.
    const double low = -40.0, high = 100.0, ground = -1.0;
    const auto square = std::make_shared<isospline::Mesh>(
        std::vector<glm::dvec3>{{low, low, ground}, {high, low, ground}, {high, high, ground}, {low, high, ground}},
        std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}});
    scene.add(square);

    // Rays: one along x through the middle. World space is that of the indices, unless VolumeOptions say otherwise.
    const isospline::Ray ray{{-10.0, 31.0, 31.0}, {1.0, 0.0, 0.0}};
    isospline::Hit hit;
    scene.snapshot()->cast_rays({&ray, 1}, {&hit, 1});
    if (hit)
        std::printf("hit at t = %.6f, normal (%.3f, %.3f, %.3f)\n", hit.t, hit.normal.x, hit.normal.y, hit.normal.z);

    const isospline::Ray down{{80.0, 80.0, 50.0}, {0.0, 0.0, -1.0}};
    scene.snapshot()->cast_rays({&down, 1}, {&hit, 1});
    if (hit)
        std::printf("triangle %d of object %d at t = %.1f\n", static_cast<int>(hit.primitive_id),
                    static_cast<int>(hit.geometry_id), hit.t);

    // Another level takes some milliseconds. Snapshots that exist keep theirs.
    surface->set_level(0.3);
    scene.snapshot()->cast_rays({&ray, 1}, {&hit, 1});
    if (hit)
        std::printf("at another level, t = %.6f\n", hit.t);

    // A picture, on all cores.
    isospline::PerspectiveCamera camera;
    camera.eye = {150.0, -140.0, 110.0};
    camera.target = glm::dvec3((edge - 1) / 2.0);
    isospline::RenderOptions options;
    options.size = {480, 480};
    options.samples = 16;
    isospline::AmbientOcclusion sky;
    sky.color = glm::dvec3(0.85, 0.55, 0.25);
    options.shading = sky;
    isospline::write_exr(isospline::render(*scene.snapshot(), camera, options), "gyroid.exr");
}

} // namespace

int main()
{
    try {
        run();
    } catch (const std::exception& error) {
        std::fprintf(stderr, "gyroid: %s\n", error.what());
        return 1;
    }
}
