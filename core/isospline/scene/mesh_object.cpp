#include "isospline/scene/mesh_object.h"

#include "isospline/math/affine.h"
#include "isospline/scene/packet_occlusion.h"
#include "isospline/scene/user_geometry.h"

#include <glm/common.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <compare>
#include <cstddef>
#include <limits>
#include <vector>

namespace isospline {

namespace {

/// Enough for scenes several times as large as the mesh, in units of the mesh's size.
constexpr double least_mesh_margin = 0x1p-16;

glm::dvec3 centre_of(const Mesh& mesh)
{
    return mesh.bounds().empty() ? glm::dvec3(0.0) : mesh.bounds().center();
}

LocalSpace local_space(const Mesh& mesh)
{
    const glm::dvec3 centre = centre_of(mesh);
    const Box box{mesh.bounds().lower - centre, mesh.bounds().upper - centre};
    return {glm::translate(glm::dmat4(1.0), centre), box};
}

} // namespace

MeshObject::MeshObject(std::shared_ptr<const Mesh> mesh)
    : Object(local_space(*mesh)), mesh_(std::move(mesh)), centre_(centre_of(*mesh_))
{
}

bool MeshObject::fits(double rounding_error_local) const
{
    // Margins are larger than needed, as those of isosurfaces.
    const double least = least_mesh_margin * glm::length(mesh_->bounds().size());
    return rounding_error_local <= box_margin_ && (box_margin_ <= least || rounding_error_local >= box_margin_ / 16.0);
}

embree::GeometryHandle MeshObject::make_geometry(const Device& device, const BuildOptions&, double rounding_error_local,
                                                 const Progress&)
{
    box_margin_ = std::max(2.0 * rounding_error_local, least_mesh_margin * glm::length(mesh_->bounds().size()));
    return UserGeometry<MeshObject>::make(device, *this, mesh_->faces().size());
}

std::vector<double> MeshObject::reach(std::span<const glm::dvec3> directions, const Progress&) const
{
    std::vector<double> reach(directions.size(), -std::numeric_limits<double>::infinity());
    for (std::uint64_t face = 0; face < mesh_->faces().size(); ++face) {
        const auto [a, b, c] = triangle(face);
        for (std::size_t i = 0; i < directions.size(); ++i)
            for (const glm::dvec3& corner : {a, b, c})
                reach[i] = std::max(reach[i], glm::dot(directions[i], corner - centre_));
    }
    return reach;
}

Box MeshObject::box(unsigned int primitive) const
{
    const auto [a, b, c] = triangle(primitive);
    return {glm::min(glm::min(a, b), c) - centre_ - box_margin_, glm::max(glm::max(a, b), c) - centre_ + box_margin_};
}

std::optional<TriangleHit> MeshObject::hit_within(const TriangleRay& ray, std::uint32_t primitive, bool touches) const
{
    const Triangle candidate = triangle(primitive);
    const Passage found = passage(ray.origin, ray.direction, candidate);
    if (found != Passage::none)
        if (const TriangleHit hit = triangle_hit(ray, candidate, found); ray.has(hit.t))
            return hit;
    return touches ? triangle_touch(ray, candidate) : std::nullopt;
}

bool MeshObject::is_before(const TriangleRay& ray, const TriangleHit& first, std::uint64_t first_primitive,
                           const TriangleHit& second, std::uint64_t second_primitive) const
{
    const double gap = second.t - first.t;
    if (std::abs(gap) > first.t_error + second.t_error)
        return gap > 0.0;
    const std::weak_ordering order = exact_order(ray, triangle(first_primitive), triangle(second_primitive));
    return std::is_lt(order) || (std::is_eq(order) && first_primitive < second_primitive);
}

const MeshHit& MeshObject::add(const TriangleRay& ray, std::uint32_t slot, std::uint32_t primitive,
                               const TriangleHit& hit, MeshHits& to) const
{
    return to.add({slot, primitive, hit, hit.t}, [&](const MeshHit& a, const MeshHit& b) {
        return is_before(ray, a.hit, a.primitive, b.hit, b.primitive);
    });
}

void MeshObject::intersect_one(const RTCIntersectFunctionNArguments& arguments) const
{
    auto& query = static_cast<RayQuery&>(*arguments.context);
    const std::uint32_t slot = query.instID[0], primitive = arguments.primID;
    query.enter_mesh(slot);
    const std::optional<TriangleHit> found = hit_within(query.in_mesh, primitive, query.touches_meshes);
    if (!found)
        return;
    if (query.all != nullptr) {
        query.all->push_back({*found, found->t, slot, primitive});
        return;
    }
    RTCRay& ray = reinterpret_cast<RTCRayHit*>(arguments.rayhit)->ray;
    query.record(add(query.in_mesh, slot, primitive, *found, query.in_meshes), ray);
}

void MeshObject::intersect_packet(const RTCIntersectFunctionNArguments& arguments) const
{
    auto& query = static_cast<PacketQuery&>(*arguments.context);
    const std::uint32_t slot = query.instID[0], primitive = arguments.primID;
    const unsigned int size = arguments.N;
    const LaneMask active = active_lanes(arguments.valid, size);
    RTCRayN* const rays = RTCRayHitN_RayN(arguments.rayhit, size);
    if (query.is_occlusion) {
        auto& list = static_cast<PacketOcclusion&>(query);
        occluded_lanes(primitive, active, list);
        return list.end_rays(active, &RTCRayN_tfar(rays, size, 0));
    }
    query.enter_mesh(slot);
    const Triangle met = triangle(primitive);
    const LanePassages found = passages(query.in_mesh, met, active);

    for (LaneMask rest = found.along_normal | found.against_normal; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const TriangleRay ray = query.in_mesh.ray(lane);
        const bool along = (found.along_normal >> lane & 1u) != 0;
        const TriangleHit hit = triangle_hit(ray, met, along ? Passage::along_normal : Passage::against_normal);
        if (!ray.has(hit.t))
            continue;
        query.record(lane, add(ray, slot, primitive, hit, query.in_meshes[lane]),
                     RTCRayN_tfar(rays, size, static_cast<unsigned int>(lane)));
    }
}

bool MeshObject::is_occluded(unsigned int primitive, RayQuery& query) const
{
    query.enter_mesh(query.instID[0]);
    return hit_within(query.in_mesh, primitive, query.touches_meshes).has_value();
}

LaneMask MeshObject::occluded_lanes(unsigned int primitive, LaneMask active, PacketOcclusion& query) const
{
    const std::uint32_t slot = query.instID[0];
    query.enter_mesh(slot);
    const Triangle met = triangle(primitive);
    const LanePassages found = passages(query.in_mesh, met, active & ~query.occluded);
    for (LaneMask rest = found.along_normal | found.against_normal; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        const TriangleRay ray = query.in_mesh.ray(lane);
        const bool along = (found.along_normal >> lane & 1u) != 0;
        const TriangleHit hit = triangle_hit(ray, met, along ? Passage::along_normal : Passage::against_normal);
        if (ray.has(hit.t))
            query.cross(lane, slot, primitive, hit);
    }
    return active & query.occluded;
}

void MeshObject::complete(Hit& hit, const Ray& ray_world, const glm::dvec3&, const Placement& placement) const
{
    hit.position = ray_world.at(hit.t);
    hit.gradient_magnitude = 0.0;
    const auto [a, b, c] = triangle(hit.primitive_id);
    const glm::dmat3 linear(placement.transform);
    const glm::dvec3 normal = glm::cross(linear * (b - a), linear * (c - a));
    const double length = glm::length(normal);
    // A mirroring transform reverses the order of the corners.
    hit.normal = length > 0.0 ? normal / (glm::determinant(linear) < 0.0 ? -length : length) : glm::dvec3(0.0);
}

void MeshObject::complete(std::span<Hit> hits, const RayPacket& rays_world, const double*, LaneMask lanes,
                          const RootPacket&, const Placement& placement) const
{
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
        const int lane = std::countr_zero(rest);
        complete(hits[static_cast<std::size_t>(lane)], rays_world.ray(lane), glm::dvec3(0.0), placement);
    }
}

