// The caps of a surface as parts of convex polygons: nearest points on them, and points to sample.
#pragma once

#include "isospline/math/convex_polygon.h"
#include "isospline/shell/isosurface.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

/// A convex part of a plane with caps, within the clip and the domain. Caps are the parts of it in the solid.
struct CapPolygon {
    ConvexPolygon corners;          ///< world space
    glm::dvec3 normal{0.0};         ///< unit, outward
    std::size_t plane;              ///< of SolidPlanes::all()
    double coordinate_error;        ///< of its points, lattice space
    std::optional<glm::ivec3> cell; ///< its cell, if the polygon is only the part in it
};

class CapPolygons {
public:
    struct Point {
        glm::dvec3 position, normal;
        double distance;
        std::uint64_t primitive_id;
    };

    /// The polygons of a surface, which must outlive them; none if it has no caps. `transform` maps the surface's
    /// world space to the space of the polygons.
    explicit CapPolygons(const IsosurfaceSnapshot& surface, const glm::dmat4& transform = glm::dmat4(1.0));

    /// One polygon per plane; of several equal planes, only the first has one.
    const std::vector<CapPolygon>& polygons() const { return polygons_; }
    /// Whether a point of a polygon is on a cap.
    bool is_on_cap(const CapPolygon& polygon, const glm::dvec3& point) const;

    /// The nearest point of caps that is not on the surface as well, or nothing if there is none within `limit`. One
    /// thread at a time.
    ///
    /// The distance from a point is a convex function on a convex polygon. A minimum on a cap that is not on the cap's
    /// border at the surface is therefore the minimum on the polygon. So only the nearest point of each polygon is a
    /// candidate.
    std::optional<Point> closest(const glm::dvec3& point, double limit);

private:
    void find_masked_parts();
    bool is_away_from_mask(const CapPolygon& polygon, const glm::dvec3& point) const;

    const IsosurfaceSnapshot& surface_;
    glm::dmat4 to_world_, to_lattice_; ///< from the lattice to the space of the polygons, and back
    std::vector<CapPolygon> polygons_;
    bool has_masked_parts_ = false;
    std::vector<CapPolygon> masked_parts_; ///< of polygons, in cells next to cells that the mask cuts away
};

} // namespace isospline
