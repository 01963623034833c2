// First crossings of rays with isosurfaces, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/enclosure.h"
#include "isospline/math/ray.h"
#include "isospline/shell/isosurface.h"

#include <glm/mat4x4.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

namespace isospline {

namespace certified {
struct Line;
struct Range;
class Search;
} // namespace certified

enum class RayStatus : std::uint8_t { miss, hit, undecided };

/// What is proven of a ray: f is not the level before t_lower, within the ray's limits. If it hits, f changes sides
/// between t_lower and t_upper. If it misses, both are infinite; if it is undecided, t_upper is.
struct RayCertificate {
    RayStatus status = RayStatus::miss;
    double t_lower = std::numeric_limits<double>::infinity();
    double t_upper = std::numeric_limits<double>::infinity();
};

/// Proves where rays first cross an isosurface. The surface is that of the stored coefficients, offset, level and
/// matrices as real numbers; the ray is the line through the numbers given. Any number of threads may use it.
class RayCertifier {
public:
    /// `transform` maps the surface's world space to that of the rays. Throws std::invalid_argument for a surface with
    /// a clip, a mask or largest=, and for a closed one; `parameter` names what asked for proofs.
    RayCertifier(std::shared_ptr<const IsosurfaceSnapshot> surface, const glm::dmat4& transform,
                 const char* parameter = "certify");

    /// The ray's numbers are finite, except for its limits.
    RayCertificate certify(const Ray& ray) const;
    /// Whether the ray crosses the surface anywhere; nothing if that is not proven.
    std::optional<bool> is_crossed(Ray ray) const;
    /// Whether the ray crosses the surface an odd number of times; nothing if that is not proven.
    std::optional<bool> crosses_oddly(const Ray& ray) const;
    /// Whether a point is in the solid that the surface bounds; nothing if that is not proven.
    std::optional<bool> contains(const glm::dvec3& point) const;

private:
    /// The line of a ray in lattice space.
    certified::Line line_of(const glm::dvec3& origin, const glm::dvec3& direction) const;
    certified::Search search(const Ray& ray) const;
    certified::Search search(const certified::Line& line, const certified::Range& range) const;

    std::shared_ptr<const IsosurfaceSnapshot> surface_;
    std::array<std::array<Enclosure, 3>, 3> to_lattice_; ///< rows of the linear part of the map to lattice space
    std::array<Enclosure, 3> origin_;                    ///< of index space, in the space of the rays
    double slope_;                                       ///< no partial derivative of f in lattice space is larger
    double threshold_error_;
};

} // namespace isospline
