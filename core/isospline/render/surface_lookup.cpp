#include "isospline/render/surface_lookup.h"

#include "isospline/math/affine.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cstddef>
#include <variant>

namespace isospline {

namespace {

/// Weights of the corners of a triangle at a point of its plane, by areas; equal if the triangle has no area.
glm::dvec3 barycentric(const glm::dvec3& point, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c)
{
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double square = glm::dot(normal, normal);
    if (!(square > 0.0))
        return glm::dvec3(1.0 / 3.0);
    const double weight_b = glm::dot(glm::cross(point - a, c - a), normal) / square;
    const double weight_c = glm::dot(glm::cross(b - a, point - a), normal) / square;
    return {1.0 - weight_b - weight_c, weight_b, weight_c};
}

glm::dvec3 unit(const glm::dvec3& vector)
{
    const double length = glm::length(vector);
    return length > 0.0 ? vector / length : glm::dvec3(0.0);
}

/// Whether a mesh has anything that is interpolated between its vertices.
bool has_attributes(const Mesh& mesh)
{
    return !mesh.normals().empty() || !mesh.colors().empty() || !mesh.values().numbers.empty();
}

/// A shading normal on the same side as a normal of the face, as seen by the viewer: one that is beyond the horizon is
/// moved back to it.
glm::dvec3 on_same_side(const glm::dvec3& normal, const glm::dvec3& face_normal, const glm::dvec3& to_viewer)
{
    const double side = glm::dot(face_normal, to_viewer) < 0.0 ? -1.0 : 1.0;
    const double cosine = glm::dot(normal, to_viewer);
    if (side * cosine >= 0.0)
        return normal;
    constexpr double above_horizon = 1e-6;
    return glm::normalize(normal + (side * above_horizon - cosine) * to_viewer);
}

} // namespace

SurfaceLookup::SurfaceLookup(const SceneSnapshot& scene) : ids_(scene.ids())
{
    for (const std::uint32_t id : ids_) {
        const SnapshotObject& placed = scene.object(id);
        Entry& entry = entries_.emplace_back();
        entry.scene_to_object = glm::inverse(placed.transform);
        if (const auto* mesh = std::get_if<std::shared_ptr<const Mesh>>(&placed.object)) {
            entry.mesh = *mesh;
            entry.plain_primitives =
                entry.mesh->normals().empty() && entry.mesh->colors().empty() ? invalid_primitive_id : 0;
        } else {
            entry.surface = std::get<std::shared_ptr<const IsosurfaceSnapshot>>(placed.object);
            entry.plain_primitives = entry.surface->volume().cell_count();
            entry.scene_to_object = entry.surface->volume().world_to_index() * entry.scene_to_object;
        }
    }
}

void SurfaceLookup::complete(SurfacePoint& point, const Hit& hit, bool with_curvature) const
{
    const Entry& entry = this->entry(hit.geometry_id);
    point.on_cap = entry.surface && entry.surface->is_cap(hit.primitive_id);
    if (entry.surface && with_curvature && !point.on_cap) {
        // Index coordinates are a function x -> M x of world coordinates: M^T g and M^T H M are the derivatives there.
        const Volume& volume = entry.surface->volume();
        const glm::dvec3 position_index = transform_point(entry.scene_to_object, point.position);
        const glm::dmat3 map(entry.scene_to_object);
        const glm::dvec3 gradient = transform_gradient(entry.scene_to_object, volume.gradient(position_index));
        const glm::dmat3 hessian = glm::transpose(map) * volume.hessian(position_index) * map;
        point.curvature = curvature_of_level_surface(gradient, hessian);
        if (entry.surface->options().inside == Inside::above)
            point.curvature.mean = -point.curvature.mean;
    }
    if (entry.mesh && has_attributes(*entry.mesh)) {
        const Mesh& mesh = *entry.mesh;
        const glm::uvec3& face = mesh.faces()[hit.primitive_id];
        const auto& vertices = mesh.vertices();
        const glm::dvec3 weights = barycentric(transform_point(entry.scene_to_object, point.position), vertices[face.x],
                                               vertices[face.y], vertices[face.z]);
        if (const auto& colors = mesh.colors(); !colors.empty()) {
            const glm::dvec3 between =
                weights.x * colors[face.x] + weights.y * colors[face.y] + weights.z * colors[face.z];
            point.vertex_color = glm::max(between, 0.0); // rounding may leave the triangle
        }
        if (const auto& values = mesh.values().numbers; !values.empty())
            point.value = weights.x * values[face.x] + weights.y * values[face.y] + weights.z * values[face.z];
        if (const auto& normals = mesh.normals(); !normals.empty()) {
            const glm::dvec3 a = unit(normals[face.x]), b = unit(normals[face.y]), c = unit(normals[face.z]);
            const auto in_scene = [&](const glm::dvec3& n) { return transform_gradient(entry.scene_to_object, n); };
            const glm::dvec3 normal = in_scene(weights.x * a + weights.y * b + weights.z * c);
            // The outer side of the face is that of its vertices' normals, whatever their order says.
            const bool is_reversed = glm::dot(hit.normal, in_scene(a + b + c)) < 0.0;
            if (normal != glm::dvec3(0.0))
                point.normal = on_same_side(unit(normal), is_reversed ? -hit.normal : hit.normal, point.to_viewer);
        }
    }
}

} // namespace isospline
