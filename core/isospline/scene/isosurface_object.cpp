#include "isospline/scene/isosurface_object.h"

#include "isospline/cell/packet_clip.h"
#include "isospline/math/affine.h"
#include "isospline/query/reach.h"
#include "isospline/scene/leaf_tree_builder.h"
#include "isospline/scene/packet_occlusion.h"
#include "isospline/scene/user_geometry.h"
#include "isospline/trace/surface_hit.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace isospline {

namespace {

/// Enough for scenes of some hundred cells across, without a measurable cost.
constexpr double least_box_margin = 0x1p-10;

/// The cost of a settled index, as a multiple of n^(2/3), where n is the number of bricks that the surface crosses: it
/// takes about 40 us of a processor for each, and a ray, which passes about n^(1/3) of them, saves n^(1/3) / 16 times
/// its SettlingGain.
constexpr double settling_cost_of_bricks = 8000.0;

} // namespace

IsosurfaceObject::IsosurfaceObject(std::shared_ptr<const IsosurfaceSnapshot> surface, Index index)
    : Object({surface->volume().lattice_to_world(), domain_lattice(surface->volume())}), surface_(std::move(surface)),
      index_(index), intersector_(cell_intersector(surface_->volume().degree(), surface_->options().method)),
      tracer_(brick_tracer())
{
}

bool IsosurfaceObject::fits(double rounding_error_local) const
{
    // Margins are larger than needed, so that adding and moving objects does not rebuild all others.
    return rounding_error_local <= box_margin_ &&
           (box_margin_ <= least_box_margin || rounding_error_local >= box_margin_ / 16.0);
}

std::uint64_t IsosurfaceObject::settling_cost() const
{
    // Leaves need the coefficients in memory.
    if (index_ == Index::settled || surface_->volume().source() != nullptr)
        return 0;
    const double root = std::cbrt(1.0 + static_cast<double>(surface_->bricks().count()));
    return static_cast<std::uint64_t>(settling_cost_of_bricks * root * root);
}

std::shared_ptr<Object> IsosurfaceObject::settled() const
{
    if (settling_cost() == 0)
        return nullptr;
    return std::make_shared<IsosurfaceObject>(surface_, Index::settled);
}

embree::GeometryHandle IsosurfaceObject::make_geometry(const Device& device, const BuildOptions&,
                                                       double rounding_error_local, const Progress& progress)
{
    box_margin_ = std::max(2.0 * rounding_error_local, least_box_margin);
    if (index_ == Index::settled)
        leaves_.emplace(surface_->volume(), surface_->bricks(), part_of(progress, 0.0, 0.6));
    else
        boxes_ = shell_boxes(surface_->bricks());
    caps_ = cap_boxes(*surface_);
    if (leaves_ && leaves_->size() != 0 && leaves_->size() < LeafTree::leaf_bit && caps_.boxes.empty())
        tree_ = build_leaf_tree(
            device, leaves_->size(), [this](unsigned int i) { return box(i); }, part_of(progress, 0.6, 1.0));
    return UserGeometry<IsosurfaceObject>::make(device, *this, box_count() + caps_.boxes.size());
}

std::size_t IsosurfaceObject::own_memory() const
{
    return boxes_.capacity() * sizeof(ShellBox) + (leaves_ ? leaves_->memory() : 0) + (tree_ ? tree_->memory() : 0) +
           caps_.boxes.capacity() * sizeof(Box) + surface_->memory();
}

Box IsosurfaceObject::bounds() const
{
    return bounds_lattice(*surface_);
}

std::vector<double> IsosurfaceObject::reach(std::span<const glm::dvec3> directions, const Progress& progress) const
{
    return reach_lattice(*surface_, directions, progress);
}

