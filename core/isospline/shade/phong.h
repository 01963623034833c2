// Phong's illumination model in the form of the paper's §6.
#pragma once

#include "isospline/shade/color.h"
#include "isospline/shade/light.h"
#include "isospline/shade/surface_point.h"
#include "isospline/util/value_class.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <optional>
#include <tuple>
#include <vector>

namespace isospline {

/// I = ka Ia + sum over k of Ik (kd <N, Lk> + ks <V, Rk>^ns), with Rk = 2 N <N, Lk> - Lk, where each
/// negative product counts as zero.
///
/// Every I has red, green and blue components. The surface's colour multiplies the ambient and the diffuse term, but
/// not the specular one, so highlights have the colour of the light. With white, this is the paper's form.
struct Phong {
    Color color = glm::dvec3(1.0); ///< of the surface
    double ambient = 0.05;         ///< ka
    double diffuse = 0.7;          ///< kd
    double specular = 0.2;         ///< ks
    double specular_exponent = 30; ///< ns
    glm::dvec3 ambient_light{1.0}; ///< Ia
    /// Nothing means camera_lights(); an empty vector means no light except the ambient one.
    std::optional<std::vector<Light>> lights;
    /// Flips normals with <N, V> < 0 to face the viewer, so that the inside of an open surface is lit like its outside.
    bool two_sided = true;
    bool shadows = false;                       ///< whether surfaces between a point and a light hide the light
    int shadow_samples = 1;                     ///< shadow rays per hit to each light with an angle
    double opacity = 1.0;                       ///< of the surface, 0 to 1; below 1, the background shows through
    std::optional<double> silhouette_opacity{}; ///< the opacity at the silhouette, see opacity_at(); nothing: the same
    double silhouette_exponent = 3.0;           ///< the larger, the thinner the silhouette
    CapColor cap_color{};                       ///< of capped cuts
};

template <>
struct ValueClass<Phong> {
    static constexpr char name[] = "Phong";
    static constexpr std::tuple parameters{Parameter{"color", &Phong::color},
                                           Parameter{"ambient", &Phong::ambient},
                                           Parameter{"diffuse", &Phong::diffuse},
                                           Parameter{"specular", &Phong::specular},
                                           Parameter{"specular_exponent", &Phong::specular_exponent},
                                           Parameter{"ambient_light", &Phong::ambient_light},
                                           Parameter{"lights", &Phong::lights},
                                           Parameter{"two_sided", &Phong::two_sided},
                                           Parameter{"shadows", &Phong::shadows},
                                           Parameter{"shadow_samples", &Phong::shadow_samples},
                                           Parameter{"opacity", &Phong::opacity},
                                           Parameter{"silhouette_opacity", &Phong::silhouette_opacity},
                                           Parameter{"silhouette_exponent", &Phong::silhouette_exponent},
                                           Parameter{"cap_color", &Phong::cap_color}};
};

/// Throws std::invalid_argument for numbers that are not finite or negative, a number of shadow rays outside of 1 to
/// 65536, and like validate_opacity().
void validate(const Phong& phong);

/// The linear colour of the surface itself at a point.
glm::dvec3 albedo(const Phong& phong, const SurfacePoint& point);

/// The linear colour of a lit point. Without lights there is only ambient light: the renderer sets camera_lights().
glm::dvec3 shade(const Phong& phong, const SurfacePoint& point);

/// The number of shadow rays from a point to a light: several to a disc.
int shadow_ray_count(const Phong& phong, const Light& light);

/// Whether a light may add to the colour of a point: if not, it need not be seen. The vectors are those of
/// SurfacePoint.
bool receives(const Phong& phong, const Light& light, const glm::dvec3& position, const glm::dvec3& normal,
              const glm::dvec3& to_viewer);

/// The part of a light that a white surface reflects at a point, if nothing is between them.
double reflected(const Phong& phong, const Light& light, const glm::dvec3& position, const glm::dvec3& normal,
                 const glm::dvec3& to_viewer);

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
    alignas(64) double surface_color[3][capacity] = {}; ///< like albedo()
};

/// Linear colours of such points, in red, green and blue.
struct PhongColors {
    alignas(64) double part[3][PhongPoints::capacity];
};

/// The colours of the points, as by shade() for each.
void shade(const Phong& phong, const PhongPoints& points, PhongColors& colors);

} // namespace isospline
