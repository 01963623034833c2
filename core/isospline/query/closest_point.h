// The point of an isosurface that is nearest to a given one, with a bound on how much nearer another point could be.
#pragma once

#include "isospline/query/cap_polygons.h"
#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"
#include "isospline/util/progress.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <memory>

namespace isospline {

struct ClosestPointOptions {
    double max_distance = std::numeric_limits<double>::infinity(); ///< world units; farther points are ignored
    double tolerance = 0.0;  ///< world units; 0 stands for a millionth of the shortest edge of a cell
    int max_boxes = 1 << 14; ///< the largest number of parts of cells to examine for one point
    /// Called, by any thread that searches, while the shell and its tree are built or waited for. The search throws
    /// Cancelled if it returns false.
    Progress progress = {};
};

/// The distance is infinite, and the position is NaN, if no point was found within max_distance.
struct ClosestPoint {
    glm::dvec3 position{std::numeric_limits<double>::quiet_NaN()}; ///< world space, on the surface or a cap
    glm::dvec3 normal{0.0};                                        ///< unit, outward; zero where the gradient is
    double distance = std::numeric_limits<double>::infinity();
    /// No point of the surface is nearer than min(distance, max_distance) - error, up to rounding. It is at most the
    /// tolerance, unless max_boxes was too small.
    double error = 0.0;
    std::uint64_t primitive_id = invalid_primitive_id; ///< of the cell, Volume::primitive_id(), or the cap
};

/// Finds the nearest points of a surface and, where it is capped, of its caps. The surface must outlive it and keep its
/// level.
///
/// Newton's method on Lagrange's conditions leads from the point to the foot of a perpendicular. In most cases, a bound
/// on second derivatives then proves that no part of the surface is nearer. Otherwise branch and bound follows, nearest
/// part first: over the tree of the shell's cells, which is built when it is first needed, then cells, then halves of
/// cells. A part is discarded if its coefficients have one sign, if the bound on second derivatives excludes it, or if
/// the surface in it is proven not to be nearer than the nearest known point by more than the tolerance.
class ClosestPointFinder {
public:
    /// Throws std::invalid_argument if an option is negative or NaN. `transform` is affine and maps the surface's world
    /// space to the space of points, distances and normals.
    explicit ClosestPointFinder(const IsosurfaceSnapshot& surface, const ClosestPointOptions& options = {},
                                const glm::dmat4& transform = glm::dmat4(1.0));
    ~ClosestPointFinder();
    ClosestPointFinder(ClosestPointFinder&&) noexcept;

    /// The same search with a different max_distance.
    ClosestPoint within(const glm::dvec3& point_world, double max_distance);
    /// The nearest point for a finite point in world space. One thread at a time: memory is reused for the next point.
    ClosestPoint operator()(const glm::dvec3& point_world);

private:
    struct Search;
    template <int Degree>
    struct SearchOfDegree;

    double max_distance_;
    CapPolygons caps_;
    std::unique_ptr<Search> search_;
};

} // namespace isospline
