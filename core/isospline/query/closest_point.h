// The point of an isosurface that is nearest to a given one, with a bound on how much nearer another could be.
#pragma once

#include "isospline/shell/isosurface.h"
#include "isospline/trace/hit.h"

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
/// Branch and bound, nearest first: the tree of the shell's cells, then cells, then halves of cells. A part is left
/// only where its coefficients have one sign or where all of the surface in it is proven to be farther than a point
/// that is known, less the tolerance. Points become known by Newton's method on Lagrange's conditions.
class ClosestPointFinder {
public:
    /// Throws std::invalid_argument where an option is negative or not a number. Builds the tree of the shell, if it is
    /// the first.
    explicit ClosestPointFinder(const IsosurfaceSnapshot& surface, const ClosestPointOptions& options = {});
    ~ClosestPointFinder();

    /// Of a finite point in world space. One thread at a time: it re-uses its memory from one point to the next.
    ClosestPoint operator()(const glm::dvec3& point_world);

private:
    struct Search;
    template <int Degree>
    struct SearchOfDegree;

    std::unique_ptr<Search> search_;
};

} // namespace isospline