void IsosurfaceObject::complete(Hit& hit, const Ray& ray_world, const glm::dvec3& gradient_local,
                                const Placement& placement) const
{
    hit.position = ray_world.at(hit.t);
    set_surface_normal(hit, gradient_local, surface_->options().inside, placement.world_to_local);
    if (surface_->is_cap(hit.primitive_id)) {
        const glm::dvec3& into_solid = surface_->cut_of(hit.primitive_id).normal;
        hit.normal = -glm::normalize(transform_gradient(placement.world_to_local, into_solid));
    }
}

void IsosurfaceObject::complete(std::span<Hit> hits, const RayPacket& rays_world, const double* t, LaneMask lanes,
                                const RootPacket& roots, const Placement& placement) const
{
    SurfaceHitPacket found;
    set_surface_hits(found, rays_world, t, roots, surface_->options().inside, placement.world_to_local);
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        Hit& hit = hits[static_cast<std::size_t>(lane)];
        if (surface_->is_cap(hit.primitive_id)) {
            complete(hit, rays_world.ray(lane), roots.root(lane).gradient, placement);
            continue;
        }
        hit.position = {found.position[0][lane], found.position[1][lane], found.position[2][lane]};
        hit.normal = {found.normal[0][lane], found.normal[1][lane], found.normal[2][lane]};
        hit.gradient_magnitude = found.gradient_magnitude[lane];
    }
}

bool IsosurfaceObject::is_entering(const Hit&, const Ray&, bool rising) const
{
    return rising == (surface_->options().inside == Inside::above);
}

Box IsosurfaceObject::box(unsigned int primitive) const
{
    const Box box = primitive >= box_count() ? caps_.boxes[primitive - box_count()]
                    : leaves_                ? bounds_of((*leaves_)[primitive])
                                             : bounds_of(surface_->bricks(), boxes_[primitive]);
    return {box.lower - box_margin_, box.upper + box_margin_};
}

// If a ray enters through a cap, nothing behind the cap is tested. A cap through which it leaves is the first hit only
// if there is no root; a root at the same t comes first. One test of a ray is enough: its limit only decreases.
std::optional<IsosurfaceObject::CapHit> IsosurfaceObject::first_cap(const CappedChord& chord, bool enters_cap,
                                                                    double t_limit) const
{
    const double t = enters_cap ? chord.t_near : chord.t_far;
    const int face = enters_cap ? chord.entry : chord.exit;
    if (!(t <= t_limit) || !(enters_cap || chord.leaves_cap(*surface_)))
        return std::nullopt;
    return CapHit{{t, gradient_lattice(*surface_, chord.at(t))}, surface_->cap_id(static_cast<std::size_t>(face))};
}

void IsosurfaceObject::intersect_one(const RTCIntersectFunctionNArguments& arguments) const
{
    auto& query = static_cast<RayQuery&>(*arguments.context);
    RTCRay& ray = reinterpret_cast<RTCRayHit*>(arguments.rayhit)->ray;
    const unsigned int slot = query.instID[0];
    query.enter(slot, *surface_, caps_);
    if (!query.clip_leaves_any)
        return;
    const bool of_caps = arguments.primID >= box_count();
    const LatticeRay& lattice_ray = query.in_lattice;
    if (query.all != nullptr) {
        if (!of_caps)
            collect_all(arguments.primID, query);
        return;
    }
    if (of_caps || query.enters_cap) {
        if (!std::exchange(query.needs_caps, false))
            return;
        const double t_limit = std::min(query.t_limit, static_cast<double>(ray.tfar));
        if (const std::optional<CapHit> cap = first_cap(query.chord, query.enters_cap, t_limit))
            query.record(cap->root, {slot, true, cap->primitive}, ray);
        return;
    }

    // The nearest hit so far ends the search, at its t. The ray inside a cell does not end there, however:
    // otherwise the last bit of a root would depend on the order in which cells are visited.
    struct Visit {
        const IsosurfaceObject& object;
        RayQuery& query;
        RTCRay& ray;
        unsigned int slot;
    } visit{*this, query, ray, slot};
    const auto record = [](void* context, const CellCoefficients& cell, const glm::ivec3& index) {
        const Visit& of = *static_cast<Visit*>(context);
        if (const std::optional<RootInCell> root = of.object.intersector_.first_root(cell, of.query.in_lattice))
            of.query.record(*root, {of.slot, false, of.object.surface_->volume().primitive_id(index)}, of.ray);
        return std::min(of.query.t_limit, of.query.in_lattice.t_far);
    };
    trace(arguments.primID, lattice_ray, std::min(query.t_limit, lattice_ray.t_far), {record, &visit});
}

