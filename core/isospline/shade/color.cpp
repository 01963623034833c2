#include "isospline/shade/color.h"

#include "isospline/math/affine.h"
#include "isospline/util/check.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace isospline {

namespace {

double curvature_of(CurvatureKind kind, const Curvature& curvature)
{
    switch (kind) {
    case CurvatureKind::mean:
        return curvature.mean;
    case CurvatureKind::gaussian:
        return curvature.gaussian;
    case CurvatureKind::maximum:
        return curvature.maximum();
    case CurvatureKind::minimum:
        return curvature.minimum();
    }
    return 0.0;
}

/// The colour of a value that may be unknown.
glm::dvec3 known_color_of(const ColorMap& map, double value)
{
    constexpr double grey = 0.397; // as "darkgray", PyVista's colour of NaN
    return std::isnan(value) ? glm::dvec3(grey) : color_of(map, value);
}

glm::dvec3 by_rule(const glm::dvec3& color, const SurfacePoint&)
{
    return color;
}

glm::dvec3 by_rule(const ColorByVolume& color, const SurfacePoint& point)
{
    const glm::dvec3 position_world = transform_point(color.scene_to_volume, point.position);
    return color_of(color.map, color.volume->value(transform_point(color.volume->world_to_index(), position_world)));
}

glm::dvec3 by_rule(const ColorByCurvature& color, const SurfacePoint& point)
{
    return color_of(color.map, curvature_of(color.kind, point.curvature));
}

glm::dvec3 by_rule(const ColorByNormal&, const SurfacePoint& point)
{
    return 0.5 * (point.normal + 1.0);
}

glm::dvec3 by_rule(const ColorByDepth& color, const SurfacePoint& point)
{
    return color_of(color.map, point.depth);
}

glm::dvec3 by_rule(const ColorByDistance& color, const SurfacePoint& point)
{
    return color_of(color.map, color.distance->at(point.position));
}

glm::dvec3 by_rule(const ColorByValue& color, const SurfacePoint& point)
{
    return known_color_of(color.map, point.value);
}

glm::dvec3 by_rule(const ColorByThickness& color, const SurfacePoint& point)
{
    return known_color_of(color.map, color.thickness->at(point.position));
}

} // namespace

void validate(const ColorMap& map)
{
    if (map.colors.size() < 2)
        throw_invalid("cmap", "two or more colours", map.colors.size());
    for (const glm::dvec3& color : map.colors)
        check_not_negative("cmap", color);
    if (!is_finite(map.limits.x) || !is_finite(map.limits.y) || map.limits.x == map.limits.y)
        throw_invalid("limits", "two finite numbers that differ",
                      to_text(map.limits.x) + " and " + to_text(map.limits.y));
}

glm::dvec3 color_of(const ColorMap& map, double value)
{
    const double last = static_cast<double>(map.colors.size() - 1);
    const double place = (value - map.limits.x) / (map.limits.y - map.limits.x) * last;
    const double inside = place > 0.0 ? std::min(place, last) : 0.0; // also for NaN
    const std::size_t below = std::min(static_cast<std::size_t>(inside), map.colors.size() - 2);
    return glm::mix(map.colors[below], map.colors[below + 1], inside - static_cast<double>(below));
}

void validate(const char* parameter, const Color& color)
{
    if (const auto* constant = std::get_if<glm::dvec3>(&color))
        check_not_negative(parameter, *constant);
    else if (const auto* by_volume = std::get_if<ColorByVolume>(&color))
        validate(by_volume->map);
    else if (const auto* by_curvature = std::get_if<ColorByCurvature>(&color))
        validate(by_curvature->map);
    else if (const auto* by_depth = std::get_if<ColorByDepth>(&color))
        validate(by_depth->map);
    else if (const auto* by_distance = std::get_if<ColorByDistance>(&color))
        validate(by_distance->map);
    else if (const auto* by_value = std::get_if<ColorByValue>(&color))
        validate(by_value->map);
    else if (const auto* by_thickness = std::get_if<ColorByThickness>(&color))
        validate(by_thickness->map);
}

bool needs_curvature(const Color& color)
{
    return std::holds_alternative<ColorByCurvature>(color);
}

void fit_depth_limits(Color& color, const DepthRange& depths)
{
    if (auto* by_depth = std::get_if<ColorByDepth>(&color); by_depth && by_depth->fit_limits)
        by_depth->map.limits = depths();
}

glm::dvec3 color_by_rule(const Color& color, const SurfacePoint& point)
{
    return std::visit([&](const auto& rule) { return by_rule(rule, point); }, color);
}

} // namespace isospline
