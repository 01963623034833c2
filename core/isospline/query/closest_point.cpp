#include "isospline/query/closest_point.h"

#include "isospline/math/affine.h"
#include "isospline/query/foot_proof.h"
#include "isospline/query/surface_box.h"
#include "isospline/query/surface_descent.h"
#include "isospline/shell/cell_tree.h"
#include "isospline/spline/degree.h"
#include "isospline/trace/surface_hit.h"
#include "isospline/util/check.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

namespace isospline {

struct ClosestPointFinder::Search {
    virtual ~Search() = default;
    virtual ClosestPoint find(const glm::dvec3& point_world, double max_distance) = 0;
};

template <int Degree>
struct ClosestPointFinder::SearchOfDegree final : Search {
    /// The largest number of times that a box is halved: 32 along each axis.
    static constexpr int max_depth = 96;
    static constexpr std::size_t face_count = 6;

    /// A part that has not been examined yet: a node of the tree, or a box.
    struct Item {
        double bound; ///< lower bound on its distance, world units
        std::uint32_t index;
        bool is_box;

        bool operator<(const Item& other) const { return bound > other.bound; } // the nearest is at the heap's top
    };

    SearchOfDegree(const IsosurfaceSnapshot& isosurface, const ClosestPointOptions& search_options,
                   const glm::dmat4& transform)
        : surface(isosurface), options(search_options), to_world(transform * surface.volume().lattice_to_world()),
          to_lattice(glm::inverse(to_world)), metric(to_world), proof(surface, metric)
    {
        if (options.tolerance == 0.0)
            options.tolerance = 1e-6 * metric.shortest_edge;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 normal(0.0);
            normal[axis] = 1.0;
            half_spaces.push_back({normal, 0.0});
            half_spaces.push_back({-normal, -1.0});
        }
        half_spaces.insert(half_spaces.end(), surface.clip_lattice().begin(), surface.clip_lattice().end());
    }

    VolumeCell coefficients(std::uint32_t row) const
    {
        return VolumeCell(surface.volume(), surface.threshold(), surface.shell().cells()[row]);
    }

    /// Enters a cell; `half_spaces` then has its faces.
    VolumeCell enter(std::uint32_t row)
    {
        const glm::dvec3 lower(glm::ivec3(surface.shell().cells()[row]));
        for (std::size_t i = 0; i < surface.clip_lattice().size(); ++i) {
            const HalfSpace& cut = surface.clip_lattice()[i];
            half_spaces[face_count + i].offset = cut.offset - glm::dot(cut.normal, lower);
        }
        return coefficients(row);
    }

    std::span<const HalfSpace> cuts() const { return std::span(half_spaces).subspan(face_count); }

    double limit() const { return std::min(nearest.distance, options.max_distance); }

    void push(double bound, std::uint32_t index, bool is_box)
    {
        queue.push_back({bound, index, is_box});
        std::push_heap(queue.begin(), queue.end());
    }

    void push_node(std::uint32_t index)
    {
        const double bound = metric.distance_bound(point, (*nodes)[index].box());
        if (bound <= limit())
            push(bound, index, false);
    }

    void push_box(const SurfaceBox<Degree>& box, const CellCoefficients& cell, double least_bound)
    {
        if (!box.has_surface() || proof.clears(glm::ivec3(cell.lower), box.lower, box.size))
            return;
        for (const HalfSpace& cut : cuts()) {
            const glm::dvec3 farthest(glm::greaterThan(cut.normal, glm::dvec3(0.0)));
            if (glm::dot(cut.normal, box.lower + farthest * box.size) < cut.offset - descent_margin)
                return;
        }
        const double bound = std::max(least_bound, distance_bound<Degree>(box, metric, point - cell.lower, cuts()));
        if (!(bound <= limit()))
            return;
        if (free_boxes.empty()) {
            free_boxes.push_back(static_cast<std::uint32_t>(boxes.size()));
            boxes.emplace_back();
        }
        const std::uint32_t index = free_boxes.back();
        free_boxes.pop_back();
        boxes[index] = box;
        push(bound, index, true);
    }

