// The planes that bound a solid besides its isosurface: those of the clip and, if it is closed, of the volume's border.
#pragma once

#include "isospline/math/half_space.h"
#include "isospline/spline/volume.h"

#include <cstddef>
#include <vector>

namespace isospline {

/// Half-spaces in lattice space, whose normals have length one.
///
/// The clip is given in world space, where the border of the domain and the faces of cells are rounded. Whether a plane
/// is one of them is decided here, once: a plane that is within plane_margin, or within its rounding error if that is
/// larger, of a face of cells or of an earlier plane everywhere in the domain becomes exactly that plane. All queries
/// use these numbers.
class SolidPlanes {
public:
    /// None.
    SolidPlanes() = default;
    /// `clip` is in the volume's world space. `capped` closes the solid where the clip cuts it, `closed` at the border
    /// of the domain.
    SolidPlanes(const Volume& volume, const std::vector<HalfSpace>& clip, bool capped, bool closed);

    /// The clip.
    const std::vector<HalfSpace>& clip() const { return clip_; }
    /// The clip, then, if the solid is closed, the border of the domain: lower and upper x, y, z.
    const std::vector<HalfSpace>& all() const { return all_; }
    /// Whether the parts of a plane of `all()` in the solid are caps. Of equal planes, only the first has caps.
    bool has_caps(std::size_t plane) const { return has_caps_[plane]; }
    /// The same, and the solid does not end there on the other side, too: then it is flat, and empty.
    bool caps_have_area(std::size_t plane) const { return caps_have_area_[plane]; }
    /// Whether any plane has caps.
    bool have_caps() const;

private:
    std::vector<HalfSpace> clip_, all_;
    std::vector<bool> has_caps_, caps_have_area_;
};

} // namespace isospline
