// A camera in front of an image of a given size: the rays of its pixels, and its matrices.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/ray.h"
#include "isospline/render/camera.h"

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <optional>

namespace isospline {

/// The common form of all cameras: an image plane with an eye or a common direction, or a sphere around the eye.
///
/// *Raster* coordinates are in pixels: (0, 0) is the top left corner of the image, and the centre of pixel (i, j) is
/// (i + 1/2, j + 1/2). *Camera space* is OpenEXR's and RenderMan's: x to the right, y up and z forward, away from the
/// viewer, in world units. *NDC* is theirs too: (0, 0) is the top left corner of the image and (1, 1) the bottom right.
class Projection {
public:
    /// Throws std::invalid_argument for a size that is not positive or above 2^28, a number that is not finite, an eye
    /// on its target, an up vector along the viewing direction, a field of view outside of (0, 180), a height that is
    /// not positive, a negative aperture, a focus distance that is not positive, edges that span no plane or a plane
    /// through the eye, and a distortion that folds the image.
    Projection(const Camera& camera, glm::ivec2 size);

    /// The ray through a raster position. In a perspective its direction is P - E, with the plane at the distance 1
    /// for a PerspectiveCamera; parallel rays and those of a panorama have unit directions.
    ///
    /// `lens` is the starting position on the lens, a point of the unit disc: rays through one raster position meet in
    /// the plane in focus. Without a lens it has no effect.
    Ray ray(glm::dvec2 raster, glm::dvec2 lens = glm::dvec2(0.0)) const
    {
        if (kind_ == Kind::panoramic)
            return {eye_, panoramic_direction(raster)};
        const glm::dvec3 offset = corner_ + raster.x * pixel_right_ + raster.y * pixel_down_;
        if (kind_ == Kind::parallel)
            return {eye_ + offset, forward_};
        if (has_distortion_)
            return {eye_, undistorted(offset)};
        if (!has_lens())
            return {eye_, offset};
        const glm::dvec3 shift = aperture_radius_ * (lens.x * right_ + lens.y * up_);
        return {eye_ + shift, offset - shift / focus_distance_};
    }

    glm::ivec2 size() const { return size_; }
    /// Whether rays start at different points of a lens.
    bool has_lens() const { return aperture_radius_ > 0.0; }
    const glm::dvec3& eye() const { return eye_; }
    /// Camera-space z of a point: its distance from the eye along the viewing direction; in a panorama, its distance.
    double depth(const glm::dvec3& position) const;
    /// The range of depths of a box, from its nearest point in front of the camera to the farthest.
    glm::dvec2 depth_range(const Box& box) const;

    /// Unit axes of camera space, in world space. They are orthogonal even if the edges of the image are not;
    /// `right` is then kept.
    const glm::dvec3& right() const { return right_; }
    const glm::dvec3& up() const { return up_; }
    const glm::dvec3& forward() const { return forward_; }

    /// Maps column vectors. Rigid, and a reflection unless the image is mirrored: camera space is left-handed.
    glm::dmat4 world_to_camera() const;
    /// Maps column vectors; divide by w. z is 0 on the image plane and grows with depth, to 1 at infinity if there is
    /// an eye. Nothing for a panorama and for a lens with distortion, which are not projective.
    std::optional<glm::dmat4> world_to_ndc() const;
    /// Width of a pixel over its height; on the horizon of a panorama.
    double pixel_aspect_ratio() const;

private:
    enum class Kind { perspective, parallel, panoramic };

    glm::dvec3 panoramic_direction(glm::dvec2 raster) const;
    /// The undistorted point of the image plane that appears at a given one; both are relative to the eye.
    glm::dvec3 undistorted(const glm::dvec3& offset) const;
    /// The point where the ray of a point of the image plane, relative to the eye, meets the plane at depth 1: x to the
    /// right and y down.
    glm::dvec2 on_unit_plane(const glm::dvec3& offset) const;
    void check_distortion() const;
    void look_at(const glm::dvec3& target, const glm::dvec3& up);
    void place_image(const glm::dvec3& center, double pixel_size);
    void set_up(const PerspectiveCamera& camera);
    void set_up(const ProjectionPlaneCamera& camera);
    void set_up(const OrthographicCamera& camera);
    void set_up(const PanoramicCamera& camera);

    glm::ivec2 size_{0};
    Kind kind_ = Kind::perspective;
    glm::dvec3 eye_{0.0};
    glm::dvec3 corner_{0.0}; ///< from the eye to the top left corner of the image
    glm::dvec3 pixel_right_{0.0}, pixel_down_{0.0};
    glm::dvec3 right_{0.0}, up_{0.0}, forward_{0.0};
    double aperture_radius_ = 0.0, focus_distance_ = 1.0;
    LensDistortion distortion_;
    bool has_distortion_ = false;
};

} // namespace isospline
