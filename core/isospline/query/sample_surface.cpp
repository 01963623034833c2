#include "isospline/query/sample_surface.h"

#include "isospline/cell/value-inl.h"
#include "isospline/math/affine.h"
#include "isospline/math/random.h"
#include "isospline/measure/polynomial.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/error.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace isospline {

namespace {

/// f - level in a cell along an axis, over a point of the face across it.
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

template <int Degree>
void sample(const IsosurfaceSnapshot& surface, std::uint32_t seed, std::size_t first, std::span<SurfaceSample> samples)
{
    constexpr int most_lines = 1 << 20;
    const Volume& volume = surface.volume();
    const std::vector<Cell>& cells = surface.shell().cells();
    const glm::dmat3 to_lattice(volume.world_to_lattice());
    // An area of the surface in the world over one in the lattice is |n L^-1| / |n|, n being the gradient, times a
    // constant. The lines of three axes meet it with a density of (|n_x| + |n_y| + |n_z|) / |n|.
    double largest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 normal(0.0);
        normal[axis] = 1.0;
        largest = std::max(largest, glm::length(normal * to_lattice));
    }
    const auto count = static_cast<double>(cells.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const std::uint64_t number = first + i;
        RandomSequence random({static_cast<int>(static_cast<std::uint32_t>(number)),
                               static_cast<int>(static_cast<std::uint32_t>(number >> 32))},
                              0, seed);
        const auto fine = [&] { return random.next() + 0x1p-32 * random.next(); };
        bool is_found = false;
        for (int line_count = 0; !is_found; ++line_count) {
            if (cells.empty() || line_count == most_lines)
                throw_invalid("surface", "one with points to sample, or samples=0", "none in sight");
            const auto row = std::min(static_cast<std::size_t>(fine() * count), cells.size() - 1);
            const CellCoefficients cell(volume, surface.threshold(), cells[row]);
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
