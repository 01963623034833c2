#include "isospline/scene/object.h"

#include "isospline/util/fan_out.h"

namespace isospline {

void Object::build(RTCBuildQuality quality, double rounding_error_local, const Progress& progress)
{
    const EmbreeMemory memory;
    const Device& device = Device::shared();
    device.forget_errors();
    const embree::GeometryHandle geometry = make_geometry(device, rounding_error_local);
    rtcCommitGeometry(geometry.get());
    embree::SceneHandle scene(rtcNewScene(device.get()));
    device.check();
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), quality);
    rtcAttachGeometryByID(scene.get(), geometry.get(), 0);
    device.check();
    {
        const FanOut fan_out(this);
        device.commit(scene.get(), progress);
    }
    scene_ = std::move(scene);
    embree_memory_ = memory.bytes();
}

} // namespace isospline
