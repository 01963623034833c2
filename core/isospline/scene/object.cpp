#include "isospline/scene/object.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

namespace isospline {

void Object::place(Device& device, RTCScene top, std::uint32_t id, const glm::dvec3& centre)
{
    const glm::dmat4 local_to_centred = glm::translate(glm::dmat4(1.0), -centre) * local_to_world();
    world_to_local_ = glm::inverse(local_to_world());
    centred_to_local_ = glm::inverse(local_to_centred);

    if (!instance_) {
        instance_.reset(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
        device.check();
        rtcAttachGeometryByID(top, instance_.get(), id);
    }
    const glm::mat4 single_precision(local_to_centred);
    rtcSetGeometryInstancedScene(instance_.get(), scene_.get());
    rtcSetGeometryTransform(instance_.get(), 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, glm::value_ptr(single_precision));
    rtcCommitGeometry(instance_.get());
    device.check();
}

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
