// The results of rays.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>

namespace isospline {

/// The ids in a miss.
inline constexpr std::uint32_t invalid_id = 0xffffffffu; ///< of a geometry
inline constexpr std::uint64_t invalid_primitive_id = 0xffffffffffffffffu;

/// The first crossing of a ray with a scene, in world space; t is infinite on a miss.
struct Hit {
    double t = std::numeric_limits<double>::infinity(); ///< in units of the ray direction's length
    glm::dvec3 position{0.0};
    glm::dvec3 normal{0.0}; ///< unit, outward: +-gradient of an isosurface, by its Inside; face normal of a mesh
    double gradient_magnitude = 0.0; ///< |gradient of f| in world units; 0 for a mesh
    glm::vec2 uv{0.0f};              ///< weights of a triangle's second and third corner; 0 for an isosurface
    std::uint32_t geometry_id = invalid_id;
    /// For an isosurface, Volume::primitive_id() of the cell, or the id of a cap, IsosurfaceSnapshot::is_cap(); for a
    /// mesh, the triangle.
    std::uint64_t primitive_id = invalid_primitive_id;

    /// Makes this a miss.
    void clear()
    {
        t = std::numeric_limits<double>::infinity();
        position = normal = glm::dvec3(0.0);
        gradient_magnitude = 0.0;
        uv = glm::vec2(0.0f);
        geometry_id = invalid_id;
        primitive_id = invalid_primitive_id;
    }

    explicit operator bool() const { return geometry_id != invalid_id; }
};

/// One crossing in a list of all crossings of a ray with a scene.
struct Crossing {
    Hit hit;
    bool entering; ///< the ray goes to the inner side: <normal, direction> < 0
};

} // namespace isospline
