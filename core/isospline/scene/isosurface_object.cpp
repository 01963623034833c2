#include "isospline/scene/isosurface_object.h"

#include "isospline/math/affine.h"
#include "isospline/scene/ray_query.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/error.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace isospline {

namespace {

/// Room for scenes of some hundred cells across, at no cost that shows.
constexpr double least_box_margin = 0x1p-10;

/// Bit i for lane i, for loops that a compiler makes vectors of.
constexpr auto lane_bits = [] {
    std::array<LaneMask, LatticeRayPacket::capacity> bits{};
    for (std::size_t lane = 0; lane < bits.size(); ++lane)
        bits[lane] = LaneMask{1} << lane;
    return bits;
}();

/// The box of the cells of the shell and of the caps, in lattice space.
Box bounds_of(const IsosurfaceSnapshot& surface)
{
    Box bounds;
    for (const Cell& cell : surface.shell().cells()) {
        const glm::dvec3 lower(cell.x, cell.y, cell.z);
        bounds.lower = glm::min(bounds.lower, lower);
        bounds.upper = glm::max(bounds.upper, lower + 1.0);
    }
    for (const Box& box : cap_boxes(surface)) {
        bounds.lower = glm::min(bounds.lower, box.lower);
        bounds.upper = glm::max(bounds.upper, box.upper);
    }
    return bounds;
}

/// Of the cells that a ray meets, the one that it meets first.
int nearest_cell(const GroupEntries& entries)
{
    int nearest = std::countr_zero(entries.cells);
    for (unsigned rest = entries.cells & (entries.cells - 1u); rest != 0; rest &= rest - 1u)
        if (const int cell = std::countr_zero(rest); entries.t_near[cell] < entries.t_near[nearest])
            nearest = cell;
    return nearest;
}

} // namespace

IsosurfaceObject::IsosurfaceObject(std::shared_ptr<const IsosurfaceSnapshot> surface)
    : Object({surface->volume().lattice_to_world(), bounds_of(*surface)}), surface_(std::move(surface)),
      intersector_(cell_intersector(surface_->volume().degree(), surface_->options().method)), culler_(group_culler())
{
}

bool IsosurfaceObject::fits(double rounding_error_local) const
{
    // Margins are built with room to grow, so that adding and moving objects does not rebuild all others.
    return rounding_error_local <= box_margin_ &&
           (box_margin_ <= least_box_margin || rounding_error_local >= box_margin_ / 16.0);
}

embree::GeometryHandle IsosurfaceObject::make_geometry(const Device& device, double rounding_error_local)
{
    box_margin_ = std::max(2.0 * rounding_error_local, least_box_margin);
    groups_ = cell_groups(*surface_);
    cap_boxes_ = cap_boxes(*surface_);
    embree::GeometryHandle geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
    device.check();
    rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned int>(groups_.size() + cap_boxes_.size()));
    rtcSetGeometryUserData(geometry.get(), this);
    rtcSetGeometryBoundsFunction(geometry.get(), bounds_function, nullptr);
    rtcSetGeometryIntersectFunction(geometry.get(), intersect_function);
    rtcSetGeometryOccludedFunction(geometry.get(), occluded_function);
    return geometry;
}

std::size_t IsosurfaceObject::own_memory() const
{
    return groups_.capacity() * sizeof(CellGroup) + cap_boxes_.capacity() * sizeof(Box);
}

void IsosurfaceObject::complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                                const Placement& placement) const
{
    hit.position = ray_world.at(hit.t);
    set_surface_normal(hit, gradient_local, surface_->options().inside, placement.world_to_local);
    if (surface_->is_cap(hit.primitive_id)) {
        const HalfSpace& cut = surface_->clip_lattice()[hit.primitive_id - surface_->shell().count()];
        hit.normal = -glm::normalize(transform_gradient(placement.world_to_local, cut.normal));
    }
}

void IsosurfaceObject::complete(std::span<Hit> hits, std::span<const Ray> rays_world, LaneMask lanes,
                                const RootPacket& roots, const Placement& placement) const
{
    NormalPacket normals;
    surface_normals(roots, surface_->options().inside, placement.world_to_local, normals);
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const auto i = static_cast<std::size_t>(lane);
        Hit& hit = hits[i];
        if (surface_->is_cap(hit.primitive_id)) {
            complete(hit, rays_world[i], roots.root(lane).gradient, placement);
            continue;
        }
        hit.position = rays_world[i].at(hit.t);
        hit.normal = {normals.normal[0][lane], normals.normal[1][lane], normals.normal[2][lane]};
        hit.gradient_magnitude = normals.magnitude[lane];
    }
}