    /// Searches for a nearer point of the surface, starting from the middle of a box.
    void descend_from(const SurfaceBox<Degree>& box, const CellCoefficients& cell)
    {
        const glm::dvec3 point_local = point - cell.lower;
        const auto is_good = [&](const std::optional<DescentEnd>& end) {
            return end && is_on_surface<Degree>(surface.volume(), cell, end->position);
        };
        auto found = descend<Degree>(cell, metric, half_spaces, point_local, box);
        if (!is_good(found))
            found = any_point<Degree>(cell, half_spaces, box);
        if (!is_good(found))
            return;
        const double distance = metric.length(found->position - point_local);
        if (distance < nearest.distance && distance <= options.max_distance) {
            nearest = {distance, surface.shell().cells()[box.row], found->position, true, found->is_free};
            const glm::dvec3 gradient = scalar::gradient_in_cell<Degree>(cell, found->position);
            if (const auto foot = Foot::at(metric, point, nearest.cell, nearest.local, gradient);
                foot && found->is_free)
                proof.begin(point, *foot);
        }
    }

    void halve(const SurfaceBox<Degree>& box, const CellCoefficients& cell, double bound)
    {
        int longest = 0;
        for (int axis = 1; axis < 3; ++axis)
            if (box.size[axis] * glm::length(metric.to_world[axis]) >
                box.size[longest] * glm::length(metric.to_world[longest]) * (1.0 + 1e-9))
                longest = axis;
        push_box(half_of<Degree>(box, longest, false), cell, bound);
        push_box(half_of<Degree>(box, longest, true), cell, bound);
    }

    /// Searches for the nearest point, starting at the point itself. Returns whether the result is proven to be the
    /// nearest; otherwise it is a first candidate.
    bool find_locally()
    {
        proof.clear();
        const auto foot = find_foot<Degree>(surface, metric, point);
        if (!foot || !is_shown(*foot))
            return false;
        if (foot->distance <= options.max_distance)
            nearest = {foot->distance, foot->cell, foot->local, true, true};
        proof.begin(point, *foot);
        return proof.is_nearest();
    }

    /// Whether a zero of f - level belongs to the surface, in a cell that the mask keeps, and is in the clip.
    bool is_shown(const Foot& candidate) const
    {
        const VolumeCell cell(surface.volume(), surface.threshold(), candidate.cell);
        if (!surface.kept_cells().contains(candidate.cell) ||
            !is_on_surface<Degree>(surface.volume(), cell, candidate.local))
            return false;
        const glm::dvec3 lattice = glm::dvec3(candidate.cell) + candidate.local;
        return std::all_of(surface.clip_lattice().begin(), surface.clip_lattice().end(), [&](const HalfSpace& cut) {
            return glm::dot(cut.normal, lattice) >= cut.offset - descent_margin;
        });
    }

    ClosestPoint find(const glm::dvec3& point_world, double max_distance) override
    {
        options.max_distance = max_distance;
        point = transform_point(to_lattice, point_world);
        nearest = {};
        if (find_locally())
            return result(point_world, std::numeric_limits<double>::infinity());
        queue.clear();
        boxes.clear();
        free_boxes.clear();
        if (nodes == nullptr)
            nodes = &surface.shell(options.progress).tree(options.progress).nodes();
        if (!nodes->empty())
            push_node(0);

        // Nearest part first, until no part can be nearer by more than the tolerance.
        double undecided = std::numeric_limits<double>::infinity();
        for (int count = 0; !queue.empty();) {
            const Item item = queue.front();
            if (!(item.bound < limit() - options.tolerance) || count >= options.max_boxes)
                break;
            std::pop_heap(queue.begin(), queue.end());
            queue.pop_back();
            const CellTree::Node* const node = item.is_box ? nullptr : &(*nodes)[item.index];
            if (node == nullptr) {
                const SurfaceBox<Degree> box = boxes[item.index];
                free_boxes.push_back(item.index);
                const VolumeCell cell = enter(box.row);
                if (!nearest.is_known || (box.depth > 0 && box.depth % 6 == 0))
                    descend_from(box, cell);
                if (box.depth < max_depth)
                    halve(box, cell, item.bound);
                else
                    undecided = std::min(undecided, item.bound);
                count += 2;
            } else if (node->count == 0) {
                push_node(item.index + 1);
                push_node(node->first);
            } else {
                for (std::uint32_t row = node->first; row < node->first + node->count; ++row) {
                    const Cell cell_index = surface.shell().cells()[row];
                    const glm::dvec3 lower(static_cast<glm::ivec3>(cell_index));
                    if (!(metric.distance_bound(point, {lower, lower + 1.0}) <= limit()) ||
                        proof.clears(cell_index, glm::dvec3(0.0), glm::dvec3(1.0)))
                        continue;
                    const VolumeCell cell = enter(row);
                    push_box(surface_box<Degree>(cell, row), cell, 0.0);
                }
                // Near the centre of a sphere, many cells are nearer than the first box: without a point, all are
                // opened.
                if (nearest.is_known)
                    count += static_cast<int>(node->count);
            }
        }
        if (!queue.empty())
            undecided = std::min(undecided, queue.front().bound);

        // If a point ended on a face of its cell, a nearer one may be behind that face.
        for (int count = 0; count < 32 && !nearest.is_free && !queue.empty() && queue.front().bound < limit();
             ++count) {
            const Item item = queue.front();
            std::pop_heap(queue.begin(), queue.end());
            queue.pop_back();
            if (item.is_box)
                descend_from(boxes[item.index], enter(boxes[item.index].row));
        }
        return result(point_world, undecided);
    }

