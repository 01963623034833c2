#include "catch.h"

#include "isospline/shade/shading.h"

#include <limits>
#include <memory>

using namespace isospline;

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();

Shading phong_of(const Color& color)
{
    Phong phong;
    phong.color = color;
    return phong;
}

} // namespace

TEST_CASE("a colour map has straight lines between its colours", "[shade]")
{
    const ColorMap map{{glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0), glm::dvec3(1, 1, 0)}, {10.0, 14.0}};
    validate(map);
    REQUIRE(color_of(map, 10.0) == glm::dvec3(0, 0, 1));
    REQUIRE(color_of(map, 11.0) == glm::dvec3(0.5, 0, 0.5));
    REQUIRE(color_of(map, 12.0) == glm::dvec3(1, 0, 0));
    REQUIRE(color_of(map, 13.5) == glm::dvec3(1, 0.75, 0));
    REQUIRE(color_of(map, 14.0) == glm::dvec3(1, 1, 0));
    REQUIRE(color_of(map, -1e300) == glm::dvec3(0, 0, 1));
    REQUIRE(color_of(map, std::numeric_limits<double>::infinity()) == glm::dvec3(1, 1, 0));
    REQUIRE(color_of(map, not_a_number) == glm::dvec3(0, 0, 1));
    const ColorMap reversed{map.colors, {14.0, 10.0}};
    REQUIRE(color_of(reversed, 10.5) == color_of(map, 13.5));
}

TEST_CASE("colours follow from normal, depth, value and curvature, and vertices multiply them", "[shade]")
{
    SurfacePoint point;
    point.normal = {0.0, 0.6, -0.8};
    point.depth = 2.5;
    point.curvature = {0.5, 0.09}; // 0.9 and 0.1
    const ColorMap map{{glm::dvec3(0.0), glm::dvec3(1.0)}, {0.0, 10.0}};
    REQUIRE(color_at(ColorByNormal{}, point) == glm::dvec3(0.5, 0.8, 0.5 * (1.0 - 0.8)));
    REQUIRE(color_at(ColorByDepth{map}, point).g == Approx(0.25));
    REQUIRE(color_at(ColorByValue{map}, point) == glm::dvec3(0.397)); // no value
    point.value = 4.0;
    REQUIRE(color_at(ColorByValue{map}, point).g == Approx(0.4));
    struct Height : PointValue {
        double at(const glm::dvec3& position) const override { return position.z; }
    };
    const ColorByThickness by_height{std::make_shared<Height>(), map};
    point.position.z = 7.0;
    REQUIRE(color_at(by_height, point).g == Approx(0.7));
    point.position.z = not_a_number;
    REQUIRE(color_at(by_height, point) == glm::dvec3(0.397));
    const auto curvature = [&](CurvatureKind kind) { return color_at(ColorByCurvature{kind, map}, point).g; };
    REQUIRE(curvature(CurvatureKind::mean) == Approx(0.05));
    REQUIRE(curvature(CurvatureKind::gaussian) == Approx(0.009));
    REQUIRE(curvature(CurvatureKind::maximum) == Approx(0.09));
    REQUIRE(curvature(CurvatureKind::minimum) == Approx(0.01));

    point.vertex_color = {1.0, 0.5, 0.0};
    REQUIRE(albedo(phong_of(glm::dvec3(0.8)), point) == glm::dvec3(0.8, 0.4, 0.0));
    REQUIRE(albedo(Shading(Outline{1.0, glm::dvec3(1.0), glm::dvec3(0.2)}), point) == glm::dvec3(0.2, 0.1, 0.0));
}

TEST_CASE("shadings know what their colours need", "[shade]")
{
    Outline outline;
    REQUIRE_FALSE(needs_curvature(outline));
    outline.surface_color = ColorByCurvature{};
    REQUIRE(needs_curvature(outline));
    REQUIRE(needs_curvature(phong_of(ColorByCurvature{})));

    Shading fitted = phong_of(ColorByDepth{{}, true}), fixed = phong_of(ColorByDepth{{}, false});
    fit_depth_limits(fitted, [] { return glm::dvec2(3.0, 4.0); });
    fit_depth_limits(fixed, [] { return glm::dvec2(3.0, 4.0); });
    REQUIRE(std::get<ColorByDepth>(std::get<Phong>(fitted).color).map.limits == glm::dvec2(3.0, 4.0));
    REQUIRE(std::get<ColorByDepth>(std::get<Phong>(fixed).color).map.limits == glm::dvec2(0.0, 1.0));
}

TEST_CASE("bad colours are refused", "[shade]")
{
    const auto refused = [](const Color& color, const char* parameter) {
        REQUIRE_THROWS_WITH(validate(phong_of(color)), ContainsSubstring(parameter));
    };
    refused(glm::dvec3(0.0, -1.0, 0.0), "color");
    refused(ColorByDepth{{{glm::dvec3(1.0)}, {0.0, 1.0}}}, "cmap");
    refused(ColorByDepth{{{glm::dvec3(1.0), glm::dvec3(not_a_number)}, {0.0, 1.0}}}, "cmap");
    refused(ColorByCurvature{CurvatureKind::mean, {{glm::dvec3(0.0), glm::dvec3(1.0)}, {2.0, 2.0}}}, "limits");
    refused(ColorByVolume{nullptr, {{glm::dvec3(0.0), glm::dvec3(1.0)}, {0.0, not_a_number}}}, "limits");
    refused(ColorByThickness{nullptr, {{glm::dvec3(0.0), glm::dvec3(1.0)}, {3.0, 3.0}}}, "limits");
    refused(ColorByValue{{{glm::dvec3(0.0), glm::dvec3(1.0)}, {3.0, 3.0}}}, "limits");
    refused(ColorByDistance{nullptr, {{glm::dvec3(0.0), glm::dvec3(1.0)}, {3.0, 3.0}}}, "limits");
}