bool IsosurfaceObject::is_entering(const Hit&, const Ray&, bool rising) const
{
    return rising == (surface_->options().inside == Inside::above);
}

bool IsosurfaceObject::is_same_crossing(const Crossing& a, const Crossing& b, const Ray& ray_world,
                                        const Placement& placement) const
{
    // f is continuous: of two crossings in a row one enters and one leaves. Two of a kind are one, found in both cells
    // of the face that it lies on.
    const double speed = glm::length(transform_vector(placement.world_to_local, ray_world.direction));
    return std::abs(a.hit.t - b.hit.t) * speed <= 8.0 * cell_margin;
}

void IsosurfaceObject::bounds_function(const RTCBoundsFunctionArguments* arguments)
{
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    const std::size_t primitive = arguments->primID, group_count = self.groups_.size();
    const Box box =
        primitive < group_count ? isospline::bounds(self.groups_[primitive]) : self.cap_boxes_[primitive - group_count];
    const auto margin = static_cast<float>(self.box_margin_);
    RTCBounds& bounds = *arguments->bounds_o;
    bounds.lower_x = static_cast<float>(box.lower.x) - margin;
    bounds.lower_y = static_cast<float>(box.lower.y) - margin;
    bounds.lower_z = static_cast<float>(box.lower.z) - margin;
    bounds.upper_x = static_cast<float>(box.upper.x) + margin;
    bounds.upper_y = static_cast<float>(box.upper.y) + margin;
    bounds.upper_z = static_cast<float>(box.upper.z) + margin;
}

void IsosurfaceObject::intersect_function(const RTCIntersectFunctionNArguments* arguments)
{
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    if (arguments->N == 1)
        self.intersect_one(*arguments);
    else
        self.intersect_packet(*arguments);
}

void IsosurfaceObject::intersect_one(const RTCIntersectFunctionNArguments& arguments) const
{
    if (arguments.valid[0] != -1)
        return;
    auto& query = static_cast<RayQuery&>(*arguments.context);
    auto& [ray, hit] = *reinterpret_cast<RTCRayHit*>(arguments.rayhit);
    const unsigned int slot = query.instID[0];
    query.enter(slot, *surface_);
    if (!query.clip_leaves_any)
        return;
    const bool of_caps = arguments.primID >= groups_.size();
    const LatticeRay& lattice_ray = query.in_lattice;
    if (query.all != nullptr) {
        if (!of_caps)
            collect_all(arguments.primID, query, lattice_ray);
        return;
    }
    if (of_caps || query.enters_cap)
        return intersect_caps(arguments, query);

    // Nothing counts behind the nearest root so far, kept exactly, or the nearest triangle. The ray in a cell does not
    // end there, though: a root would depend, in its last bit, on the order in which cells and triangles are visited.
    query.nearest.t = std::min(query.nearest.t, static_cast<double>(ray.tfar));
    const CellGroup& group = groups_[arguments.primID];
    GroupEntries entries = culler_.entries(group, lattice_ray, static_cast<float>(box_margin_));
    while (entries.cells != 0) {
        const int cell = nearest_cell(entries);
        if (static_cast<double>(entries.t_near[cell]) > query.nearest.t)
            return;
        entries.cells &= ~(1u << cell);
        const std::optional<RootInCell> root = intersector_.first_root(cell_block(group, cell), lattice_ray);
        if (!root || root->t > query.nearest.t)
            continue;
        query.nearest = *root;
        ray.tfar = rounded_up(root->t);
        hit.Ng_x = hit.Ng_y = hit.Ng_z = 0.0f;
        hit.u = hit.v = 0.0f;
        hit.geomID = 0;
        hit.primID = group.row(cell);
        hit.instID[0] = slot;
    }
}

