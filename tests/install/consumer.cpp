// A plane x = 1.5 of a ramp, hit by a ray along x.
#include <isospline/scene/scene.h>

int main()
{
    const std::vector<float> ramp{0, 1, 2, 3};
    const isospline::SampleView samples{ramp.data(), isospline::SampleType::float32, {4, 4, 4}, {sizeof(float), 0, 0}};
    isospline::Scene scene;
    scene.add(std::make_shared<isospline::Isosurface>(std::make_shared<isospline::Volume>(samples), 1.5));

    const isospline::Ray ray{{-10.0, 1.0, 1.0}, {1.0, 0.0, 0.0}};
    isospline::Hit hit;
    scene.snapshot()->cast_rays({&ray, 1}, {&hit, 1});
    return hit && hit.t > 11.0 && hit.t < 12.0 ? 0 : 1;
}
