// The cameras. projection.h defines their rays and matrices.
#pragma once

#include "isospline/render/lens_distortion.h"

#include <glm/vec3.hpp>

#include <optional>
#include <variant>

namespace isospline {

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

/// Parallel rays that begin on the plane through the eye and run along target - eye. Pixels are square.
struct OrthographicCamera {
    glm::dvec3 eye{0.0, -1.0, 0.0};
    glm::dvec3 target{0.0};
    glm::dvec3 up{0.0, 0.0, 1.0}; ///< any vector that the image shows pointing upwards
    double height = 1.0;          ///< of the image, world units
};

/// All around the eye, in equirectangular projection: columns are longitudes, from -180 to 180 degrees, and rows are
/// latitudes, from 90 down to -90 degrees. The middle of the image shows the target.
struct PanoramicCamera {
    glm::dvec3 eye{0.0, -1.0, 0.0};
    glm::dvec3 target{0.0};
    glm::dvec3 up{0.0, 0.0, 1.0}; ///< with the viewing direction it spans the meridian in the middle of the image
};

using Camera = std::variant<PerspectiveCamera, ProjectionPlaneCamera, OrthographicCamera, PanoramicCamera>;

} // namespace isospline
