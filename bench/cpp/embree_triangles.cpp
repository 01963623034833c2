#include "embree_triangles.h"

#include "subjects.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace isospline::bench {

namespace {

template <typename Item>
void set_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::span<const Item> items)
{
    void* const buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Item), items.size());
    if (buffer == nullptr)
        throw std::runtime_error("Embree has no room for the mesh");
    std::copy(items.begin(), items.end(), static_cast<Item*>(buffer));
}

void set_ray(const Ray& from, RTCRay& to)
{
    to.org_x = static_cast<float>(from.origin.x);
    to.org_y = static_cast<float>(from.origin.y);
    to.org_z = static_cast<float>(from.origin.z);
    to.tnear = static_cast<float>(from.t_near);
    to.dir_x = static_cast<float>(from.direction.x);
    to.dir_y = static_cast<float>(from.direction.y);
    to.dir_z = static_cast<float>(from.direction.z);
    to.time = 0.0f;
    to.tfar = static_cast<float>(from.t_far);
    to.mask = 0xffffffffu;
    to.id = 0;
    to.flags = 0;
}

template <int Size>
void set_rays(std::span<const Ray> from, RTCRayHitNt<Size>& to, int* valid)
{
    for (std::size_t lane = 0; lane < Size; ++lane) {
        const Ray& ray = from[std::min(lane, from.size() - 1)];
        to.ray.org_x[lane] = static_cast<float>(ray.origin.x);
        to.ray.org_y[lane] = static_cast<float>(ray.origin.y);
        to.ray.org_z[lane] = static_cast<float>(ray.origin.z);
        to.ray.tnear[lane] = static_cast<float>(ray.t_near);
        to.ray.dir_x[lane] = static_cast<float>(ray.direction.x);
        to.ray.dir_y[lane] = static_cast<float>(ray.direction.y);
        to.ray.dir_z[lane] = static_cast<float>(ray.direction.z);
        to.ray.time[lane] = 0.0f;
        to.ray.tfar[lane] = static_cast<float>(ray.t_far);
        to.ray.mask[lane] = 0xffffffffu;
        to.ray.id[lane] = 0;
        to.ray.flags[lane] = 0;
        to.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
        to.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        valid[lane] = lane < from.size() ? -1 : 0;
    }
}

/// The hits of a packet's first lanes. Normals are scaled for all lanes side by side.
template <int Size>
void set_hits(const RTCRayHitNt<Size>& from, std::span<TriangleHit> to)
{
    alignas(64) float scale[Size];
    for (int lane = 0; lane < Size; ++lane) {
        const float x = from.hit.Ng_x[lane], y = from.hit.Ng_y[lane], z = from.hit.Ng_z[lane];
        scale[lane] = 1.0f / std::sqrt(x * x + y * y + z * z);
    }
    for (std::size_t lane = 0; lane < to.size(); ++lane) {
        to[lane] = {};
        if (from.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID)
            continue;
        to[lane].t = from.ray.tfar[lane];
        to[lane].normal = scale[lane] * glm::vec3(from.hit.Ng_x[lane], from.hit.Ng_y[lane], from.hit.Ng_z[lane]);
        to[lane].geometry_id = from.hit.geomID[lane];
        to[lane].primitive_id = from.hit.primID[lane];
    }
}

} // namespace

EmbreeTriangles::EmbreeTriangles(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces)
    : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_.get())),
      packet_size_(embree::native_packet_size(device_.get()))
{
    const embree::GeometryHandle geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    set_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices);
    set_buffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, faces);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene_.get(), geometry.get());
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
        throw std::runtime_error("Embree did not build the mesh");
}

template <int Size>
void EmbreeTriangles::cast(std::span<const Ray> rays, std::span<TriangleHit> hits) const
{
    embree::QueryContext context;
    embree::initialize(context);
    alignas(64) RTCRayHitNt<Size> packet;
    alignas(64) int valid[Size];
    for (std::size_t first = 0; first < rays.size(); first += Size) {
        const auto some = rays.subspan(first, std::min<std::size_t>(Size, rays.size() - first));
        set_rays<Size>(some, packet, valid);
        embree::intersect_coherent(scene_.get(), context, valid, packet);
        set_hits<Size>(packet, hits.subspan(first, some.size()));
    }
}

void EmbreeTriangles::cast_packets(std::span<const Ray> rays, std::span<TriangleHit> hits) const
{
    switch (packet_size_) {
    case 16:
        return cast<16>(rays, hits);
    case 8:
        return cast<8>(rays, hits);
    default:
        return cast<4>(rays, hits);
    }
}

void EmbreeTriangles::cast_singles(std::span<const Ray> rays, std::span<TriangleHit> hits) const
{
    embree::QueryContext context;
    embree::initialize(context);
    RTCRayHit one;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        set_ray(rays[i], one.ray);
        one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        embree::intersect(scene_.get(), context, one);
        hits[i] = {};
        if (one.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            continue;
        const glm::vec3 normal(one.hit.Ng_x, one.hit.Ng_y, one.hit.Ng_z);
        hits[i] = {one.ray.tfar, normal / glm::length(normal), one.hit.geomID, one.hit.primID};
    }
}

void EmbreeTriangles::test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const
{
    embree::QueryContext context;
    embree::initialize(context);
    RTCRay ray;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        set_ray(rays[i], ray);
        embree::occluded(scene_.get(), context, ray);
        occluded[i] = ray.tfar < 0.0f;
    }
}

const EmbreeTriangles& triangle_scene()
{
    static const EmbreeTriangles triangles(subject().vertices, subject().faces);
    return triangles;
}

} // namespace isospline::bench
