// What is cut away from an isosurface: whole cells by a mask, straight parts by half-spaces.
#pragma once

#include "isospline/brick/brick.h"
#include "isospline/math/box.h"
#include "isospline/math/ray.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace isospline {

class Volume;

/// The side of a plane that is kept: the points x with <normal, x> >= offset.
struct HalfSpace {
    glm::dvec3 normal{0.0, 0.0, 1.0};
    double offset = 0.0;
};

/// The same half-space in another space, given the affine map from that other space to the half-space's own. Its normal
/// gets length one, so that <normal, x> - offset is a distance there.
HalfSpace pull_back(const HalfSpace& half_space, const glm::dmat4& map);

/// The half-spaces whose intersection is a box: one for each side that is not at infinity. Throws
/// std::invalid_argument for an empty box.
std::vector<HalfSpace> half_spaces(const Box& box);

/// The part of a ray inside several half-spaces, and the half-spaces through whose planes it enters and leaves; -1 if
/// the ray itself begins or ends there.
struct Chord : Interval {
    int entry = -1, exit = -1;
};

/// The part of a ray inside all of the half-spaces, or nothing. The ray is in the half-spaces' space.
std::optional<Chord> clip(const Ray& ray, const std::vector<HalfSpace>& half_spaces);

/// One byte a sample, x fastest; 0 if the sample is cut away. For even degrees, a cell is cut away if the sample at its
/// centre is. For odd degrees, it is cut away if a sample at any of its corners is, as with blanking in VTK.
using Mask = std::vector<std::uint8_t>;

/// Whether a mask cuts a cell away.
bool is_cut_by_mask(const glm::ivec3& cell, const Mask& mask, const Volume& volume);

/// Removes the cells that a mask cuts away from a set.
void cut_by_mask(BrickCells& cells, const Brick& brick, const Mask& mask, const Volume& volume);

/// Whether a brick is wholly outside of a half-space. The half-space is in lattice space; its normal has length one.
bool is_outside(const Brick& brick, const HalfSpace& half_space_lattice);

/// Removes the cells that are wholly outside of a half-space from a set. The half-space is in lattice space; its normal
/// has length one.
void cut_by_half_space(BrickCells& cells, const Brick& brick, const HalfSpace& half_space_lattice);

} // namespace isospline
