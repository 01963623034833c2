#include "isospline/scene/object.h"

namespace isospline {

void Object::build_scene(Device& device, RTCGeometry geometry, const Progress& progress)
{
    rtcCommitGeometry(geometry);
    embree::SceneHandle scene(rtcNewScene(device.get()));
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST | embree::query_filter_flag);
    rtcSetSceneBuildQuality(scene.get(), device.build_quality());
    rtcAttachGeometryByID(scene.get(), geometry, 0);
    device.check();
    device.commit(scene.get(), progress);
    scene_ = std::move(scene);
}

} // namespace isospline