    /// The result, given that no part of the surface is nearer than `proven` or the nearest point.
    ClosestPoint result(const glm::dvec3& point_world, double proven) const
    {
        ClosestPoint answer;
        answer.error = proven < limit() ? limit() - proven : 0.0;
        if (!nearest.is_known)
            return answer;
        const VolumeCell cell(surface.volume(), surface.threshold(), nearest.cell);
        Hit hit;
        set_surface_normal(hit, scalar::gradient_in_cell<Degree>(cell, nearest.local), surface.options().inside,
                           to_lattice);
        answer.position = transform_point(to_world, cell.lower + nearest.local);
        answer.normal = hit.normal;
        answer.distance = glm::length(answer.position - point_world);
        answer.primitive_id = surface.volume().primitive_id(nearest.cell);
        return answer;
    }

    /// The nearest point so far.
    struct Nearest {
        double distance = std::numeric_limits<double>::infinity();
        glm::ivec3 cell{0};
        glm::dvec3 local{0.0}; ///< in its cell
        bool is_known = false;
        bool is_free = false; ///< not on a face of the cell, a cut or the rim of the volume
    };

    const IsosurfaceSnapshot& surface;
    ClosestPointOptions options;
    const glm::dmat4 to_world, to_lattice; ///< from the lattice to the space of the points, and back
    const LatticeMetric metric;
    const std::vector<CellTree::Node>* nodes = nullptr; ///< of the shell's tree, once they are needed
    FootProof<Degree> proof;
    glm::dvec3 point{0.0}; ///< lattice space
    Nearest nearest;
    std::vector<Item> queue; ///< a heap
    std::vector<SurfaceBox<Degree>> boxes;
    std::vector<std::uint32_t> free_boxes; ///< items of `boxes` that may be used again
    std::vector<HalfSpace> half_spaces;    ///< faces of the entered cell, then cuts, in its local coordinates
};

ClosestPointFinder::ClosestPointFinder(const IsosurfaceSnapshot& surface, const ClosestPointOptions& options,
                                       const glm::dmat4& transform)
    : max_distance_(options.max_distance), caps_(surface, transform)
{
    if (!(options.max_distance >= 0.0))
        throw_invalid("max_distance", "a number of at least 0", options.max_distance);
    check_not_negative("tolerance", options.tolerance);
    if (options.max_boxes < 1)
        throw_invalid("max_boxes", "a number above 0", options.max_boxes);
    search_ = dispatch_degree(surface.volume().degree(), [&](auto degree) -> std::unique_ptr<Search> {
        return std::make_unique<SearchOfDegree<degree>>(surface, options, transform);
    });
}

ClosestPointFinder::~ClosestPointFinder() = default;
ClosestPointFinder::ClosestPointFinder(ClosestPointFinder&&) noexcept = default;

ClosestPoint ClosestPointFinder::operator()(const glm::dvec3& point_world)
{
    return within(point_world, max_distance_);
}

ClosestPoint ClosestPointFinder::within(const glm::dvec3& point_world, double max_distance)
{
    const auto on_cap = caps_.closest(point_world, max_distance);
    if (!on_cap)
        return search_->find(point_world, max_distance);
    const ClosestPoint on_surface = search_->find(point_world, on_cap->distance);
    if (on_surface.distance <= on_cap->distance)
        return on_surface;
    return {on_cap->position, on_cap->normal, on_cap->distance, on_surface.error, on_cap->primitive_id};
}

} // namespace isospline