bool MeshObject::is_entering(const Hit& hit, const Ray& ray_world, bool) const
{
    return glm::dot(hit.normal, ray_world.direction) < 0.0;
}

void MeshObject::settle_order(std::span<Crossing> crossings, const Ray& ray_world, const Placement& placement) const
{
    if (crossings.size() < 2)
        return;
    const TriangleRay ray = ray_in_mesh(ray_world, placement);
    const auto hit_of = [&](const Crossing& crossing) {
        return triangle_hit(ray, triangle(crossing.hit.primitive_id),
                            crossing.entering ? Passage::against_normal : Passage::along_normal);
    };
    TriangleHit before = hit_of(crossings[0]);
    bool settled = true;
    for (std::size_t i = 1; i < crossings.size() && settled; ++i) {
        const TriangleHit hit = hit_of(crossings[i]);
        settled = hit.t - before.t > hit.t_error + before.t_error;
        before = hit;
    }
    if (settled)
        return;

    std::sort(crossings.begin(), crossings.end(), [&](const Crossing& a, const Crossing& b) {
        return is_before(ray, hit_of(a), a.hit.primitive_id, hit_of(b), b.hit.primitive_id);
    });
    // The first one gets the least t of all, as in MeshHits.
    for (std::size_t i = crossings.size() - 1; i > 0; --i)
        if (const double most = crossings[i].hit.t; crossings[i - 1].hit.t > most) {
            crossings[i - 1].hit.t = most;
            crossings[i - 1].hit.position = ray_world.at(most);
        }
}

} // namespace isospline