void IsosurfaceObject::trace(unsigned int primitive, const LatticeRay& ray, double t_limit,
                             const RayVisitor& visitor) const
{
    const auto margin = static_cast<float>(box_margin_);
    if (leaves_)
        tracer_.trace_leaf(*leaves_, (*leaves_)[primitive], ray, margin, t_limit, visitor);
    else
        tracer_.trace(surface_->bricks(), boxes_[primitive], ray, margin, t_limit, visitor);
}

LaneMask IsosurfaceObject::clip_rays(LatticeRayPacket& rays, LaneMask lanes) const
{
    const std::vector<HalfSpace>& planes = surface_->planes().all();
    PlanesOfChords through;
    return planes.empty() ? lanes : clip(rays, lanes, planes, through);
}

void IsosurfaceObject::trace(const RayStream& stream) const
{
    trace_stream(*tree_, *leaves_, static_cast<float>(box_margin_), intersector_, stream);
}

void IsosurfaceObject::collect_all(unsigned int primitive, RayQuery& query) const
{
    struct Visit {
        const IsosurfaceObject& object;
        RayQuery& query;
        std::vector<CrossingInCell> crossings;
    } visit{*this, query, {}};
    const auto collect = [](void* context, const CellCoefficients& cell, const glm::ivec3& index) {
        Visit& of = *static_cast<Visit*>(context);
        const LatticeRay& ray = of.query.in_lattice;
        of.crossings.clear();
        of.object.intersector_.all_roots(cell, ray, of.crossings);
        for (const CrossingInCell& crossing : of.crossings)
            of.query.all->push_back({crossing, ray.inside_cell(cell.lower).t_near, of.query.cached_slot,
                                     of.object.surface_->volume().primitive_id(index)});
        return ray.t_far;
    };
    trace(primitive, query.in_lattice, query.in_lattice.t_far, {collect, &visit});
}

void IsosurfaceObject::intersect_packet(const RTCIntersectFunctionNArguments& arguments) const
{
    auto& query = static_cast<PacketQuery&>(*arguments.context);
    const unsigned int slot = query.instID[0];
    const unsigned int size = arguments.N;
    LaneMask active = active_lanes(arguments.valid, size);
    float* const t_far = &RTCRayN_tfar(RTCRayHitN_RayN(arguments.rayhit, size), size, 0);
    if (query.is_occlusion) {
        auto& list = static_cast<PacketOcclusion&>(query);
        occluded_lanes(arguments.primID, active, list);
        return list.end_rays(active, t_far);
    }
    query.enter(slot, *surface_, caps_);
    active &= query.clip_leaves;
    const bool of_caps = arguments.primID >= box_count();
    const LaneMask to_test = (of_caps ? active : active & query.enters_cap) & query.needs_caps;
    query.needs_caps &= ~to_test;
    for (LaneMask rest = to_test; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const double t_limit = std::min(query.t_limit[lane], static_cast<double>(t_far[lane]));
        const bool enters_cap = (query.enters_cap >> lane & 1u) != 0;
        if (const std::optional<CapHit> cap = first_cap(query.chords[lane], enters_cap, t_limit))
            query.record(lane, cap->root, {slot, true, cap->primitive}, t_far[lane]);
    }
    active &= ~query.enters_cap;
    if (of_caps || active == 0)
        return;

    struct Visit {
        const IsosurfaceObject& object;
        PacketQuery& query;
        float* t_far;
        unsigned int slot;
    } visit{*this, query, t_far, slot};
    const auto record = [](void* context, const CandidateCells& cells) {
        const Visit& of = *static_cast<Visit*>(context);
        const IsosurfaceSnapshot& surface = *of.object.surface_;
        RootPacket roots;
        const LaneMask found = of.object.intersector_.first_roots(cells, surface.threshold(), of.query.in_lattice,
                                                                  of.query.t_limit, roots);
        std::uint64_t primitives[packet_capacity];
        for (LaneMask rest = found; rest != 0; rest &= rest - 1u) {
            const int lane = std::countr_zero(rest);
            primitives[lane] = surface.volume().primitive_id(cells.lower_of(lane));
        }
        of.query.record(found, roots, of.slot, primitives, of.t_far);
        return found != 0;
    };
    trace(arguments.primID, query.in_lattice, active, {record, &visit, query.t_limit});
}

