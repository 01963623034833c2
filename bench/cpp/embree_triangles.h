// A mesh as Embree's own triangles, alone in a scene: rays at isosurfaces are compared with it.
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/embree_api.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace isospline::bench {

/// The hit of a ray: the fields of Hit that Embree computes.
struct TriangleHit {
    float t = std::numeric_limits<float>::infinity();
    glm::vec3 normal{0.0f}; ///< unit
    std::uint32_t geometry_id = RTC_INVALID_GEOMETRY_ID, primitive_id = RTC_INVALID_GEOMETRY_ID;
};

/// RTC_GEOMETRY_TYPE_TRIANGLE with the settings of isospline's scenes: robust, medium build quality. Embree decides its
/// triangles in single precision.
class EmbreeTriangles {
public:
    EmbreeTriangles(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces);

    /// Like those of SceneSnapshot: the first hit of each ray, in packets of the device's width or one ray after the
    /// other, with unit normals; and whether each ray hits anything.
    void cast_packets(std::span<const Ray> rays, std::span<TriangleHit> hits) const;
    void cast_singles(std::span<const Ray> rays, std::span<TriangleHit> hits) const;
    void test_occlusions(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;

private:
    template <int Size>
    void cast(std::span<const Ray> rays, std::span<TriangleHit> hits) const;

    embree::DeviceHandle device_;
    embree::SceneHandle scene_;
    int packet_size_;
};

/// The subject's mesh, built when it is first needed.
const EmbreeTriangles& triangle_scene();

} // namespace isospline::bench
