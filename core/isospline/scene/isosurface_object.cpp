#include "isospline/scene/isosurface_object.h"

#include "isospline/math/affine.h"
#include "isospline/scene/ray_query.h"
#include "isospline/scene/user_geometry.h"
#include "isospline/trace/surface_hit.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

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
    return UserGeometry<IsosurfaceObject>::make(device, *this, groups_.size() + cap_boxes_.size());
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

Box IsosurfaceObject::box(unsigned int primitive) const
{
    const std::size_t group_count = groups_.size();
    const Box box =
        primitive < group_count ? isospline::bounds(groups_[primitive]) : cap_boxes_[primitive - group_count];
    return {box.lower - box_margin_, box.upper + box_margin_};
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

bool IsosurfaceObject::is_occluded(unsigned int primitive, RayQuery& query) const
{
    query.enter(query.instID[0], *surface_);
    if (!query.clip_leaves_any)
        return false;
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
