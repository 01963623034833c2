// The point of an isosurface that is nearest to a given one, with a bound on how much nearer another could be.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <memory>

namespace isospline {

struct ClosestPointOptions {
    double max_distance = std::numeric_limits<double>::infinity(); ///< world units; farther points are not looked for
    double tolerance = 0.0;  ///< world units; 0 stands for a millionth of the shortest edge of a cell
    int max_boxes = 1 << 14; ///< parts of cells that are looked at, at most, for one point
};

/// The distance is infinite, and the position not a number, where no point was found within max_distance.
struct ClosestPoint {
    glm::dvec3 position{std::numeric_limits<double>::quiet_NaN()}; ///< world space, on the surface
    glm::dvec3 normal{0.0};                                        ///< unit, outward; zero where the gradient is
    double distance = std::numeric_limits<double>::infinity();
    /// No point of the surface is nearer than min(distance, max_distance) - error, up to rounding. At most the
    /// tolerance, but where max_boxes did not suffice.
    double error = 0.0;
    std::uint64_t primitive_id = invalid_primitive_id; ///< of the cell, Volume::primitive_id()
};

/// Finds the nearest points of a surface, which must outlive it and keep its level.
///
/// Newton's method on Lagrange's conditions leads from the point to a foot of a perpendicular, and a bound on second
/// derivatives mostly proves at once that no part of the surface is nearer. Where it does not: branch and bound,
/// nearest first: the tree of the shell's cells, which is built when it is first needed, then cells, then halves of
/// cells. A part is left only where its coefficients have one sign, where that bound clears it, or where all of the
/// surface in it is proven to be farther than a point that is known, less the tolerance.
class ClosestPointFinder {
public:
    /// Throws std::invalid_argument where an option is negative or not a number. `transform`, which is affine, takes
    /// the surface's world space to the space that points, distances and normals are in.
    explicit ClosestPointFinder(const IsosurfaceSnapshot& surface, const ClosestPointOptions& options = {},
                                const glm::dmat4& transform = glm::dmat4(1.0));
    ~ClosestPointFinder();
    ClosestPointFinder(ClosestPointFinder&&) noexcept;

    /// The same, with another largest distance.
    ClosestPoint within(const glm::dvec3& point_world, double max_distance);
    /// Of a finite point in world space. One thread at a time: it re-uses its memory from one point to the next.
    ClosestPoint operator()(const glm::dvec3& point_world);

private:
    struct Search;
    template <int Degree>
    struct SearchOfDegree;

    double max_distance_;
    std::unique_ptr<Search> search_;
};

} // namespace isospline