void IsosurfaceObject::collect_all(unsigned int primitive, RayQuery& query, const LatticeRay& ray) const
{
    const CellGroup& group = groups_[primitive];
    const GroupEntries entries = culler_.entries(group, ray, static_cast<float>(box_margin_));
    std::vector<CrossingInCell> crossings;
    for (unsigned rest = entries.cells; rest != 0; rest &= rest - 1u) {
        const int cell = std::countr_zero(rest);
        crossings.clear();
        intersector_.all_roots(cell_block(group, cell), ray, crossings);
        for (const CrossingInCell& crossing : crossings)
            query.all->push_back({crossing, glm::vec2(0.0f), query.instID[0], group.row(cell)});
    }
}

void IsosurfaceObject::intersect_packet(const RTCIntersectFunctionNArguments& arguments) const
{
    auto& query = static_cast<PacketQuery&>(*arguments.context);
    const unsigned int slot = query.instID[0];
    query.enter(slot, *surface_);
    const unsigned int size = arguments.N;
    LaneMask active = 0;
    for (unsigned int lane = 0; lane < size; ++lane)
        active |= static_cast<LaneMask>(arguments.valid[lane]) & lane_bits[lane];
    active &= query.clip_leaves;
    const bool of_caps = arguments.primID >= groups_.size();
    if (const LaneMask at_caps = of_caps ? active : active & query.enters_cap; at_caps != 0)
        intersect_caps(arguments, query, at_caps);
    active &= ~query.enters_cap;
    if (of_caps || active == 0)
        return;

    RTCRayN* const rays = RTCRayHitN_RayN(arguments.rayhit, size);
    float* const t_far = &RTCRayN_tfar(rays, size, 0);
    for (unsigned int lane = 0; lane < size; ++lane)
        query.nearest.t[lane] = std::min(query.nearest.t[lane], static_cast<double>(t_far[lane]));
    const CellGroup& group = groups_[arguments.primID];
    const auto lanes = culler_.lanes(group, query.in_lattice, query.nearest.t, active, static_cast<float>(box_margin_));

    // Nearest cells first, as the first ray has them.
    RTCHitN* const hits = RTCRayHitN_HitN(arguments.rayhit, size);
    const int any_lane = std::countr_zero(active);
    std::size_t flip = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        flip |= static_cast<std::size_t>(query.in_lattice.direction[axis][any_lane] < 0.0) << axis;
    for (std::size_t i = 0; i < CellGroup::capacity; ++i) {
        const std::size_t cell = i ^ flip;
        if (lanes[cell] == 0)
            continue;
        const int member = static_cast<int>(cell);
        const LaneMask found =
            intersector_.first_roots(cell_block(group, member), query.in_lattice, lanes[cell], query.nearest);
        if (found == 0)
            continue;
        const std::uint32_t row = group.row(member);
        for (LaneMask rest = found; rest != 0; rest &= rest - 1u) {
            const auto lane = static_cast<unsigned int>(std::countr_zero(rest));
            t_far[lane] = rounded_up(query.nearest.t[lane]);
            RTCHitN_u(hits, size, lane) = RTCHitN_v(hits, size, lane) = 0.0f;
            RTCHitN_geomID(hits, size, lane) = 0;
            RTCHitN_primID(hits, size, lane) = row;
            RTCHitN_instID(hits, size, lane, 0) = slot;
        }
    }
}

void IsosurfaceObject::occluded_function(const RTCOccludedFunctionNArguments* arguments)
{
    ISOSPLINE_ASSERT(arguments->N, ==, 1u);
    if (arguments->valid[0] != -1)
        return;
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    auto& query = static_cast<RayQuery&>(*arguments->context);
    auto& ray = *reinterpret_cast<RTCRay*>(arguments->ray);
    query.enter(query.instID[0], *self.surface_);
    if (query.clip_leaves_any && self.is_occluded(arguments->primID, query))
        ray.tfar = -std::numeric_limits<float>::infinity();
}

bool IsosurfaceObject::is_occluded(unsigned int primitive, const RayQuery& query) const
{
    if (query.enters_cap)
        return true;
    if (primitive >= groups_.size())
        return query.chord.leaves_cap(*surface_);
    const CellGroup& group = groups_[primitive];
    const GroupEntries entries = culler_.entries(group, query.in_lattice, static_cast<float>(box_margin_));
    for (unsigned rest = entries.cells; rest != 0; rest &= rest - 1u)
        if (intersector_.any_root(cell_block(group, std::countr_zero(rest)), query.in_lattice))
            return true;
    return false;
}

} // namespace isospline
