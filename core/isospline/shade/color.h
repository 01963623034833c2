// The colour of a surface: one for all of it, or one that follows from the point.
#pragma once

#include "isospline/shade/color_map.h"
#include "isospline/shade/surface_point.h"
#include "isospline/spline/volume.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <variant>

namespace isospline {

/// By the value of a volume's model at the point, which need not be the volume that the surface is of.
struct ColorByVolume {
    std::shared_ptr<const Volume> volume;
    ColorMap map;
    glm::dmat4 scene_to_volume{1.0}; ///< from the scene's world space to the volume's
    glm::dmat4 volume_to_scene{1.0}; ///< its inverse, as given
};

enum class CurvatureKind { mean, gaussian, maximum, minimum };

/// By a curvature of the surface; that of a mesh is zero.
struct ColorByCurvature {
    CurvatureKind kind = CurvatureKind::mean;
    ColorMap map;
};

/// (N + 1) / 2 of the unit outward normal N, whose x, y and z become red, green and blue.
struct ColorByNormal {};

/// By the depth of the point, as images hold it.
struct ColorByDepth {
    ColorMap map;
    /// Whether map.limits are to be those of the scene's box as the camera sees it; render() of a scene puts them in.
    bool fit_limits = false;
};

/// Linear red, green and blue, or a rule that gives them.
using Color = std::variant<glm::dvec3, ColorByVolume, ColorByCurvature, ColorByNormal, ColorByDepth>;

/// The colour of what is on caps; nothing stands for the surface's own.
using CapColor = std::optional<Color>;

/// Throws std::invalid_argument, about `parameter`, for numbers that are not finite or negative, and as the colour map
/// does.
void validate(const char* parameter, const Color& color);

/// Whether the colour of a point follows from its curvature.
bool needs_curvature(const Color& color);

/// The nearest and the farthest depth of a scene, which is called for where a colour is to fit to them alone.
using DepthRange = std::function<glm::dvec2()>;

/// Puts limits into a colour by depth that is to fit to the scene.
void fit_depth_limits(Color& color, const DepthRange& depths);

/// The colour that a rule other than a constant gives.
glm::dvec3 color_by_rule(const Color& color, const SurfacePoint& point);

/// The linear colour at a point.
inline glm::dvec3 color_at(const Color& color, const SurfacePoint& point)
{
    const auto* const constant = std::get_if<glm::dvec3>(&color);
    return constant ? *constant : color_by_rule(color, point);
}

/// The same where it may be on a cap.
inline glm::dvec3 color_at(const Color& color, const CapColor& cap_color, const SurfacePoint& point)
{
    return color_at(point.on_cap && cap_color ? *cap_color : color, point);
}

} // namespace isospline
