#include "isospline/scene/ray_query.h"
#include "isospline/scene/scene_snapshot_impl.h"
#include "isospline/util/error.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <tuple>

namespace isospline {

namespace {

/// Keeps a triangle and lets the ray go on.
void keep_triangle(const RTCFilterFunctionNArguments* arguments)
{
    if (arguments->valid[0] != -1)
        return;
    arguments->valid[0] = 0;
    auto& query = static_cast<RayQuery&>(*arguments->context);
    const double t = static_cast<double>(RTCRayN_tfar(arguments->ray, arguments->N, 0));
    query.all->push_back({{{t, glm::dvec3(0.0)}, false},
                          {RTCHitN_u(arguments->hit, arguments->N, 0), RTCHitN_v(arguments->hit, arguments->N, 0)},
                          query.instID[0],
                          RTCHitN_primID(arguments->hit, arguments->N, 0)});
}

} // namespace

void SceneSnapshot::Impl::add_caps(const ChordOfInstance& of_instance, const Ray& ray, const PreparedRay& prepared,
                                   std::vector<Crossing>& crossings) const
{
    const CappedChord& chord = of_instance.chord;
    const IsosurfaceSnapshot& surface = *of_instance.surface;
    const Instance& instance = *instances[of_instance.slot];
    const auto begin = std::partition_point(crossings.begin(), crossings.end(), [&](const Crossing& crossing) {
        return crossing.hit.geometry_id < instance.id;
    });
    const auto end = std::partition_point(
        begin, crossings.end(), [&](const Crossing& crossing) { return crossing.hit.geometry_id == instance.id; });
    std::optional<bool> first_enters, last_enters;
    if (begin != end) {
        first_enters = begin->entering;
        last_enters = std::prev(end)->entering;
    }
    const CappedEnds ends = chord.capped_ends(surface, first_enters, last_enters);
    const auto cap_at = [&](double t, int face, bool entering) {
        Crossing crossing{};
        crossing.hit.t = prepared.original_t(t);
        crossing.hit.geometry_id = instance.id;
        crossing.hit.primitive_id =
            static_cast<std::uint32_t>(surface.shell().count()) + static_cast<std::uint32_t>(face);
        instance.object->complete(crossing.hit, ray, gradient_lattice(surface, chord.at(t)), instance.placement);
        crossing.entering = entering;
        return crossing;
    };
    const std::ptrdiff_t first = begin - crossings.begin();
    if (ends.exit)
        crossings.insert(end, cap_at(chord.t_far, chord.exit, false));
    if (ends.entry)
        crossings.insert(crossings.begin() + first, cap_at(chord.t_near, chord.entry, true));
}

void SceneSnapshot::Impl::list(RTCScene top, const Ray& ray, std::size_t index, RayQuery& query,
                               std::vector<Crossing>& crossings) const
{
    crossings.clear();
    if (!prepare(ray, index, centre, centred_bounds, query.prepared))
        return;
    query.all->clear();
    query.begin();
    RTCRayHit ray_hit;
    set_ray(query.prepared.ray, ray_hit.ray);
    ray_hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray_hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    embree::intersect_filtered(top, query, ray_hit, keep_triangle);

    for (const RawCrossing& raw : *query.all) {
        const Instance& instance = *instances[raw.slot];
        Crossing crossing{};
        crossing.hit.t = query.prepared.original_t(raw.in_cell.root.t);
        crossing.hit.geometry_id = instance.id;
        crossing.hit.primitive_id = raw.primitive;
        crossing.hit.uv = raw.uv;
        instance.object->complete(crossing.hit, ray, raw.in_cell.root.gradient, instance.placement);
        crossing.entering = instance.object->is_entering(crossing.hit, ray, raw.in_cell.rising);
        crossings.push_back(crossing);
    }

    // Instance by instance, each crossing once; then all by t.
    std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
        return std::tie(a.hit.geometry_id, a.hit.t, a.hit.primitive_id) <
               std::tie(b.hit.geometry_id, b.hit.t, b.hit.primitive_id);
    });
    const auto is_same = [&](const Crossing& a, const Crossing& b) {
        if (a.hit.geometry_id != b.hit.geometry_id || a.entering != b.entering)
            return false;
        const Instance& instance = *find(a.hit.geometry_id);
        return instance.object->is_same_crossing(a, b, ray, instance.placement);
    };
    crossings.erase(std::unique(crossings.begin(), crossings.end(), is_same), crossings.end());
    for (const ChordOfInstance& chord : query.chords)
        add_caps(chord, ray, query.prepared, crossings);
    // Of caps that coincide the last one added is the first, as for cast_rays().
    std::stable_sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
        return a.hit.t < b.hit.t || (a.hit.t == b.hit.t && a.hit.geometry_id > b.hit.geometry_id);
    });
}

void SceneSnapshot::Impl::list(RTCScene top, std::span<const Ray> rays, std::vector<Crossing>& crossings,
                               std::span<std::uint32_t> counts) const
{
    ISOSPLINE_ASSERT(rays.size(), ==, counts.size());
    RayQuery query(instances);
    std::vector<RawCrossing> raw;
    query.all = &raw;
    std::vector<Crossing> of_ray;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        list(top, rays[i], i, query, of_ray);
        crossings.insert(crossings.end(), of_ray.begin(), of_ray.end());
        counts[i] = static_cast<std::uint32_t>(of_ray.size());
    }
}

void SceneSnapshot::list_intersections(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                                       std::span<std::uint32_t> counts) const
{
    impl_->list(impl_->camera_top.get(), rays, crossings, counts);
}

void SceneSnapshot::list_occluders(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                                   std::span<std::uint32_t> counts) const
{
    impl_->list(impl_->shadow_top(), rays, crossings, counts);
}

} // namespace isospline
