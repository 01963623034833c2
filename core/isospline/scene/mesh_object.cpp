#include "isospline/scene/mesh_object.h"

#include "isospline/math/affine.h"

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vector_relational.hpp>

#include <bit>
#include <cmath>
#include <cstddef>

namespace isospline {

namespace {

glm::dvec3 centre_of(const Mesh& mesh)
{
    return mesh.bounds().empty() ? glm::dvec3(0.0) : mesh.bounds().center();
}

} // namespace

MeshObject::MeshObject(std::shared_ptr<const Mesh> mesh)
    : Object({glm::translate(glm::dmat4(1.0), centre_of(*mesh)),
              {mesh->bounds().lower - centre_of(*mesh), mesh->bounds().upper - centre_of(*mesh)}}),
      mesh_(std::move(mesh)), centre_(centre_of(*mesh_))
{
}

embree::GeometryHandle MeshObject::make_geometry(const Device& device, double)
{
    embree::GeometryHandle geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    device.check();
    const std::size_t vertex_count = mesh_->vertices().size(), face_count = mesh_->faces().size();
    if (face_count > 0) {
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertex_count));
        auto* faces = static_cast<unsigned int*>(rtcSetNewGeometryBuffer(
            geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned int), face_count));
        device.check();
        for (std::size_t i = 0; i < vertex_count; ++i)
            for (int axis = 0; axis < 3; ++axis)
                vertices[3 * i + static_cast<std::size_t>(axis)] =
                    static_cast<float>(mesh_->vertices()[i][axis] - centre_[axis]);
        for (std::size_t i = 0; i < face_count; ++i)
            for (int corner = 0; corner < 3; ++corner)
                faces[3 * i + static_cast<std::size_t>(corner)] = mesh_->faces()[i][corner];
    }
    return geometry;
}

void MeshObject::complete(Hit& hit, const Ray& ray_world, const glm::dvec3&, const Placement& placement) const
{
    const glm::uvec3& face = mesh_->faces()[hit.primitive_id];
    const glm::dvec3 a = transform_point(placement.transform, mesh_->vertices()[face.x]);
    const glm::dvec3 b = transform_point(placement.transform, mesh_->vertices()[face.y]);
    const glm::dvec3 c = transform_point(placement.transform, mesh_->vertices()[face.z]);
    glm::dvec3 normal = glm::cross(b - a, c - a);
    // A mirroring transform turns the order of the corners around.
    if (glm::determinant(glm::dmat3(placement.transform)) < 0.0)
        normal = -normal;

    // Embree's t is rounded to single precision: take it again from the triangle's plane, unless the ray grazes it.
    const double cosine = glm::dot(normal, ray_world.direction);
    const double t_plane = glm::dot(a - ray_world.origin, normal) / cosine;
    const double area = glm::length(normal);
    if (std::abs(cosine) > 1e-3 * area * glm::length(ray_world.direction))
        hit.t = t_plane;
    hit.position = ray_world.at(hit.t);
    hit.normal = area > 0.0 ? normal / area : glm::dvec3(0.0);
}

void MeshObject::complete(std::span<Hit> hits, std::span<const Ray> rays_world, LaneMask lanes, const RootPacket&,
                          const Placement& placement) const
{
    for (LaneMask rest = lanes; rest != 0; rest &= rest - 1u) {
        const auto i = static_cast<std::size_t>(std::countr_zero(rest));
        complete(hits[i], rays_world[i], glm::dvec3(0.0), placement);
    }
}

bool MeshObject::is_entering(const Hit& hit, const Ray& ray_world, bool) const
{
    return glm::dot(hit.normal, ray_world.direction) < 0.0;
}

bool MeshObject::is_same_crossing(const Crossing& a, const Crossing& b, const Ray& ray_world,
                                  const Placement& placement) const
{
    // Both triangles of an edge, or all of a corner, meet a ray that goes through it, in single precision.
    const glm::uvec3 &first = mesh_->faces()[a.hit.primitive_id], &second = mesh_->faces()[b.hit.primitive_id];
    const auto has = [&](unsigned int vertex) { return glm::any(glm::equal(second, glm::uvec3(vertex))); };
    if (!has(first.x) && !has(first.y) && !has(first.z))
        return false;
    constexpr double single_precision = 1e-6;
    const double size = glm::length(glm::dmat3(placement.transform) * mesh_->bounds().size());
    return std::abs(a.hit.t - b.hit.t) * glm::length(ray_world.direction) <= single_precision * size;
}

} // namespace isospline
