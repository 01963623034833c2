#include "isospline/polygonize/surface_mesh.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/clip_mesher.h"
#include "isospline/polygonize/lattice_mesher.h"
#include "isospline/polygonize/mesh_part.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/parallel.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace isospline {

namespace {

template <int Degree>
LabeledMesh lattice_mesh(const IsosurfaceSnapshot& surface, int subdivision, const Progress& progress)
{
    const LatticeField<Degree> field(surface, subdivision);
    const ClipCubes clip(surface.clip_lattice(), subdivision);
    std::vector<MeshPart> parts = march_cubes(field, clip, part_of(progress, 0.0, 0.6));
    parts.push_back(march_cut_cubes(field, clip, part_of(progress, 0.6, 0.8)));
    return join_parts(std::move(parts), part_of(progress, 0.8, 0.9));
}

/// From lattice space to the world, with normals.
template <int Degree>
SurfaceMesh to_world(const IsosurfaceSnapshot& surface, LabeledMesh mesh, const Progress& progress)
{
    const LatticeField<Degree> field(surface, 1);
    const Volume& volume = surface.volume();
    SurfaceMesh result{std::move(mesh.vertices), {}, std::move(mesh.faces)};
    result.normals.resize(result.vertices.size());

    // Vertices of caps alone have a cap's normal; where gradients vanish, normals are those of faces.
    std::vector<FaceLabel> label(result.vertices.size(), ~FaceLabel{0});
    for (std::size_t face = 0; face < result.faces.size(); ++face)
        for (int corner = 0; corner < 3; ++corner)
            label[result.faces[face][corner]] = std::min(label[result.faces[face][corner]], mesh.labels[face]);
    parallel_for(
        result.vertices.size(), 4096,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                glm::dvec3& vertex = result.vertices[i];
                if (label[i] == on_isosurface) {
                    Hit hit;
                    set_surface_normal(hit, field.gradient(vertex), surface.options().inside,
                                       volume.world_to_lattice());
                    result.normals[i] = hit.normal;
                } else {
                    result.normals[i] = -glm::normalize(surface.options().clip[label[i] - 1].normal);
                }
                vertex = transform_point(volume.lattice_to_world(), vertex);
            }
        },
        progress);

    const bool is_mirrored = glm::determinant(glm::dmat3(volume.lattice_to_world())) < 0.0;
    if (is_mirrored)
        for (glm::uvec3& face : result.faces)
            std::swap(face.y, face.z);
    return result;
}

} // namespace

SurfaceMesh to_mesh(const IsosurfaceSnapshot& surface, const Progress& progress)
{
    return dispatch_degree(surface.volume().degree(), [&](auto degree) {
        LabeledMesh mesh = lattice_mesh<degree>(surface, 1, progress);
        return to_world<degree>(surface, std::move(mesh), part_of(progress, 0.9, 1.0));
    });
}

} // namespace isospline
