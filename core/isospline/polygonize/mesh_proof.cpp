#include "isospline/polygonize/mesh_proof.h"

#include "isospline/polygonize/face_distance.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace isospline {

template <int Degree>
bool MeshProof<Degree>::is_before(const ProvenFace& a, const ProvenFace& b)
{
    return std::tie(a.face.x, a.face.y, a.face.z) < std::tie(b.face.x, b.face.y, b.face.z);
}

template <int Degree>
const typename MeshProof<Degree>::ProvenFace* MeshProof<Degree>::find(const std::vector<ProvenFace>& faces,
                                                                      const glm::uvec3& face) const
{
    const auto found = std::lower_bound(faces.begin(), faces.end(), ProvenFace{face, 0.0}, is_before);
    return found != faces.end() && found->face == face ? &*found : nullptr;
}

template <int Degree>
void MeshProof<Degree>::examine(const LabeledMesh& mesh, const Progress& progress)
{
    // From the mesh to the surface: the faces that are new.
    std::vector<ProvenFace> faces;
    LabeledMesh added{mesh.vertices, {}, {}};
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        if (const ProvenFace* const known = find(faces_, mesh.faces[i])) {
            faces.push_back(*known);
        } else {
            added.faces.push_back(mesh.faces[i]);
            added.labels.push_back(mesh.labels[i]);
        }
    }
    const std::vector<double> distances =
        distances_from_surface(field_, added, tolerance_, part_of(progress, 0.0, 0.6));
    for (std::size_t i = 0; i < distances.size(); ++i)
        faces.push_back({added.faces[i], distances[i]});
    std::sort(faces.begin(), faces.end(), is_before);

    // From the surface to the mesh: the cells around faces that are gone.
    CellFilter filter;
    std::unordered_set<CrossingKey> changed;
    const LatticeMetric metric(field_.surface().volume().lattice_to_world());
    if (!faces_.empty()) {
        std::vector<Box> boxes = covering_.uncovered;
        const glm::dvec3 reach = box_of_ball(metric, tolerance_);
        for (const ProvenFace& proven : faces_)
            if (find(faces, proven.face) == nullptr) {
                Box box;
                for (int corner = 0; corner < 3; ++corner)
                    box.extend(mesh.vertices[proven.face[corner]]);
                boxes.push_back({box.lower - reach, box.upper + reach});
            }
        changed = cubes_of(boxes, 1.0, 0.0);
        filter = [&changed](const glm::ivec3& cell) { return changed.count(crossing_key(cell, 0)) != 0; };
    }
    Covering covering =
        cover_surface(field_, mesh, tolerance_, least_edge_of(metric, tolerance_), filter, part_of(progress, 0.6, 1.0));
    covering.distance = std::max(covering.distance, covering_.distance);
    covering_ = std::move(covering);
    faces_ = std::move(faces);
}

template <int Degree>
double MeshProof<Degree>::distance() const
{
    double most = covering_.distance;
    for (const ProvenFace& proven : faces_)
        most = std::max(most, proven.distance);
    return most;
}

template <int Degree>
std::vector<Box> MeshProof<Degree>::failed(const LabeledMesh& mesh) const
{
    std::vector<Box> boxes = covering_.uncovered;
    for (const ProvenFace& proven : faces_)
        if (proven.distance > tolerance_) {
            boxes.emplace_back();
            for (int corner = 0; corner < 3; ++corner)
                boxes.back().extend(mesh.vertices[proven.face[corner]]);
        }
    return boxes;
}

template class MeshProof<1>;
template class MeshProof<2>;
template class MeshProof<3>;

} // namespace isospline
