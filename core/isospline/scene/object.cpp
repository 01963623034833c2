#include "isospline/scene/object.h"

namespace isospline {

namespace {

RTCBuildQuality to_embree(BuildQuality quality)
{
    switch (quality) {
    case BuildQuality::low:
        return RTC_BUILD_QUALITY_LOW;
    case BuildQuality::high:
        return RTC_BUILD_QUALITY_HIGH;
    default:
        return RTC_BUILD_QUALITY_MEDIUM;
    }
}

} // namespace

void Object::build(const BuildOptions& options, double rounding_error_local, const Progress& progress)
{
    const EmbreeMemory memory;
    const Device& device = Device::shared();
    device.forget_errors();
    const embree::GeometryHandle geometry =
        make_geometry(device, options, rounding_error_local, part_of(progress, 0.0, 0.6));
    rtcCommitGeometry(geometry.get());
    embree::SceneHandle scene(rtcNewScene(device.get()));
    device.check();
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), to_embree(options.quality));
    rtcAttachGeometryByID(scene.get(), geometry.get(), 0);
    device.check();
    device.commit(scene.get(), part_of(progress, 0.6, 1.0));
    scene_ = std::move(scene);
    embree_memory_ = memory.bytes();
}

} // namespace isospline
