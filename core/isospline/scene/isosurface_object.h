// An isosurface as Embree user geometry: boxes of octets or leaves in lattice space, then boxes of its caps.
#pragma once

#include "isospline/cell/intersector.h"
#include "isospline/scene/object.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/brick_trace.h"
#include "isospline/trace/cap.h"
#include "isospline/trace/ray_stream.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace isospline {

struct RayQuery;
struct PacketQuery;
struct PacketOcclusion;
template <typename Shape>
struct UserGeometry;

class IsosurfaceObject final : public Object {
public:
    /// The draft is built in some milliseconds: a box an octet of bricks, and rays make what they need. The settled
    /// index has a box around each leaf. Rays find the same hits in both, the settled one faster.
    enum class Index { draft, settled };

    explicit IsosurfaceObject(std::shared_ptr<const IsosurfaceSnapshot> surface, Index index = Index::draft);

    glm::ivec3 cell_shape() const override { return surface_->volume().cell_shape(); }
    bool fits(double rounding_error_local) const override;
    std::uint64_t settling_cost() const override;
    std::shared_ptr<Object> settled() const override;
    void complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                  const Placement& placement) const override;
    void complete(std::span<Hit> hits, const RayPacket& rays_world, const double* t, LaneMask lanes,
                  const RootPacket& roots, const Placement& placement) const override;
    const IsosurfaceObject* with_stream() const override { return tree_ ? this : nullptr; }
    Box bounds() const override;
    std::vector<double> reach(std::span<const glm::dvec3> directions, const Progress& progress) const override;
    bool is_entering(const Hit& hit, const Ray& ray_world, bool rising) const override;
    glm::dvec3 offset_position(const Hit& hit, const glm::dvec3& towards, const RayFrame& frame,
                               const Placement& placement) const override;

    /// Limits rays to the parts that the clip keeps; returns those of `lanes` of which a part is left. Without caps.
    LaneMask clip_rays(LatticeRayPacket& rays, LaneMask lanes) const;
    /// Traces rays in local space. For an object with_stream().
    void trace(const RayStream& stream) const;
    std::uint64_t primitive_id(const glm::ivec3& cell) const { return surface_->volume().primitive_id(cell); }

private:
    friend struct UserGeometry<IsosurfaceObject>;
    friend struct PacketOcclusion;

    embree::GeometryHandle make_geometry(const Device& device, const BuildOptions& options, double rounding_error_local,
                                         const Progress& progress) override;
    std::size_t own_memory() const override;

    Box box(unsigned int primitive) const;
    void intersect_one(const RTCIntersectFunctionNArguments& arguments) const;
    void collect_all(unsigned int primitive, RayQuery& query) const;
    void intersect_packet(const RTCIntersectFunctionNArguments& arguments) const;
    bool is_occluded(unsigned int primitive, RayQuery& query) const;
    LaneMask occluded_lanes(unsigned int primitive, LaneMask active, PacketOcclusion& query) const;

    /// The first cap along a chord, if there is one, as a root.
    struct CapHit {
        RootInCell root;
        std::uint64_t primitive;
    };
    std::optional<CapHit> first_cap(const CappedChord& chord, bool enters_cap, double t_limit) const;

    std::size_t box_count() const { return leaves_ ? leaves_->size() : boxes_.size(); }
    void trace(unsigned int primitive, const LatticeRay& ray, double t_limit, const RayVisitor& visitor) const;
    void trace(unsigned int primitive, const LatticeRayPacket& rays, LaneMask active,
               const PacketVisitor& visitor) const;

    std::shared_ptr<const IsosurfaceSnapshot> surface_;
    Index index_;
    CellIntersector intersector_;
    BrickTracer tracer_;
    std::vector<ShellBox> boxes_;  ///< of the draft
    std::optional<Leaves> leaves_; ///< of the settled index
    std::optional<LeafTree> tree_; ///< of these leaves, if there are any and no caps
    CapBoxes caps_;
    double box_margin_ = 0.0; ///< boxes are wider than their cells by this on every side
};

} // namespace isospline
