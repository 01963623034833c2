// The colour of a surface: constant, or a function of the point, by a colour map for instance.
#pragma once

#include "isospline/shade/surface_point.h"
#include "isospline/spline/volume.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace isospline {

/// A colour map: linear colours at equal steps over a range of values, with linear interpolation.
struct ColorMap {
    std::vector<glm::dvec3> colors{glm::dvec3(0.0), glm::dvec3(1.0)}; ///< two or more
    glm::dvec2 limits{0.0, 1.0}; ///< the values of the first and the last colour; values beyond are clamped
};

/// Throws std::invalid_argument for fewer than two colours, a colour that is negative or not finite, and limits that
/// are equal or not finite. The second limit may be the smaller one.
void validate(const ColorMap& map);

/// The colour of a value; NaN gets the first one.
glm::dvec3 color_of(const ColorMap& map, double value);

/// By the value of a volume's model at the point, which need not be the volume that the surface is of.
struct ColorByVolume {
    std::shared_ptr<const Volume> volume;
    ColorMap map;
    glm::dmat4 scene_to_volume{1.0}; ///< from the scene's world space to the volume's
    glm::dmat4 volume_to_scene{1.0}; ///< its inverse, the original argument
    std::string label = {};          ///< what the values are, for colour bars
};

enum class CurvatureKind { mean, gaussian, maximum, minimum };

/// By a curvature of the surface; zero for a mesh.
struct ColorByCurvature {
    CurvatureKind kind = CurvatureKind::mean;
    ColorMap map;
};

/// (N + 1) / 2 of the unit outward normal N, whose x, y and z become red, green and blue.
struct ColorByNormal {};

/// By the depth of the point, as in images.
struct ColorByDepth {
    ColorMap map;
    /// Whether map.limits are the depths of the scene's box; render() of a scene then sets them.
    bool fit_limits = false;
};

/// A number at each point, which any thread may ask for.
class PointValue {
public:
    virtual ~PointValue() = default;
    virtual double at(const glm::dvec3& position_world) const = 0;
};

/// By the distance of the point from other objects.
struct ColorByDistance {
    std::shared_ptr<const PointValue> distance;
    ColorMap map;
    bool fit_limits = false; ///< whether map.limits are still to be set, to the distances of the objects
    std::string label = {};  ///< what the distance is, for colour bars
};

/// By the value of a mesh at the point, between those of its vertices. Points without one are grey.
struct ColorByValue {
    ColorMap map;
    bool fit_limits = false; ///< as of ColorByDistance
    std::string label = {};  ///< what the values are, for colour bars
};

/// By the thickness of a solid at the point. Points where it is NaN are grey.
struct ColorByThickness {
    std::shared_ptr<const PointValue> thickness;
    ColorMap map;
    bool fit_limits = false; ///< as of ColorByDistance
    std::string label = {};  ///< what the thickness is, for colour bars
};

/// Linear red, green and blue, or a rule for them.
using Color = std::variant<glm::dvec3, ColorByVolume, ColorByCurvature, ColorByNormal, ColorByDepth, ColorByDistance,
                           ColorByValue, ColorByThickness>;

/// The colour of caps; nothing means the surface's own. A rule is not lit: its colours are read off a colour bar.
using CapColor = std::optional<Color>;

/// Throws std::invalid_argument, about `parameter`, for numbers that are not finite or negative, and like the
/// validation of the colour map.
void validate(const char* parameter, const Color& color);

/// Whether the colour of a point depends on its curvature.
bool needs_curvature(const Color& color);

/// The nearest and the farthest depth of a scene; only called if a colour has to fit them.
using DepthRange = std::function<glm::dvec2()>;

/// Sets the limits of a colour by depth that fits the scene.
void fit_depth_limits(Color& color, const DepthRange& depths);

/// The colour by a rule other than a constant.
glm::dvec3 color_by_rule(const Color& color, const SurfacePoint& point);

/// The linear colour at a point.
inline glm::dvec3 color_at(const Color& color, const SurfacePoint& point)
{
    const auto* const constant = std::get_if<glm::dvec3>(&color);
    return constant ? *constant : color_by_rule(color, point);
}

/// The same for a point that may be on a cap.
inline glm::dvec3 color_at(const Color& color, const CapColor& cap_color, const SurfacePoint& point)
{
    return color_at(point.on_cap && cap_color ? *cap_color : color, point);
}

/// Whether a point shows its colour without light: on a cap that is coloured by a rule.
inline bool is_unlit(const CapColor& cap_color, const SurfacePoint& point)
{
    return point.on_cap && cap_color && !std::holds_alternative<glm::dvec3>(*cap_color);
}

} // namespace isospline
