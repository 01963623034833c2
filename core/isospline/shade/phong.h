// Phong's illumination model in the form of the paper's §6.
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/light.h"
#include "isospline/shade/surface_point.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <optional>
#include <vector>

namespace isospline {

/// I = ka Ia + sum over k of Ik (kd <N, Lk> + ks <V, Rk>^ns), with Rk = 2 N <N, Lk> - Lk, and with negative products
/// taken as zero, each by itself.
///
/// Every I has a red, a green and a blue part; the surface's colour multiplies the ambient and the diffuse term, and
/// not the specular one, so that highlights have the colour of the light. With the colour white it is the paper's form.
struct Phong {
    Color color = glm::dvec3(1.0); ///< of the surface
    double ambient = 0.05;         ///< ka
    double diffuse = 0.7;          ///< kd
    double specular = 0.2;         ///< ks
    double specular_exponent = 30; ///< ns
    glm::dvec3 ambient_light{1.0}; ///< Ia
    /// Nothing stands for camera_lights(), an empty vector for no light but the ambient one.
    std::optional<std::vector<Light>> lights;
    /// Turns normals to the viewer where <N, V> < 0, so that the inside of an open surface is lit as its outside is.
    bool two_sided = true;
    bool shadows = false; ///< whether what lies between a point and a light hides it
    double opacity = 1.0; ///< of the surface, 0 to 1; below 1 what is behind it shows through
    CapColor cap_color{}; ///< of capped cuts
};

/// Throws std::invalid_argument for numbers that are not finite or negative, and for an opacity above 1.
void validate(const Phong& phong);

/// The linear colour of the surface itself at a point.
glm::dvec3 albedo(const Phong& phong, const SurfacePoint& point);

/// The linear colour of a point in the light. Lights that are left open give none: the renderer fills them in.
glm::dvec3 shade(const Phong& phong, const SurfacePoint& point);

/// Points that are shaded together, coordinate by coordinate; no light is hidden from them.
struct PhongPoints {
    static constexpr std::size_t capacity = 16;

    void set(std::size_t point, const glm::dvec3& its_position, const glm::dvec3& its_normal,
             const glm::dvec3& its_direction, const glm::dvec3& its_color)
    {
        for (int i = 0; i < 3; ++i) {
            position[i][point] = its_position[i];
            normal[i][point] = its_normal[i];
            direction[i][point] = its_direction[i];
            surface_color[i][point] = its_color[i];
        }
    }

    std::size_t count = 0;
    alignas(64) double position[3][capacity] = {};      ///< world space
    alignas(64) double normal[3][capacity] = {};        ///< unit, outward
    alignas(64) double direction[3][capacity] = {};     ///< of the rays that hit, of any length
    alignas(64) double surface_color[3][capacity] = {}; ///< as albedo()
};

/// Linear colours of such points, in red, green and blue.
struct PhongColors {
    alignas(64) double part[3][PhongPoints::capacity];
};

/// The colours of the points, as shade() of each.
void shade(const Phong& phong, const PhongPoints& points, PhongColors& colors);

} // namespace isospline
