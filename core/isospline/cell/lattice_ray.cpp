#include "isospline/cell/lattice_ray.h"

#include "isospline/cell/lattice_line-inl.h"

namespace isospline {

LatticeRay::LatticeRay(const Ray& ray, const glm::ivec3& shape)
    : origin(ray.origin), direction(ray.direction), t_near(ray.t_near),
      t_far(ray.t_far), limits{0.0, 1.0, t_near, t_far}
{
    for (int axis = 0; axis < 3; ++axis) {
        const auto line = scalar::lattice_line(origin[axis], direction[axis], shape[axis]);
        plane_origin[axis] = line.plane_origin;
        inverse_direction[axis] = line.inverse_direction;
        direction_single[axis] = static_cast<float>(direction[axis]);
        inverse_direction_single[axis] =
            static_cast<float>(std::clamp(line.inverse_direction, -huge_inverse_single, huge_inverse_single));
    }
}

} // namespace isospline
