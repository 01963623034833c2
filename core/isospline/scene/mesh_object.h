// A mesh as Embree user geometry: one box a triangle. The mesh's own space is moved so that its box is centred, so that
// single precision spends its digits on the shape. Triangles are intersected in double precision, by the rule of
// trace/triangle.h.
#pragma once

#include "isospline/scene/mesh.h"
#include "isospline/scene/object.h"
#include "isospline/scene/ray_query.h"
#include "isospline/trace/triangle.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

struct PacketOcclusion;
template <typename Shape>
struct UserGeometry;

class MeshObject final : public Object {
public:
    explicit MeshObject(std::shared_ptr<const Mesh> mesh);

    bool fits(double rounding_error_local) const override;
    Box bounds() const override { return local().domain; }
    std::vector<double> reach(std::span<const glm::dvec3> directions, const Progress& progress) const override;
    void complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                  const Placement& placement) const override;
    void complete(std::span<Hit> hits, const RayPacket& rays_world, const double* t, LaneMask lanes,
                  const RootPacket& roots, const Placement& placement) const override;
    bool is_entering(const Hit& hit, const Ray& ray_world, bool rising) const override;
    void settle_order(std::span<Crossing> crossings, const Ray& ray_world, const Placement& placement) const override;
    glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards, const RayFrame& frame,
                               const Placement& placement) const override;

private:
    friend struct UserGeometry<MeshObject>;

    embree::GeometryHandle make_geometry(const Device& device, const BuildOptions& options, double rounding_error_local,
                                         const Progress& progress) override;
    Triangle triangle(std::uint64_t primitive) const
    {
        const glm::uvec3& face = mesh_->faces()[primitive];
        const std::vector<glm::dvec3>& vertices = mesh_->vertices();
        return {vertices[face.x], vertices[face.y], vertices[face.z]};
    }

    /// Whether a ray meets one of the mesh's triangles before another.
    bool is_before(const TriangleRay& ray, const TriangleHit& first, std::uint64_t first_primitive,
                   const TriangleHit& second, std::uint64_t second_primitive) const;
    /// Adds a triangle to the first hits in meshes; returns that in this mesh.
    const MeshHit& add(const TriangleRay& ray, std::uint32_t slot, std::uint32_t primitive, const TriangleHit& hit,
                       MeshHits& to) const;
    /// The hit of a triangle within the limits of a ray, if there is one; with `touches`, also where the ray touches
    /// it.
    std::optional<TriangleHit> hit_within(const TriangleRay& ray, std::uint32_t primitive, bool touches) const;

    Box box(unsigned int primitive) const;
    void intersect_one(const RTCIntersectFunctionNArguments& arguments) const;
    void intersect_packet(const RTCIntersectFunctionNArguments& arguments) const;
    bool is_occluded(unsigned int primitive, RayQuery& query) const;
    LaneMask occluded_lanes(unsigned int primitive, LaneMask active, PacketOcclusion& query) const;

    std::shared_ptr<const Mesh> mesh_;
    glm::dvec3 centre_;
    double box_margin_ = 0.0; ///< boxes are wider than their triangles by this on every side
};

} // namespace isospline
