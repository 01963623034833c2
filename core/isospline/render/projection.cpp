#include "isospline/render/projection.h"

#include "isospline/util/check.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace isospline {

namespace {

/// Below this sine of an angle, two directions count as parallel.
constexpr double parallel_sine = 1e-9;

bool parallel(const glm::dvec3& a, const glm::dvec3& b)
{
    return !(glm::length(glm::cross(glm::normalize(a), glm::normalize(b))) > parallel_sine);
}

} // namespace

Projection::Projection(const Camera& camera, glm::ivec2 size) : size_(size)
{
    constexpr int largest = 1 << 28; // so that sums of it and the side of a tile stay well within an int
    if (size.x < 1 || size.y < 1 || size.x > largest || size.y > largest)
        throw_invalid("size", "a width and a height of 1 to " + std::to_string(largest),
                      std::to_string(size.x) + " x " + std::to_string(size.y));
    std::visit([this](const auto& given) { set_up(given); }, camera);
}

void Projection::set_up(const PerspectiveCamera& camera)
{
    eye_ = camera.eye;
    look_at(camera.target, camera.up);
    if (!(camera.field_of_view > 0.0 && camera.field_of_view < 180.0))
        throw_invalid("field_of_view", "degrees above 0 and below 180", camera.field_of_view);

    const glm::dvec2 pixels(size_);
    const double extent = camera.field_of_view_axis == FieldOfViewAxis::vertical     ? pixels.y
                          : camera.field_of_view_axis == FieldOfViewAxis::horizontal ? pixels.x
                                                                                     : glm::length(pixels);
    place_image(forward_, 2.0 * std::tan(glm::radians(camera.field_of_view) / 2.0) / extent);

    check_not_negative("aperture_radius", camera.aperture_radius);
    if (camera.focus_distance)
        check_positive("focus_distance", *camera.focus_distance);
    aperture_radius_ = camera.aperture_radius;
    focus_distance_ = camera.focus_distance.value_or(glm::distance(camera.eye, camera.target));
}

void Projection::set_up(const OrthographicCamera& camera)
{
    kind_ = Kind::parallel;
    eye_ = camera.eye;
    look_at(camera.target, camera.up);
    check_positive("height", camera.height);
    place_image(glm::dvec3(0.0), camera.height / size_.y);
}

void Projection::set_up(const PanoramicCamera& camera)
{
    kind_ = Kind::panoramic;
    eye_ = camera.eye;
    look_at(camera.target, camera.up);
}

void Projection::set_up(const ProjectionPlaneCamera& camera)
{
    check_finite("eye", camera.eye);
    check_finite("corner", camera.corner);
    check_direction("right", camera.right);
    check_direction("down", camera.down);
    if (parallel(camera.right, camera.down))
        throw_invalid("down", "an edge that is not parallel to the one to the right", to_text(camera.down));

    eye_ = camera.eye;
    corner_ = camera.corner - camera.eye;
    pixel_right_ = camera.right / static_cast<double>(size_.x);
    pixel_down_ = camera.down / static_cast<double>(size_.y);

    const glm::dvec3 normal = glm::normalize(glm::cross(camera.right, camera.down));
    const double distance = glm::dot(normal, corner_);
    if (!(std::abs(distance) > parallel_sine * glm::length(corner_)))
        throw_invalid("eye", "a point off the projection plane", to_text(camera.eye));
    forward_ = distance > 0.0 ? normal : -normal;
    right_ = glm::normalize(camera.right);
    up_ = glm::normalize(glm::dot(camera.down, right_) * right_ - camera.down);

    distortion_ = camera.distortion;
    has_distortion_ = !distortion_.is_none();
    if (has_distortion_)
        check_distortion();
}

void Projection::check_distortion() const
{
    for (const double coefficient : distortion_.coefficients)
        if (!is_finite(coefficient))
            throw_invalid("distortion", "finite numbers", coefficient);
    // All ways from the middle end on the border.
    constexpr int steps = 64;
    for (int i = 0; i <= steps; ++i)
        for (int side = 0; side < 4; ++side) {
            const double along = static_cast<double>(i) / steps, across = side < 2 ? 0.0 : 1.0;
            const glm::dvec2 raster =
                glm::dvec2(size_) * (side % 2 == 0 ? glm::dvec2(along, across) : glm::dvec2(across, along));
            if (!distortion_.reaches(on_unit_plane(corner_ + raster.x * pixel_right_ + raster.y * pixel_down_)))
                throw_invalid("distortion", "coefficients that do not fold the image of this size",
                              "a fold between its middle and pixel (" + to_text(raster.x) + ", " + to_text(raster.y) +
                                  ")");
        }
}

