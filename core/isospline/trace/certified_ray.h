// First crossings of rays with isosurfaces, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/ray.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/certified_line.h"
#include "isospline/trace/certified_placement.h"
#include "isospline/trace/ray_packet.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

namespace isospline {

namespace certified {
class Search;
} // namespace certified

enum class RayStatus : std::uint8_t { miss, hit, undecided };

/// What is proven of a ray: f is not the level before t_lower, within the ray's limits. If it hits, f changes sides
/// between t_lower and t_upper. If it misses, both are infinite; if it is undecided, t_upper is.
struct RayCertificate {
    RayStatus status = RayStatus::miss;
    double t_lower = std::numeric_limits<double>::infinity();
    double t_upper = std::numeric_limits<double>::infinity();
    double level_bound = 0.0; ///< of a ray that is undecided: |f - level| is at most this at t_lower
    /// Of a hit: the outward normal everywhere between the bounds, in the space of the rays, is within this angle, in
    /// radians, of this unit vector. The angle is pi, and the vector zero, if nothing is known.
    glm::dvec3 normal{0.0};
    double normal_angle = std::numeric_limits<double>::quiet_NaN();
    /// Of a hit: the surface of the unrounded coefficients comes this near to the points between the bounds; infinite
    /// if that is not proven within the width of a cell.
    double model_distance = std::numeric_limits<double>::quiet_NaN();
};

/// Proves where rays first cross an isosurface. The surface is that of the stored coefficients, offset, level and
/// matrices as real numbers; the ray is the line through the numbers given. Any number of threads may use it.
class RayCertifier {
public:
    /// `transform` maps the surface's world space to that of the rays. Throws std::invalid_argument for a surface with
    /// a clip, a mask or largest=, and for a closed one; `parameter` names what asked for proofs.
    RayCertifier(std::shared_ptr<const IsosurfaceSnapshot> surface, const glm::dmat4& transform,
                 const char* parameter = "certify");

    /// The ray's numbers are finite, except for its limits. If the first crossing is near `t_hint`, which may be any
    /// number, it is found faster.
    RayCertificate certify(const Ray& ray, double t_hint = std::numeric_limits<double>::infinity()) const;
    /// The same for the rays of these lanes, each with a hint. Rays with a hit need the right hint to be fast. The
    /// bounds of hits may differ from those of certify() of one ray, by rounding.
    void certify(const RayPacket& rays, LaneMask lanes, std::span<const double, packet_capacity> t_hints,
                 std::span<RayCertificate, packet_capacity> certificates) const;
    /// Whether the ray crosses the surface anywhere; nothing if that is not proven.
    std::optional<bool> is_crossed(Ray ray) const;
    /// Whether the ray crosses the surface an odd number of times; nothing if that is not proven.
    std::optional<bool> crosses_oddly(const Ray& ray) const;
    /// Whether a point is in the solid that the surface bounds; nothing if that is not proven.
    std::optional<bool> contains(const glm::dvec3& point) const;

private:
    /// The line of a ray in lattice space.
    certified::Line line_of(const glm::dvec3& origin, const glm::dvec3& direction) const;
    certified::Range range_of(const certified::Line& line, const Ray& ray) const;
    certified::Search search(const Ray& ray) const;
    certified::Search search(const certified::Line& line, const certified::Range& range, double t_hint) const;
    template <int Degree>
    void describe_hit(const certified::Line& line, RayCertificate& hit) const;

    std::shared_ptr<const IsosurfaceSnapshot> surface_;
    certified::Placement placement_;
};

} // namespace isospline
