// A mesh as Embree triangle geometry.
#pragma once

#include "isospline/scene/mesh.h"
#include "isospline/scene/object.h"

#include <memory>

namespace isospline {

/// Its local space is the mesh's own, moved so that its box is centred: single precision then spends its digits on the
/// shape.
class MeshObject final : public Object {
public:
    explicit MeshObject(std::shared_ptr<const Mesh> mesh);

    bool fits(double) const override { return true; }
    void complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                  const Placement& placement) const override;
    void complete(std::span<Hit> hits, std::span<const Ray> rays_world, LaneMask lanes, const RootPacket& roots,
                  const Placement& placement) const override;
    bool is_entering(const Hit& hit, const Ray& ray_world, bool rising) const override;
    bool is_same_crossing(const Crossing& a, const Crossing& b, const Ray& ray_world,
                          const Placement& placement) const override;
    glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards, const glm::dvec3& centre,
                               const Placement& placement) const override;

private:
    embree::GeometryHandle make_geometry(const Device& device, double rounding_error_local) override;

    std::shared_ptr<const Mesh> mesh_;
    glm::dvec3 centre_;
};

} // namespace isospline
