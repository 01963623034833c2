#include "isospline/scene/scene_points.h"

#include "isospline/math/affine.h"
#include "isospline/math/point_triangle.h"
#include "isospline/query/solid.h"
#include "isospline/scene/scene_snapshot_impl.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace isospline {

namespace {

/// A lower bound on the distance of a point from a box.
double distance_from(const Box& box, const glm::dvec3& point)
{
    return box.empty() ? std::numeric_limits<double>::infinity()
                       : glm::length(point - glm::clamp(point, box.lower, box.upper));
}

/// An upper bound on the factor by which a map changes lengths.
double largest_stretch(const glm::dmat3& map)
{
    double squares = 0.0;
    for (int column = 0; column < 3; ++column)
        squares += glm::dot(map[column], map[column]);
    return std::sqrt(squares);
}

const std::shared_ptr<const Mesh>* mesh_of(const Instance& instance)
{
    return std::get_if<std::shared_ptr<const Mesh>>(&instance.shown.object);
}

/// A point query of Embree, and the nearest point of the mesh found so far.
struct MeshQuery {
    const Mesh& mesh;
    const glm::dmat4& transform;
    glm::dvec3 point;      ///< world space
    double stretch, slack; ///< from distances in world space to radii of the query
    SceneClosestPoint& nearest;

    float radius() const
    {
        const double radius = nearest.distance * stretch * (1.0 + 1e-6) + slack;
        return radius < 1e30 ? static_cast<float>(radius) : std::numeric_limits<float>::infinity();
    }

    /// Whether the triangle is nearer than the nearest point so far.
    bool meet(std::uint32_t face, std::uint32_t geometry_id)
    {
        const glm::uvec3& corners = mesh.faces()[face];
        const auto& vertices = mesh.vertices();
        const glm::dvec3 a = transform_point(transform, vertices[corners.x]);
        const glm::dvec3 b = transform_point(transform, vertices[corners.y]);
        const glm::dvec3 c = transform_point(transform, vertices[corners.z]);
        const glm::dvec2 uv = closest_on_triangle(point, a, b, c);
        const glm::dvec3 position = a + uv.x * (b - a) + uv.y * (c - a);
        const double distance = glm::length(position - point);
        const auto ids = std::pair(geometry_id, static_cast<std::uint64_t>(face));
        const bool is_nearer =
            distance < nearest.distance ||
            (distance == nearest.distance && ids < std::pair(nearest.geometry_id, nearest.primitive_id));
        if (!is_nearer)
            return false;
        // A mirroring transform reverses the order of the corners.
        const glm::dvec3 normal = glm::cross(b - a, c - a);
        const double length = glm::length(normal) * (glm::determinant(glm::dmat3(transform)) < 0.0 ? -1.0 : 1.0);
        nearest.position = position;
        nearest.normal = length != 0.0 ? normal / length : glm::dvec3(0.0);
        nearest.distance = distance;
        nearest.primitive_id = face;
        nearest.geometry_id = geometry_id;
        nearest.uv = uv;
        return true;
    }
};

struct MeshQueryOfInstance {
    MeshQuery& query;
    std::uint32_t geometry_id;
};

bool meet_triangle(RTCPointQueryFunctionArguments* arguments)
{
    auto& of_instance = *static_cast<MeshQueryOfInstance*>(arguments->userPtr);
    if (!of_instance.query.meet(arguments->primID, of_instance.geometry_id))
        return false;
    arguments->query->radius = of_instance.query.radius();
    return true;
}

} // namespace

struct SceneClosestPointFinder::Target {
    const Instance* instance;
    Box bounds;                               ///< world space
    std::optional<ClosestPointFinder> finder; ///< of an isosurface

    /// Keeps the nearest point of the target if it is nearer than the nearest point so far.
    void meet(const glm::dvec3& point, SceneClosestPoint& nearest, double limit)
    {
        if (finder) {
            const ClosestPoint found = finder->within(point, std::min(nearest.distance, limit));
            const double error = found.error;
            const bool is_nearer = found.distance < nearest.distance ||
                                   (found.distance == nearest.distance && std::isfinite(found.distance) &&
                                    instance->id < nearest.geometry_id);
            if (is_nearer) {
                const double error_before = nearest.error;
                static_cast<ClosestPoint&>(nearest) = found;
                nearest.geometry_id = instance->id;
                nearest.uv = glm::dvec2(0.0);
                nearest.error = std::max(error, error_before);
            } else {
                nearest.error = std::max(nearest.error, error);
            }
            return;
        }
        const Mesh& mesh = **mesh_of(*instance);
        const glm::dvec3 local = transform_point(instance->placement.world_to_local, point);
        const double reach = glm::length(local) + glm::length(mesh.bounds().size());
        MeshQuery query{mesh,         instance->shown.transform,
                        point,        largest_stretch(glm::dmat3(instance->placement.world_to_local)),
                        1e-6 * reach, nearest};
        const bool had_none = !std::isfinite(nearest.distance);
        if (had_none)
            nearest.distance = limit; // farther points are not kept
        MeshQueryOfInstance of_instance{query, instance->id};
        if (reach < 1e18) {
            RTCPointQuery point_query{};
            point_query.x = static_cast<float>(local.x);
            point_query.y = static_cast<float>(local.y);
            point_query.z = static_cast<float>(local.z);
            point_query.radius = query.radius();
            RTCPointQueryContext context;
            rtcInitPointQueryContext(&context);
            rtcPointQuery(instance->object->scene(), &point_query, &context, meet_triangle, &of_instance);
        } else {
            for (std::size_t face = 0; face < mesh.faces().size(); ++face)
                query.meet(static_cast<std::uint32_t>(face), instance->id);
        }
        if (had_none && nearest.geometry_id == 0xffffffff)
            nearest.distance = std::numeric_limits<double>::infinity();
    }
};

