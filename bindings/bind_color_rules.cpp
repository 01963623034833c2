// Rules for colours as values of Python.
#include "arrays.h"
#include "bind.h"
#include "colors.h"
#include "handed.h"
#include "long_call.h"
#include "thickness_words.h"
#include "values.h"

#include "isospline/render/distance_field.h"
#include "isospline/render/thickness_field.h"
#include "isospline/scene/scene.h"
#include "isospline/util/check.h"

#include <glm/gtc/matrix_inverse.hpp>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace py = pybind11;
using namespace py::literals;

namespace isospline {

namespace {

using Limits = std::optional<std::pair<double, double>>;

const EnumWords<CurvatureKind> kind_words{{"mean", CurvatureKind::mean},
                                          {"gaussian", CurvatureKind::gaussian},
                                          {"maximum", CurvatureKind::maximum},
                                          {"minimum", CurvatureKind::minimum}};

/// The distance from a scene, which Python gets back.
class SceneDistance : public DistanceField {
public:
    SceneDistance(std::shared_ptr<Scene> scene, std::shared_ptr<const SceneSnapshot> snapshot, bool is_signed,
                  double largest)
        : DistanceField(std::move(snapshot), is_signed, largest), scene_(std::move(scene)), is_signed_(is_signed)
    {
    }

    const std::shared_ptr<Scene>& scene() const { return scene_; }
    bool is_signed() const { return is_signed_; }

private:
    std::shared_ptr<Scene> scene_;
    bool is_signed_;
};

/// The thickness of a surface, with all that Python gets back; NaN if the surface is not known.
class SurfaceThickness : public PointValue {
public:
    ThicknessMethod method = ThicknessMethod::ray;
    std::optional<double> ripple;
    std::shared_ptr<Isosurface> surface; ///< as it was
    glm::dmat4 transform{1.0};           ///< from the surface's world space to the scene's

    /// A copy, which others may change.
    std::shared_ptr<Isosurface> copied_surface() const
    {
        return surface ? std::make_shared<Isosurface>(*surface) : nullptr;
    }

    void index(double scale, const Progress& progress)
    {
        Scene scene;
        scene.add(surface);
        field_.emplace(scene.snapshot(progress), method, ripple.value_or(default_ripple(*surface)),
                       glm::inverse(transform), scale);
    }

