#include "isospline/query/sample_surface.h"

#include "isospline/cell/value-inl.h"
#include "isospline/math/affine.h"
#include "isospline/math/random.h"
#include "isospline/measure/polynomial.h"
#include "isospline/query/cap_polygons.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace isospline {

namespace {

/// f - level in a cell along an axis, over a point of the face perpendicular to it.
template <int Degree>
LinePolynomial line_of_cell(const CellCoefficients& cell, int axis, const glm::dvec3& point)
{
    const auto x = scalar::cell_weights<Degree>(point[axis == 0 ? 1 : 0]);
    const auto y = scalar::cell_weights<Degree>(point[axis == 2 ? 1 : 2]);
    std::array<double, Degree + 1> c{};
    for (int k = 0; k <= Degree; ++k)
        for (int j = 0; j <= Degree; ++j)
            for (int i = 0; i <= Degree; ++i)
                c[k] += x[i] * y[j] * (axis == 0 ? cell(k, i, j) : axis == 1 ? cell(i, k, j) : cell(i, j, k));
    const auto b = scalar::bernstein_of_bspline<Degree>(c);
    LinePolynomial line{Degree, {}};
    std::copy(b.begin(), b.end(), line.b.begin());
    return line;
}

/// Polygons of caps, as triangles.
class CapTriangles {
public:
    explicit CapTriangles(const std::vector<CapPolygon>& polygons)
    {
        for (const CapPolygon& polygon : polygons)
            for (std::size_t i = 2; i < polygon.corners.size(); ++i) {
                const glm::dvec3 &a = polygon.corners[0], &b = polygon.corners[i - 1], &c = polygon.corners[i];
                triangles_.push_back({&polygon, a, b, c});
                areas_until_.push_back(area() + 0.5 * glm::length(glm::cross(b - a, c - a)));
            }
    }

    double area() const { return areas_until_.empty() ? 0.0 : areas_until_.back(); }

    /// A point that is uniform by area if the three numbers are uniform in [0, 1).
    std::pair<const CapPolygon*, glm::dvec3> at(double which, glm::dvec2 uv) const
    {
        const auto found = std::upper_bound(areas_until_.begin(), areas_until_.end() - 1, which * area());
        const Triangle& triangle = triangles_[static_cast<std::size_t>(found - areas_until_.begin())];
        if (uv.x + uv.y > 1.0)
            uv = 1.0 - uv;
        return {triangle.polygon, triangle.a + uv.x * (triangle.b - triangle.a) + uv.y * (triangle.c - triangle.a)};
    }

private:
    struct Triangle {
        const CapPolygon* polygon;
        glm::dvec3 a, b, c;
    };

    std::vector<Triangle> triangles_;
    std::vector<double> areas_until_; ///< of each triangle and all before it
};

template <int Degree>
void sample(const IsosurfaceSnapshot& surface, std::uint32_t seed, std::size_t first, std::span<SurfaceSample> samples)
{
    constexpr int most_lines = 1 << 20;
    const Volume& volume = surface.volume();
    const std::vector<Cell>& cells = surface.shell().cells();
    const glm::dmat3 to_lattice(volume.world_to_lattice());
    // The ratio of an area of the surface in the world to that in the lattice is |n L^-1| / |n| times a constant, where
    // n is the gradient. Lines along the three axes meet the surface with a density of (|n_x| + |n_y| + |n_z|) / |n|.
    double largest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 normal(0.0);
        normal[axis] = 1.0;
        largest = std::max(largest, glm::length(normal * to_lattice));
    }
    const auto count = static_cast<double>(cells.size());

    // The probability that a line gives a point in a unit of world area. Polygons of caps are tried so often that a
    // unit of their area has the same probability.
    const double density_of_lines =
        1.0 / (3.0 * count * Degree * largest * std::abs(glm::determinant(glm::dmat3(volume.lattice_to_world()))));
    const CapPolygons caps(surface);
    const CapTriangles triangles(caps.polygons());
    const double area_of_caps = triangles.area();
    const double part_of_caps = cells.empty() ? 1.0 : 1.0 - 1.0 / (1.0 + area_of_caps * density_of_lines);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const std::uint64_t number = first + i;
        RandomSequence random({static_cast<int>(static_cast<std::uint32_t>(number)),
                               static_cast<int>(static_cast<std::uint32_t>(number >> 32))},
                              0, seed);
        const auto fine = [&] { return random.next() + 0x1p-32 * random.next(); };
        bool is_found = false;
        for (int line_count = 0; !is_found; ++line_count) {
            if ((cells.empty() && area_of_caps == 0.0) || line_count == most_lines)
                throw_invalid("surface", "one with points to sample", "none in sight");
            if (area_of_caps > 0.0 && fine() < part_of_caps) {
                const auto [polygon, position] = triangles.at(fine(), {fine(), fine()});
                is_found = caps.is_on_cap(*polygon, position);
                samples[i] = {position, polygon->normal, surface.cap_id(polygon->plane)};
                continue;
            }
            const auto row = std::min(static_cast<std::size_t>(fine() * count), cells.size() - 1);
            const VolumeCell cell(volume, surface.threshold(), cells[row]);
            const int axis = std::min(static_cast<int>(3.0 * random.next()), 2);
            const int wanted = Degree == 1 ? 0 : static_cast<int>(Degree * random.next());
            glm::dvec3 local(fine(), fine(), fine());
            int met = 0;
            for_each_root(line_of_cell<Degree>(cell, axis, local), [&](double root) {
                if (met++ == wanted)
                    local[axis] = root;
            });
            if (met <= wanted)
                continue;
            const glm::dvec3 gradient = scalar::gradient_in_cell<Degree>(cell, local);
            const double density = std::abs(gradient.x) + std::abs(gradient.y) + std::abs(gradient.z);
            if (!(random.next() * density * largest < glm::length(gradient * to_lattice)))
                continue;
            const glm::dvec3 lattice = cell.lower + local;
            const bool is_cut =
                std::any_of(surface.clip_lattice().begin(), surface.clip_lattice().end(),
                            [&](const HalfSpace& cut) { return glm::dot(cut.normal, lattice) < cut.offset; });
            if (is_cut)
                continue;
            Hit hit;
            set_surface_normal(hit, gradient, surface.options().inside, volume.world_to_lattice());
            samples[i] = {transform_point(volume.lattice_to_world(), lattice), hit.normal,
                          volume.primitive_id(cells[row])};
            is_found = true;
        }
    }
}

} // namespace

void sample_surface(const IsosurfaceSnapshot& surface, std::uint32_t seed, std::size_t first,
                    std::span<SurfaceSample> samples)
{
    dispatch_degree(surface.volume().degree(), [&](auto degree) { sample<degree>(surface, seed, first, samples); });
}

} // namespace isospline
