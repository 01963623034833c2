#include "isospline/query/reach.h"

#include "isospline/brick/brick.h"
#include "isospline/cell/coefficients.h"
#include "isospline/math/box.h"
#include "isospline/query/surface_box.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/cap.h"
#include "isospline/trace/point_side.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace isospline {

namespace {

/// Room for rounding where planes meet, in cells.
constexpr double corner_margin = 1e-6;
/// With more planes than this, computing corners is more work than the boxes of caps.
constexpr std::size_t most_planes = 32;

/// Calls `visit` for the corners of the clipped domain that are in the solid and on a plane with caps.
template <typename Visit>
void for_each_corner(const IsosurfaceSnapshot& surface, Visit visit)
{
    std::vector<HalfSpace> planes = surface.planes().all();
    const auto has_caps = [&](std::size_t plane) {
        return plane < surface.planes().all().size() && surface.planes().has_caps(plane);
    };
    const std::vector<HalfSpace> domain = half_spaces(domain_lattice(surface.volume()));
    planes.insert(planes.end(), domain.begin(), domain.end());
    for (std::size_t i = 0; i < planes.size(); ++i)
        for (std::size_t j = i + 1; j < planes.size(); ++j)
            for (std::size_t k = j + 1; k < planes.size(); ++k) {
                if (!has_caps(i) && !has_caps(j) && !has_caps(k))
                    continue;
                const HalfSpace &a = planes[i], &b = planes[j], &c = planes[k];
                const glm::dvec3 bc = glm::cross(b.normal, c.normal);
                const double determinant = glm::dot(a.normal, bc);
                if (std::abs(determinant) < 1e-9)
                    continue;
                const glm::dvec3 corner = (a.offset * bc + b.offset * glm::cross(c.normal, a.normal) +
                                           c.offset * glm::cross(a.normal, b.normal)) /
                                          determinant;
                const bool is_corner = std::all_of(planes.begin(), planes.end(), [&](const HalfSpace& plane) {
                    return glm::dot(plane.normal, corner) >= plane.offset - corner_margin;
                });
                if (is_corner && side_of(surface, corner, corner_margin) != Side::outside)
                    visit(corner);
            }
}

/// Whether a box may contain points of the solid: false only if it has none, true if it has one at a corner of a part
/// of it. Parts of an eighth of a cell count without further division.
template <int Degree>
bool may_be_inside(const SurfaceBox<Degree>& box, bool is_above)
{
    const auto [least, most] = std::minmax_element(box.b.begin(), box.b.end());
    const double rounding = 0x1p-46 * std::max(-*least, *most);
    if ((is_above ? *most : -*least) < -rounding)
        return false;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 at = Degree * child_position(corner);
        const double value = box.b[bernstein_item<Degree>(at.x, at.y, at.z)];
        if ((is_above ? value : -value) >= 0.0)
            return true;
    }
    if (box.depth == 9)
        return true;
    const int axis = box.depth % 3;
    return may_be_inside<Degree>(half_of<Degree>(box, axis, false), is_above) ||
           may_be_inside<Degree>(half_of<Degree>(box, axis, true), is_above);
}

/// Calls `visit` for the corners of all cells that may contain a part of a cap.
template <typename Visit>
void for_each_cap_cell(const IsosurfaceSnapshot& surface, Visit visit)
{
    const Volume& volume = surface.volume();
    const bool is_above = surface.options().inside == Inside::above;
    const SolidPlanes& planes = surface.planes();
    const auto has_cap = [&](const Brick& cell) {
        bool is_cut = false;
        for (std::size_t i = 0; i < planes.all().size(); ++i) {
            if (is_outside(box_of(cell), planes.all()[i]))
                return false;
            is_cut |= planes.has_caps(i) && !is_inside(box_of(cell), planes.all()[i]);
        }
        if (!is_cut)
            return false;
        const VolumeCell coefficients(volume, surface.threshold(), cell.first);
        return dispatch_degree(volume.degree(), [&](auto degree) {
            return may_be_inside<degree>(surface_box<degree>(coefficients, 0), is_above);
        });
    };
    // Several planes may cut a brick: its boxes are next to each other.
    glm::ivec3 last(-1);
    const CapBoxes caps = cap_boxes(surface);
    for (const Box& box : caps.boxes) {
        const glm::ivec3 position = glm::min(glm::ivec3(box.center()), volume.cell_shape() - 1) / brick_size;
        if (position == last)
            continue;
        last = position;
        const Brick brick = brick_at(volume.cell_shape(), position);
        for_each_cell(surface.kept_cells().cells(brick), [&](int x, int y, int z) {
            const Brick cell{brick.first + glm::ivec3(x, y, z), glm::ivec3(1)};
            if (has_cap(cell))
                for (int corner = 0; corner < 8; ++corner)
                    visit(glm::dvec3(cell.first + child_position(corner)));
        });
    }
}

/// Calls `visit` for points whose convex hull contains all caps, to about the size of a cell, together with the cells
/// of the surface.
template <typename Visit>
void for_each_cap_point(const IsosurfaceSnapshot& surface, Visit visit)
{
    if (!surface.planes().have_caps())
        return;
    if (surface.options().shell.mask.empty() && surface.planes().all().size() <= most_planes)
        for_each_corner(surface, visit);
    else // A mask can cut caps off anywhere.
        for_each_cap_cell(surface, visit);
}

} // namespace

std::vector<double> reach_lattice(const IsosurfaceSnapshot& surface, std::span<const glm::dvec3> directions,
                                  const Progress& progress)
{
    std::vector<double> reach = surface.reach_lattice(directions, progress);
    for_each_cap_point(surface, [&](const glm::dvec3& point) {
        for (std::size_t i = 0; i < directions.size(); ++i)
            reach[i] = std::max(reach[i], glm::dot(directions[i], point));
    });
    return reach;
}

Box bounds_lattice(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    Box bounds = surface.bounds_lattice(progress);
    for_each_cap_point(surface, [&](const glm::dvec3& point) { bounds.extend(point); });
    return bounds;
}

} // namespace isospline