SceneClosestPointFinder::SceneClosestPointFinder(const SceneSnapshot& scene, const ClosestPointOptions& options)
    : options_(options)
{
    for (const auto& instance : scene.impl_->instances) {
        if (!instance->shown.seen_by.camera)
            continue;
        Target target{instance.get(), placed_bounds(*instance->object, instance->shown.transform), std::nullopt};
        if (const auto* surface = std::get_if<std::shared_ptr<const IsosurfaceSnapshot>>(&instance->shown.object))
            target.finder.emplace(**surface, options, instance->shown.transform);
        targets_.push_back(std::move(target));
    }
}

SceneClosestPointFinder::~SceneClosestPointFinder() = default;

SceneClosestPoint SceneClosestPointFinder::operator()(const glm::dvec3& point_world)
{
    order_.clear();
    for (Target& target : targets_)
        order_.emplace_back(distance_from(target.bounds, point_world), &target);
    std::sort(order_.begin(), order_.end());
    SceneClosestPoint nearest;
    for (const auto& [bound, target] : order_) {
        if (!(bound * (1.0 - 1e-12) <= std::min(nearest.distance, options_.max_distance)))
            break;
        target->meet(point_world, nearest, options_.max_distance);
    }
    return nearest;
}

void find_occupancy(const SceneSnapshot& scene, std::span<const glm::dvec3> points_world,
                    std::span<std::uint8_t> occupied)
{
    std::fill(occupied.begin(), occupied.end(), std::uint8_t{0});
    std::vector<Box> meshes;
    for (const std::uint32_t id : scene.ids()) {
        const SnapshotObject& object = scene.object(id);
        if (!object.seen_by.camera)
            continue;
        if (const auto* mesh = std::get_if<std::shared_ptr<const Mesh>>(&object.object)) {
            meshes.push_back(transform_box(object.transform, (*mesh)->bounds()));
            continue;
        }
        const auto& surface = *std::get<std::shared_ptr<const IsosurfaceSnapshot>>(object.object);
        const glm::dmat4 to_object = glm::inverse(object.transform);
        for (std::size_t i = 0; i < points_world.size(); ++i)
            if (occupied[i] == 0 && contains(surface, transform_point(to_object, points_world[i])))
                occupied[i] = 1;
    }

    // Cast rays from the points that may be in a mesh. Any direction will do that is not along an axis.
    std::vector<Ray> rays;
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < points_world.size(); ++i)
        if (occupied[i] == 0 && std::any_of(meshes.begin(), meshes.end(), [&](const Box& box) {
                return distance_from(box, points_world[i]) == 0.0;
            })) {
            Ray ray;
            ray.origin = points_world[i];
            ray.direction = {0.36, 0.48, 0.8};
            rays.push_back(ray);
            rows.push_back(i);
        }
    if (rays.empty())
        return;
    std::vector<Crossing> crossings;
    std::vector<std::uint32_t> counts(rays.size());
    scene.list_intersections(rays, crossings, counts);
    const Crossing* next = crossings.data();
    std::vector<std::pair<std::uint32_t, int>>
        leaving; // for each mesh, the number of exits minus the number of entries
    for (std::size_t i = 0; i < rays.size(); ++i) {
        leaving.clear();
        for (std::uint32_t k = 0; k < counts[i]; ++k, ++next) {
            const std::uint32_t id = next->hit.geometry_id;
            if (!std::holds_alternative<std::shared_ptr<const Mesh>>(scene.object(id).object))
                continue;
            auto found =
                std::find_if(leaving.begin(), leaving.end(), [id](const auto& each) { return each.first == id; });
            if (found == leaving.end())
                found = leaving.insert(leaving.end(), {id, 0});
            found->second += next->entering ? -1 : 1;
        }
        occupied[rows[i]] =
            std::any_of(leaving.begin(), leaving.end(), [](const auto& each) { return each.second % 2 != 0; });
    }
}

} // namespace isospline
