#include "isospline/polygonize/nearness.h"

#include "isospline/math/affine.h"
#include "isospline/query/closest_point.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>

namespace isospline {

template <int Degree>
double distance_from_surface(const LatticeField<Degree>& field, const LabeledMesh& mesh, double near,
                             const Progress& progress)
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Volume& volume = field.surface().volume();
    const LatticeMetric metric(volume.lattice_to_world());
    double largest = 0.0;
    std::mutex mutex;
    parallel_for(
        mesh.faces.size(), 1024,
        [&](std::size_t begin, std::size_t end) {
            std::unique_ptr<ClosestPointFinder> finder;
            double most = 0.0;
            for (std::size_t i = begin; i < end; ++i) {
                if (mesh.labels[i] != on_isosurface)
                    continue;
                const glm::uvec3& face = mesh.faces[i];
                for_each_sample({mesh.vertices[face.x], mesh.vertices[face.y], mesh.vertices[face.z]}, measured_spacing,
                                [&](const glm::dvec3& at) {
                                    const auto foot = field.project(at, search_reach, metric);
                                    double distance = foot ? metric.length(*foot - at) : infinity;
                                    if (!(distance <= near)) {
                                        if (!finder)
                                            finder = std::make_unique<ClosestPointFinder>(field.surface());
                                        distance = (*finder)(transform_point(volume.lattice_to_world(), at)).distance;
                                    }
                                    most = std::max(most, distance);
                                    return true;
                                });
            }
            const std::lock_guard lock(mutex);
            largest = std::max(largest, most);
        },
        progress);
    return largest;
}

template double distance_from_surface(const LatticeField<1>&, const LabeledMesh&, double, const Progress&);
template double distance_from_surface(const LatticeField<2>&, const LabeledMesh&, double, const Progress&);
template double distance_from_surface(const LatticeField<3>&, const LabeledMesh&, double, const Progress&);

} // namespace isospline
