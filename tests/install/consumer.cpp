// A plane x = 1.5 of a ramp, hit by a ray along x.
#include <isospline/isospline.h>

#include <cmath>

namespace {

/// Whether inline code of the library's headers rounds as the library does: o + t d with two roundings, which is zero
/// here, and not with one, even where the machine could.
bool rounds_as_the_library()
{
    volatile double t = 1.0 + 0x1p-30, direction = 1.0 - 0x1p-30;
    volatile double product = t * direction;
    const isospline::Ray ray{{-product, 0.0, 0.0}, {direction, 0.0, 0.0}};
    return ray.at(t).x == 0.0 && std::fma(t, direction, -product) != 0.0;
}

} // namespace

int main()
{
    const std::vector<float> ramp{0, 1, 2, 3};
    const isospline::SampleView samples{ramp.data(), isospline::SampleType::float32, {4, 4, 4}, {sizeof(float), 0, 0}};
    const auto volume = std::make_shared<isospline::Volume>(samples);
    const auto surface = std::make_shared<isospline::Isosurface>(volume, 1.5);
    isospline::Scene scene;
    scene.add(surface);

    const isospline::Ray ray{{-10.0, 1.0, 1.0}, {1.0, 0.0, 0.0}};
    isospline::Hit hit, hopped;
    scene.snapshot()->cast_rays({&ray, 1}, {&hit, 1});
    isospline::VoxelHopper(surface->snapshot()).cast_rays({&ray, 1}, {&hopped, 1});
    const bool found = hit && hit.t > 11.0 && hit.t < 12.0 && hit.position == ray.at(hit.t);
    const bool same = hopped.t == hit.t && hopped.primitive_id == hit.primitive_id;
    return found && same && volume->cell_at(hit.primitive_id).y == 1 && rounds_as_the_library() ? 0 : 1;
}