    double at(const glm::dvec3& position_world) const override
    {
        return field_ ? field_->at(position_world) : std::nan("");
    }

private:
    std::optional<ThicknessField> field_;
};

/// The factor of lengths of a similarity.
double scale_of(const glm::dmat4& transform)
{
    const glm::dmat3 linear(transform);
    const glm::dmat3 squares = glm::transpose(linear) * linear;
    const double square = (squares[0][0] + squares[1][1] + squares[2][2]) / 3.0;
    bool is_similar = square > 0.0 && is_finite(square) && transform[3][3] == 1.0;
    for (int i = 0; i < 3; ++i) {
        is_similar = is_similar && transform[i][3] == 0.0 && is_finite(transform[3][i]);
        for (int j = 0; j < 3; ++j)
            is_similar = is_similar && std::abs(squares[i][j] - (i == j ? square : 0.0)) <= 1e-9 * square;
    }
    if (!is_similar)
        throw_invalid("transform", "a rotation, a translation and a uniform scale, for the thickness",
                      "another matrix");
    return std::sqrt(square);
}

/// The colour map of a rule. Without limits it has those from 0 to 1, which a picture replaces.
ColorMap map_of(const py::handle& rule)
{
    const RowArray rows(value_part(rule, "cmap"), "cmap", 3);
    const auto limits = rule.attr("limits").cast<Limits>().value_or(std::pair{0.0, 1.0});
    ColorMap map{{}, {limits.first, limits.second}};
    for (std::size_t i = 0; i < rows.count(); ++i)
        map.colors.push_back(rows.vector(i));
    return map;
}

bool fits_limits(const py::handle& rule)
{
    return rule.attr("limits").is_none();
}

std::string label_of(const py::handle& rule)
{
    return rule.attr("label").cast<std::string>();
}

/// The index of a rule, which its constructor has made.
template <typename Index>
std::shared_ptr<Index> index_of(const py::handle& rule)
{
    return rule.attr("_index").cast<std::shared_ptr<Index>>();
}

ColorByVolume by_volume(const py::handle& rule)
{
    ColorByVolume color;
    color.volume = rule.attr("volume").cast<std::shared_ptr<Volume>>();
    color.map = map_of(rule);
    color.label = label_of(rule);
    color.volume_to_scene = as_matrix4(rule.attr("transform"), "transform");
    color.scene_to_volume = glm::affineInverse(color.volume_to_scene); // its last row is not rounded
    for (int column = 0; column < 4; ++column)
        if (!is_finite(glm::dvec3(color.scene_to_volume[column])) || color.volume_to_scene[column][3] != (column == 3))
            throw_invalid("transform", "an invertible affine map", "another matrix");
    return color;
}

ColorByCurvature by_curvature(const py::handle& rule)
{
    return {as_enum(kind_words, rule.attr("kind").cast<std::string>(), "kind"), map_of(rule)};
}

/// Linear colours of a map, marked as such.
py::object colors_of(const ColorMap& map)
{
    auto array = new_array<double>({static_cast<py::ssize_t>(map.colors.size())}, {3});
    for (std::size_t i = 0; i < map.colors.size(); ++i)
        for (int channel = 0; channel < 3; ++channel)
            array.mutable_at(static_cast<py::ssize_t>(i), channel) = map.colors[i][channel];
    return handed("linear")(array);
}

template <typename Rule>
py::object limits_of(const Rule& rule)
{
    if constexpr (requires { rule.fit_limits; })
        if (rule.fit_limits)
            return py::none();
    return py::make_tuple(rule.map.limits.x, rule.map.limits.y);
}

/// The rule in Python with the parameters that all rules with a map have, and its own.
template <typename Rule, typename... Arguments>
py::object made(const py::object& make, const Rule& rule, const Arguments&... arguments)
{
    return make(arguments..., "cmap"_a = colors_of(rule.map), "limits"_a = limits_of(rule));
}

py::object rule_in_python(const glm::dvec3&)
{
    return py::none();
}

py::object rule_in_python(const ColorByVolume& rule)
{
    return made(handed("ColorByVolume"), rule, "volume"_a = std::const_pointer_cast<Volume>(rule.volume),
                "transform"_a = rule.volume_to_scene, "label"_a = rule.label);
}

py::object rule_in_python(const ColorByCurvature& rule)
{
    return made(handed("ColorByCurvature"), rule, "kind"_a = to_word(kind_words, rule.kind));
}

py::object rule_in_python(const ColorByNormal&)
{
    return handed("ColorByNormal")();
}

py::object rule_in_python(const ColorByDepth& rule)
{
    return made(handed("ColorByDepth"), rule);
}

py::object rule_in_python(const ColorByDistance& rule)
{
    const auto index =
        std::const_pointer_cast<SceneDistance>(std::dynamic_pointer_cast<const SceneDistance>(rule.distance));
    return made(handed("ColorByDistance").attr("_with"), rule, index, "signed"_a = index->is_signed(),
                "label"_a = rule.label);
}

py::object rule_in_python(const ColorByValue& rule)
{
    return made(handed("ColorByValue"), rule, "label"_a = rule.label);
}

py::object rule_in_python(const ColorByThickness& rule)
{
    const auto index =
        std::const_pointer_cast<SurfaceThickness>(std::dynamic_pointer_cast<const SurfaceThickness>(rule.thickness));
    return made(handed("ColorByThickness").attr("_with"), rule, index,
                "method"_a = to_word(thickness_words, index->method), "ripple"_a = index->ripple,
                "transform"_a = index->transform, "label"_a = rule.label);
}

/// Checks a rule but for its index.
void check_color_rule(const py::object& rule)
{
    if (py::hasattr(rule, "cmap"))
        validate(map_of(rule));
    if (is_value(rule, "ColorByVolume"))
        by_volume(rule);
    if (is_value(rule, "ColorByCurvature"))
        by_curvature(rule);
}

std::shared_ptr<SceneDistance> index_distances(const std::shared_ptr<Scene>& other, bool is_signed, double largest)
{
    std::shared_ptr<SceneDistance> index;
    long_call("to index the other objects", py::none(), [&](const Progress& progress) {
        index = std::make_shared<SceneDistance>(other, other->snapshot(progress), is_signed, largest);
    });
    return index;
}

std::shared_ptr<SurfaceThickness> index_thickness(const std::string& method, std::optional<double> ripple,
                                                  const std::shared_ptr<Isosurface>& surface,
                                                  const py::object& transform)
{
    auto index = std::make_shared<SurfaceThickness>();
    index->method = as_enum(thickness_words, method, "method");
    if (ripple)
        check_not_negative("ripple", *ripple);
    index->ripple = ripple;
    index->transform = as_matrix4(transform, "transform");
    const double scale = scale_of(index->transform);
    if (surface) {
        index->surface = std::make_shared<Isosurface>(*surface);
        long_call("to index the surface", py::none(), [&](const Progress& progress) { index->index(scale, progress); });
    }
    return index;
}

} // namespace

std::optional<Color> color_rule(const py::handle& value)
{
    if (is_value(value, "ColorByVolume"))
        return by_volume(value);
    if (is_value(value, "ColorByCurvature"))
        return by_curvature(value);
    if (is_value(value, "ColorByNormal"))
        return ColorByNormal{};
    if (is_value(value, "ColorByDepth"))
        return ColorByDepth{map_of(value), fits_limits(value)};
    if (is_value(value, "ColorByDistance"))
        return ColorByDistance{index_of<SceneDistance>(value), map_of(value), fits_limits(value), label_of(value)};
    if (is_value(value, "ColorByValue"))
        return ColorByValue{map_of(value), fits_limits(value), label_of(value)};
    if (is_value(value, "ColorByThickness"))
        return ColorByThickness{index_of<SurfaceThickness>(value), map_of(value), fits_limits(value), label_of(value)};
    return std::nullopt;
}

py::object to_python(const Color& color)
{
    if (const auto* const linear = std::get_if<glm::dvec3>(&color))
        return handed("linear")(*linear);
    return std::visit([](const auto& rule) { return rule_in_python(rule); }, color);
}

void bind_color_rules(py::module_& module)
{
    py::class_<SceneDistance, std::shared_ptr<SceneDistance>>(module, "_DistanceIndex")
        .def(py::init(&index_distances), py::arg("other"), py::arg("signed"), py::arg("largest"))
        .def_property_readonly("scene", &SceneDistance::scene);
    py::class_<SurfaceThickness, std::shared_ptr<SurfaceThickness>>(module, "_ThicknessIndex")
        .def(py::init(&index_thickness), py::arg("method"), py::arg("ripple"), py::arg("surface"), py::arg("transform"))
        .def_property_readonly("surface", &SurfaceThickness::copied_surface);
    module.def("_check_color_rule", &check_color_rule, py::arg("rule"));
}

} // namespace isospline