glm::dvec2 Projection::on_unit_plane(const glm::dvec3& offset) const
{
    return glm::dvec2(glm::dot(offset, right_), -glm::dot(offset, up_)) / glm::dot(offset, forward_);
}

glm::dvec3 Projection::undistorted(const glm::dvec3& offset) const
{
    const glm::dvec2 distorted = on_unit_plane(offset);
    // Beyond the image, where lens filters may ask, there may be no such point.
    const glm::dvec2 point = distortion_.undistort(distorted).value_or(distorted);
    return glm::dot(offset, forward_) * (point.x * right_ - point.y * up_ + forward_);
}

void Projection::look_at(const glm::dvec3& target, const glm::dvec3& up)
{
    check_finite("eye", eye_);
    check_finite("target", target);
    check_direction("up", up);
    if (eye_ == target)
        throw_invalid("target", "a point other than the eye", to_text(target));
    forward_ = glm::normalize(target - eye_);
    if (parallel(forward_, up))
        throw_invalid("up", "a vector that is not parallel to the viewing direction " + to_text(forward_), to_text(up));
    right_ = glm::normalize(glm::cross(forward_, glm::normalize(up)));
    up_ = glm::cross(right_, forward_);
}

void Projection::place_image(const glm::dvec3& center, double pixel_size)
{
    pixel_right_ = pixel_size * right_;
    pixel_down_ = -pixel_size * up_;
    const glm::dvec2 half_size = 0.5 * glm::dvec2(size_);
    corner_ = center - half_size.x * pixel_right_ - half_size.y * pixel_down_;
}

glm::dvec3 Projection::panoramic_direction(glm::dvec2 raster) const
{
    const double longitude = (raster.x / size_.x - 0.5) * glm::two_pi<double>();
    const double latitude = (0.5 - raster.y / size_.y) * glm::pi<double>();
    const glm::dvec3 horizontal = std::sin(longitude) * right_ + std::cos(longitude) * forward_;
    return std::cos(latitude) * horizontal + std::sin(latitude) * up_;
}

double Projection::depth(const glm::dvec3& position) const
{
    if (kind_ == Kind::panoramic)
        return glm::distance(position, eye_);
    return glm::dot(forward_, position - eye_);
}

glm::dvec2 Projection::depth_range(const Box& box) const
{
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0.0;
    for (int corner = 0; corner < 8 && !box.empty(); ++corner) {
        const glm::bvec3 upper(corner & 1, corner & 2, corner & 4);
        const double corner_depth = depth(glm::mix(box.lower, box.upper, upper));
        nearest = std::min(nearest, std::max(corner_depth, 0.0));
        farthest = std::max(farthest, corner_depth);
    }
    if (kind_ == Kind::panoramic) // the nearest point of a box need not be a corner
        nearest = depth(glm::clamp(eye_, box.lower, box.upper));
    return nearest < farthest ? glm::dvec2(nearest, farthest) : glm::dvec2(0.0, 1.0);
}

glm::dmat4 Projection::world_to_camera() const
{
    const glm::dmat3 rotation = glm::transpose(glm::dmat3(right_, up_, forward_));
    glm::dmat4 map(rotation);
    map[3] = glm::dvec4(-(rotation * eye_), 1.0);
    return map;
}

std::optional<glm::dmat4> Projection::world_to_ndc() const
{
    if (kind_ == Kind::panoramic || has_distortion_)
        return std::nullopt;
    // A point is E + a right + b down + c corner in a perspective, which lies at (a/c, b/c) of the image and c times as
    // deep as the plane; with parallel rays it is E + corner + a right + b down + c forward, which lies at (a, b).
    const bool parallel = kind_ == Kind::parallel;
    const double width = size_.x, height = size_.y;
    const glm::dvec3 last = parallel ? forward_ : corner_;
    const glm::dmat3 to_plane = glm::inverse(glm::dmat3(width * pixel_right_, height * pixel_down_, last));
    glm::dmat4 plane(to_plane);
    plane[3] = glm::dvec4(-(to_plane * (parallel ? eye_ + corner_ : eye_)), 1.0);
    if (parallel)
        return plane;
    const glm::dmat4 divide(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, -1, 0); // (a, b, c - 1) over c
    return divide * plane;
}

double Projection::pixel_aspect_ratio() const
{
    if (kind_ == Kind::panoramic)
        return 2.0 * size_.y / size_.x;
    return glm::length(pixel_right_) / glm::length(pixel_down_);
}

} // namespace isospline