void IsosurfaceObject::trace(unsigned int primitive, const LatticeRayPacket& rays, LaneMask active,
                             const PacketVisitor& visitor) const
{
    const auto margin = static_cast<float>(box_margin_);
    if (leaves_)
        tracer_.trace_packet_in_leaf(*leaves_, (*leaves_)[primitive], rays, margin, active, visitor);
    else
        tracer_.trace_packet(surface_->bricks(), boxes_[primitive], rays, margin, active, visitor);
}

bool IsosurfaceObject::is_occluded(unsigned int primitive, RayQuery& query) const
{
    query.enter(query.instID[0], *surface_, caps_);
    if (!query.clip_leaves_any)
        return false;
    if (query.enters_cap)
        return true;
    if (primitive >= box_count())
        return std::exchange(query.needs_caps, false) && query.chord.leaves_cap(*surface_);
    struct Visit {
        const IsosurfaceObject& object;
        const LatticeRay& ray;
        bool is_occluded;
    } visit{*this, query.in_lattice, false};
    const auto test = [](void* context, const CellCoefficients& cell, const glm::ivec3&) {
        Visit& of = *static_cast<Visit*>(context);
        of.is_occluded = of.object.intersector_.any_root(cell, of.ray);
        return of.is_occluded ? -huge_inverse : of.ray.t_far;
    };
    trace(primitive, query.in_lattice, query.in_lattice.t_far, {test, &visit});
    return visit.is_occluded;
}

LaneMask IsosurfaceObject::occluded_lanes(unsigned int primitive, LaneMask active, PacketOcclusion& query) const
{
    const std::uint32_t slot = query.instID[0];
    query.enter(slot, *this);
    if (!query.needs_each())
        query.set_occluded(active & query.clip_leaves & query.enters_cap & ~query.occluded);
    const LaneMask rest = active & query.clip_leaves & ~query.occluded;
    if (primitive < box_count()) {
        query.test(primitive, rest);
        return active & query.occluded;
    }
    if (query.all != nullptr) // they follow from the chords
        return 0;
    for (LaneMask lanes = query.without_caps(slot, rest); lanes != 0; lanes &= lanes - 1u) {
        const int lane = std::countr_zero(lanes);
        const CappedChord& chord = query.chords[lane];
        const std::optional<CappedEnds> ends = chord.certain_ends(*surface_);
        if (query.absorption != nullptr && !ends) {
            query.set_undecided(lane);
            continue;
        }
        const auto cross = [&](double t, int face) {
            query.cross(lane, slot, query.prepared.limits[lane].given_t(t),
                        surface_->cap_id(static_cast<std::size_t>(face)), gradient_lattice(*surface_, chord.at(t)));
        };
        if (ends && ends->entry)
            cross(chord.t_near, chord.entry);
        if (!ends || ends->exit)
            cross(chord.t_far, chord.exit);
    }
    return active & query.occluded;
}

} // namespace isospline
