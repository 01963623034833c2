// The cameras. projection.h defines their rays and matrices.
#pragma once

#include "isospline/util/value_class.h"

#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <optional>
#include <tuple>
#include <variant>

namespace isospline {

/// Lens distortion in OpenCV's model: a map of the plane at depth 1. D. C. Brown, "Close-range camera calibration",
/// Photogrammetric Engineering 37(8), 1971; with the rational and the thin prism terms of OpenCV.
struct LensDistortion {
    /// In OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4.
    std::array<double, 12> coefficients{};

    bool operator==(const LensDistortion&) const = default;
    bool is_none() const { return *this == LensDistortion(); }

    /// The distorted position, on the plane at depth 1, of the point (x, y, 1) of camera space, x to the right and y
    /// down; with the derivatives with respect to x and y as columns.
    glm::dvec2 distort(const glm::dvec2& point, glm::dmat2* derivative = nullptr) const;
    /// The point with a distorted position; nothing if there is none on this side of where the image folds.
    std::optional<glm::dvec2> undistort(const glm::dvec2& distorted) const;
    /// Whether all points on the line from the centre to a distorted point can be undistorted, and the last one gives
    /// the point that undistort() finds.
    bool reaches(const glm::dvec2& distorted) const;

private:
    /// By Newton's method from `start`, if it finds a point without a fold on its way.
    std::optional<glm::dvec2> search(const glm::dvec2& distorted, const glm::dvec2& start) const;
    /// Whether the image is folded between the centre and a point.
    bool is_behind_fold(const glm::dvec2& point) const;
    /// By many searches, along the line from the centre.
    std::optional<glm::dvec2> follow(const glm::dvec2& distorted) const;
};

/// The side, or diagonal, of the image along which a field of view is measured.
enum class FieldOfViewAxis { vertical, horizontal, diagonal };

/// An eye that looks at a target: a pinhole, or a thin lens if the aperture is not zero. Pixels are square.
struct PerspectiveCamera {
    glm::dvec3 eye{0.0, -1.0, 0.0};
    glm::dvec3 target{0.0};
    glm::dvec3 up{0.0, 0.0, 1.0}; ///< any vector that the image shows pointing upwards
    double field_of_view = 30.0;  ///< whole angle in degrees, above 0 and below 180
    FieldOfViewAxis field_of_view_axis = FieldOfViewAxis::vertical;
    double aperture_radius = 0.0; ///< of the lens around the eye, world units; 0 is a pinhole
    /// The distance of the plane in focus, along the viewing direction; by default that of the target.
    std::optional<double> focus_distance = std::nullopt;
};

template <>
struct ValueClass<PerspectiveCamera> {
    static constexpr char name[] = "PerspectiveCamera";
    static constexpr std::tuple parameters{Parameter{"eye", &PerspectiveCamera::eye},
                                           Parameter{"target", &PerspectiveCamera::target},
                                           Parameter{"up", &PerspectiveCamera::up},
                                           Parameter{"field_of_view", &PerspectiveCamera::field_of_view},
                                           Parameter{"field_of_view_axis", &PerspectiveCamera::field_of_view_axis},
                                           Parameter{"aperture_radius", &PerspectiveCamera::aperture_radius},
                                           Parameter{"focus_distance", &PerspectiveCamera::focus_distance}};
};

/// The paper's camera (§3): an eye E and a projection plane that the image lies on. The ray of the point P of the
/// plane is E + t (P - E), so that t = 1 on the plane. The plane may be oblique and the pixels not square.
struct ProjectionPlaneCamera {
    glm::dvec3 eye{0.0, -1.0, 0.0};
    glm::dvec3 corner{-0.5, 0.0, 0.5}; ///< top left corner of the image
    glm::dvec3 right{1.0, 0.0, 0.0};   ///< along the top edge, the whole width of the image
    glm::dvec3 down{0.0, 0.0, -1.0};   ///< along the left edge, the whole height of the image
    /// The distortion of the lens: the object that appears at P is on the ray of another point of the plane. It is
    /// defined in OpenCV's camera space: x along `right`, z along the plane's normal away from the eye.
    LensDistortion distortion{};

    static ProjectionPlaneCamera from_center(const glm::dvec3& eye, const glm::dvec3& center, const glm::dvec3& right,
                                             const glm::dvec3& down)
    {
        return {eye, center - 0.5 * (right + down), right, down, {}};
    }
};

template <>
struct ValueClass<ProjectionPlaneCamera> {
    static constexpr char name[] = "ProjectionPlaneCamera";
    static constexpr std::tuple parameters{
        Parameter{"eye", &ProjectionPlaneCamera::eye}, Parameter{"right", &ProjectionPlaneCamera::right},
        Parameter{"down", &ProjectionPlaneCamera::down}, Parameter{"corner", &ProjectionPlaneCamera::corner},
        Parameter{"distortion", &ProjectionPlaneCamera::distortion}};
};

/// Parallel rays that begin on the plane through the eye and run along target - eye. Pixels are square.
struct OrthographicCamera {
    glm::dvec3 eye{0.0, -1.0, 0.0};
    glm::dvec3 target{0.0};
    glm::dvec3 up{0.0, 0.0, 1.0}; ///< any vector that the image shows pointing upwards
    double height = 1.0;          ///< of the image, world units
};

template <>
struct ValueClass<OrthographicCamera> {
    static constexpr char name[] = "OrthographicCamera";
    static constexpr std::tuple parameters{
        Parameter{"eye", &OrthographicCamera::eye}, Parameter{"target", &OrthographicCamera::target},
        Parameter{"up", &OrthographicCamera::up}, Parameter{"height", &OrthographicCamera::height}};
};

/// All around the eye, in equirectangular projection: columns are longitudes, from -180 to 180 degrees, and rows are
/// latitudes, from 90 down to -90 degrees. The middle of the image shows the target.
struct PanoramicCamera {
    glm::dvec3 eye{0.0, -1.0, 0.0};
    glm::dvec3 target{0.0};
    glm::dvec3 up{0.0, 0.0, 1.0}; ///< with the viewing direction it spans the meridian in the middle of the image
};

template <>
struct ValueClass<PanoramicCamera> {
    static constexpr char name[] = "PanoramicCamera";
    static constexpr std::tuple parameters{Parameter{"eye", &PanoramicCamera::eye},
                                           Parameter{"target", &PanoramicCamera::target},
                                           Parameter{"up", &PanoramicCamera::up}};
};

using Camera = std::variant<PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera, PanoramicCamera>;

} // namespace isospline
