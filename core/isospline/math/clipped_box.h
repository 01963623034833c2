// The part of a box in half-spaces.
#pragma once

#include "isospline/math/box.h"
#include "isospline/math/convex_polygon.h"
#include "isospline/math/frame.h"
#include "isospline/math/half_space.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <array>
#include <span>
#include <utility>
#include <vector>

namespace isospline {

/// The part of a plane in a box that is not flat; empty if they do not meet. The normal has length one. The plane may
/// be a side of the box.
inline ConvexPolygon section_of(const Box& box, const HalfSpace& plane)
{
    const glm::dvec3 middle = box.center() + (plane.offset - glm::dot(plane.normal, box.center())) * plane.normal;
    const Frame frame(plane.normal);
    const double reach = glm::length(box.size());
    ConvexPolygon polygon;
    for (const auto& [x, y] : {std::pair(-1.0, -1.0), {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
        polygon.push_back(middle + reach * (x * frame.x + y * frame.y));
    for (const HalfSpace& side : half_spaces(box))
        if (side != plane)
            polygon = cut(polygon, side.normal, side.offset);
    return polygon;
}

/// The lower or the upper side of a box across an axis.
inline ConvexPolygon side_of_box(const Box& box, int axis, bool upper)
{
    const int first = (axis + 1) % 3, second = (axis + 2) % 3;
    ConvexPolygon side(4, upper ? box.upper : box.lower);
    for (std::size_t i = 0; i < 4; ++i) {
        side[i][first] = i == 1 || i == 2 ? box.upper[first] : box.lower[first];
        side[i][second] = i >= 2 ? box.upper[second] : box.lower[second];
    }
    return side;
}

/// The corners of the part of a box in all half-spaces, some of them several times; none if nothing is left. The box
/// may be flat.
inline std::vector<glm::dvec3> corners_within(const Box& box, std::span<const HalfSpace> half_spaces)
{
    std::vector<glm::dvec3> corners;
    const auto add_facet = [&](ConvexPolygon facet, const HalfSpace* own) {
        for (const HalfSpace& half_space : half_spaces)
            if (&half_space != own && !facet.empty())
                facet = cut(facet, half_space.normal, half_space.offset);
        corners.insert(corners.end(), facet.begin(), facet.end());
    };
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true})
            add_facet(side_of_box(box, axis, upper), nullptr);
    // A corner on fewer than three of the planes is on a side of the box, and so are all corners of a flat box.
    if (half_spaces.size() > 2 && glm::all(glm::lessThan(box.lower, box.upper)))
        for (const HalfSpace& half_space : half_spaces)
            add_facet(section_of(box, half_space), &half_space);
    return corners;
}

} // namespace isospline
