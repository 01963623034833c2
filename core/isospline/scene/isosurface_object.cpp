#include "isospline/scene/isosurface_object.h"

#include "isospline/math/affine.h"
#include "isospline/scene/ray_query.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/error.h"
#include "isospline/util/fan_out.h"

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
    Box bounds = surface.shell().bounds();
    for (const Box& box : cap_boxes(surface))
        bounds.extend(box);
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
    : Object({surface->volume().lattice_to_world(), bounds_of(*surface), domain_lattice(surface->volume())}),
      surface_(std::move(surface)),
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

void IsosurfaceObject::bounds_function(const RTCBoundsFunctionArguments* arguments) noexcept
{
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    const FanOut::Task task(static_cast<const Object*>(&self));
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

void IsosurfaceObject::intersect_function(const RTCIntersectFunctionNArguments* arguments) noexcept
{
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    float* const t_far = &RTCRayN_tfar(RTCRayHitN_RayN(arguments->rayhit, arguments->N), arguments->N, 0);
    static_cast<Query&>(*arguments->context).guard(t_far, arguments->N, [&] {
        if (arguments->N == 1)
            self.intersect_one(*arguments);
        else
            self.intersect_packet(*arguments);
    });
}

// What is behind a cap that a ray comes in through is not looked at; a cap that it goes out through is the first hit
// only if no root is, and gives way to one at the same t.
std::optional<IsosurfaceObject::CapHit> IsosurfaceObject::first_cap(const CappedChord& chord, bool enters_cap,
                                                                    double t_limit) const
{
    const double t = enters_cap ? chord.t_near : chord.t_far;
    const int face = enters_cap ? chord.entry : chord.exit;
    if (!(t <= t_limit) || !(enters_cap || chord.leaves_cap(*surface_)))
        return std::nullopt;
    const auto primitive = static_cast<std::uint32_t>(surface_->shell().count()) + static_cast<std::uint32_t>(face);
    return CapHit{{t, gradient_lattice(*surface_, chord.at(t))}, primitive};
}

void IsosurfaceObject::intersect_one(const RTCIntersectFunctionNArguments& arguments) const
{
    if (arguments.valid[0] != -1)
        return;
    auto& query = static_cast<RayQuery&>(*arguments.context);
    RTCRay& ray = reinterpret_cast<RTCRayHit*>(arguments.rayhit)->ray;
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
    if (of_caps || query.enters_cap) {
        const double t_limit = std::min(query.nearest.t, static_cast<double>(ray.tfar));
        if (const std::optional<CapHit> cap = first_cap(query.chord, query.enters_cap, t_limit))
            query.record(cap->root, {slot, cap->primitive, true}, ray);
        return;
    }

    // Nothing counts behind the nearest hit so far, kept exactly. The ray in a cell does not end there, though: a root
    // would depend, in its last bit, on the order in which cells are visited.
    const CellGroup& group = groups_[arguments.primID];
    GroupEntries entries = culler_.entries(group, lattice_ray, static_cast<float>(box_margin_));
    while (entries.cells != 0) {
        const int cell = nearest_cell(entries);
        if (static_cast<double>(entries.t_near[cell]) > query.nearest.t)
            return;
        entries.cells &= ~(1u << cell);
        if (const std::optional<RootInCell> root = intersector_.first_root(cell_block(group, cell), lattice_ray))
            query.record(*root, {slot, group.row(cell), false}, ray);
    }
}

void IsosurfaceObject::collect_all(unsigned int primitive, RayQuery& query, const LatticeRay& ray) const
{
    const CellGroup& group = groups_[primitive];
    const GroupEntries entries = culler_.entries(group, ray, static_cast<float>(box_margin_));
    std::vector<CrossingInCell> crossings;
    for (unsigned rest = entries.cells; rest != 0; rest &= rest - 1u) {
        const int cell = std::countr_zero(rest);
        const CellBlock block = cell_block(group, cell);
        crossings.clear();
        intersector_.all_roots(block, ray, crossings);
        const double t_begin = ray.inside_cell(block.lower).t_near;
        for (const CrossingInCell& crossing : crossings)
            query.all->push_back({crossing, t_begin, query.instID[0], group.row(cell)});
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
    float* const t_far = &RTCRayN_tfar(RTCRayHitN_RayN(arguments.rayhit, size), size, 0);
    for (LaneMask rest = of_caps ? active : active & query.enters_cap; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const double t_limit = std::min(query.nearest.t[lane], static_cast<double>(t_far[lane]));
        const bool enters_cap = (query.enters_cap >> lane & 1u) != 0;
        if (const std::optional<CapHit> cap = first_cap(query.chords[lane], enters_cap, t_limit))
            query.record(lane, cap->root, {slot, cap->primitive, true}, t_far[lane]);
    }
    active &= ~query.enters_cap;
    if (of_caps || active == 0)
        return;

    const CellGroup& group = groups_[arguments.primID];
    const auto lanes = culler_.lanes(group, query.in_lattice, query.nearest.t, active, static_cast<float>(box_margin_));

    // Nearest cells first, as the first ray has them.
    const int any_lane = std::countr_zero(active);
    std::size_t flip = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        flip |= static_cast<std::size_t>(query.in_lattice.direction[axis][any_lane] < 0.0) << axis;
    RootPacket roots;
    for (std::size_t i = 0; i < CellGroup::capacity; ++i) {
        const std::size_t cell = i ^ flip;
        if (lanes[cell] == 0)
            continue;
        const int member = static_cast<int>(cell);
        const LaneMask found =
            intersector_.first_roots(cell_block(group, member), query.in_lattice, query.nearest.t, lanes[cell], roots);
        for (LaneMask rest = found; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            query.record(lane, roots.root(lane), {slot, group.row(member), false}, t_far[lane]);
        }
    }
}

void IsosurfaceObject::occluded_function(const RTCOccludedFunctionNArguments* arguments) noexcept
{
    ISOSPLINE_ASSERT(arguments->N, ==, 1u);
    if (arguments->valid[0] != -1)
        return;
    const auto& self = *static_cast<const IsosurfaceObject*>(arguments->geometryUserPtr);
    auto& query = static_cast<RayQuery&>(*arguments->context);
    auto& ray = *reinterpret_cast<RTCRay*>(arguments->ray);
    query.guard(&ray.tfar, 1, [&] {
        query.enter(query.instID[0], *self.surface_);
        if (query.clip_leaves_any && self.is_occluded(arguments->primID, query))
            ray.tfar = -std::numeric_limits<float>::infinity();
    });
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
