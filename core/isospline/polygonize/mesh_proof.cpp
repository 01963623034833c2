#include "isospline/polygonize/mesh_proof.h"

#include "isospline/math/affine.h"
#include "isospline/polygonize/face_crossing.h"
#include "isospline/polygonize/face_distance.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

namespace isospline {

template <int Degree>
bool MeshProof<Degree>::is_before(const ProvenFace& a, const ProvenFace& b)
{
    return is_face_before(a.face, b.face);
}

template <int Degree>
typename MeshProof<Degree>::ProvenFace* MeshProof<Degree>::find(std::vector<ProvenFace>& faces, const glm::uvec3& face)
{
    const auto found = std::lower_bound(faces.begin(), faces.end(), ProvenFace{face, 0.0, false}, is_before);
    return found != faces.end() && found->face == face ? &*found : nullptr;
}

template <int Degree>
typename MeshProof<Degree>::ProvenFace* MeshProof<Degree>::find_known(const LabeledMesh& mesh, const glm::uvec3& face)
{
    ProvenFace* const known = find(faces_, face);
    for (int corner = 0; known != nullptr && corner < 3; ++corner)
        if (mesh.vertices[face[corner]] != vertices_[face[corner]])
            return nullptr;
    return known;
}

template <int Degree>
void MeshProof<Degree>::examine(const LabeledMesh& mesh, const std::vector<std::uint8_t>& has_changed, bool is_last,
                                const Progress& progress)
{
    // Faces cross others as before if neither is new.
    std::vector<std::uint8_t> may_cross = has_changed;
    // From the mesh to the surface: the faces that are new.
    std::vector<ProvenFace> faces;
    LabeledMesh added{mesh.vertices, {}, {}};
    std::vector<std::uint8_t> added_have_changed;
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
        const ProvenFace* const known = find_known(mesh, mesh.faces[i]);
        if (!faces_.empty())
            may_cross[i] = known == nullptr || known->crosses_other ? 1 : 0;
        if (known != nullptr && !(is_last && known->distance > tolerance_)) {
            faces.push_back({known->face, known->distance, has_changed[i] != 0});
        } else {
            added.faces.push_back(mesh.faces[i]);
            added.labels.push_back(mesh.labels[i]);
            added_have_changed.push_back(has_changed[i]);
        }
    }
    const std::vector<double> distances =
        distances_from_surface(field_, parts_, added, tolerance_, is_last, part_of(progress, 0.0, 0.6));
    for (std::size_t i = 0; i < distances.size(); ++i)
        faces.push_back({added.faces[i], distances[i], added_have_changed[i] != 0});
    std::sort(faces.begin(), faces.end(), is_before);

    // From the surface to the mesh: the cells around faces that are gone.
    CellFilter filter;
    std::optional<ChosenCells> changed;
    const LatticeMetric metric(field_.surface().volume().lattice_to_world());
    const glm::dvec3 reach = box_of_ball(metric, tolerance_);
    if (!faces_.empty()) {
        std::vector<Box> boxes = covering_.uncovered;
        for (const ProvenFace& proven : faces_)
            if (find(faces, proven.face) == nullptr || find_known(mesh, proven.face) == nullptr) {
                const Box box = box_of(vertices_, proven.face);
                boxes.push_back({box.lower - reach, box.upper + reach});
            }
        changed.emplace(boxes, 0.0, field_.surface().volume().cell_shape());
        filter = changed->filter();
    }
    const double least_edge = least_edge_of(metric, tolerance_);
    const double reported = is_last ? 0.0 : std::max(2.0 * least_edge, 0.125 * std::min({reach.x, reach.y, reach.z}));
    Covering covering =
        cover_surface(field_, parts_, mesh, tolerance_, {least_edge, reported}, filter, part_of(progress, 0.6, 0.95));
    covering.distance = std::max(covering.distance, covering_.distance);
    // Rounded to the world's coordinates, others may cross.
    const glm::dmat4& to_world = field_.surface().volume().lattice_to_world();
    std::vector<glm::dvec3> world(mesh.vertices.size());
    double largest = glm::length(glm::dvec3(to_world[3]));
    std::transform(mesh.vertices.begin(), mesh.vertices.end(), world.begin(), [&](const glm::dvec3& vertex) {
        const glm::dvec3 at = transform_point(to_world, vertex);
        largest = std::max(largest, glm::length(at));
        return at;
    });
    const RoundedVertices rounded{world, box_of_ball(metric, 0x1p-46 * largest)};
    crossings_ = find_crossings(mesh.vertices, mesh.faces, may_cross, part_of(progress, 0.95, 1.0), &rounded);
    std::erase_if(crossings_, [&](const std::array<std::uint32_t, 2>& pair) {
        return has_changed[pair[0]] == 0 && has_changed[pair[1]] == 0;
    });
    for (const auto& pair : crossings_)
        for (const std::uint32_t face : pair)
            find(faces, mesh.faces[face])->crosses_other = true;
    covering_ = std::move(covering);
    vertices_ = mesh.vertices;
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
    std::vector<Box> boxes;
    for (const ProvenFace& proven : faces_)
        if (proven.has_changed && proven.distance > tolerance_)
            boxes.push_back(box_of(mesh.vertices, proven.face));
    for (const auto& [first, second] : crossings_) {
        const Box a = box_of(mesh.vertices, mesh.faces[first]), b = box_of(mesh.vertices, mesh.faces[second]);
        const glm::dvec3 lower = glm::max(a.lower, b.lower), upper = glm::min(a.upper, b.upper);
        boxes.push_back({glm::min(lower, upper), glm::max(lower, upper)}); // in lattice space, they may just not meet
    }
    return boxes;
}

template <int Degree>
void MeshProof<Degree>::mark_failed(const LabeledMesh& mesh, std::vector<std::uint8_t>& flags) const
{
    const auto mark = [&](const glm::uvec3& face) {
        for (int corner = 0; corner < 3; ++corner)
            flags[face[corner]] = 1;
    };
    for (const ProvenFace& proven : faces_)
        if (proven.distance > tolerance_)
            mark(proven.face);
    for (const auto& pair : crossings_)
        for (const std::uint32_t face : pair)
            mark(mesh.faces[face]);
}

template class MeshProof<1>;
template class MeshProof<2>;
template class MeshProof<3>;

} // namespace isospline
