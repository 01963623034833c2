#include "isospline/scene/ray_caster_impl.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <variant>

namespace isospline {

void SceneSnapshot::Impl::add_caps(const ChordOfInstance& of_instance, const Ray& ray, const PreparedRay& prepared,
                                   std::vector<ListedCrossing>& crossings) const
{
    const CappedChord& chord = of_instance.chord;
    const IsosurfaceSnapshot& surface = *of_instance.surface;
    const Instance& instance = *instances[of_instance.slot];
    const auto begin = std::partition_point(crossings.begin(), crossings.end(), [&](const ListedCrossing& listed) {
        return listed.crossing.hit.geometry_id < instance.id;
    });
    const auto end = std::partition_point(begin, crossings.end(), [&](const ListedCrossing& listed) {
        return listed.crossing.hit.geometry_id == instance.id;
    });
    std::optional<bool> first_enters, last_enters;
    if (begin != end) {
        first_enters = begin->crossing.entering;
        last_enters = std::prev(end)->crossing.entering;
    }
    const CappedEnds ends = chord.capped_ends(surface, first_enters, last_enters);
    const auto cap_at = [&](double t, int face, bool entering) {
        Crossing crossing{};
        crossing.hit.t = prepared.limits.given_t(t);
        crossing.hit.geometry_id = instance.id;
        crossing.hit.primitive_id = surface.cap_id(static_cast<std::size_t>(face));
        instance.object->complete(crossing.hit, ray, gradient_lattice(surface, chord.at(t)), instance.placement);
        crossing.entering = entering;
        return ListedCrossing{crossing, true};
    };
    const std::ptrdiff_t first = begin - crossings.begin();
    if (ends.exit)
        crossings.insert(end, cap_at(chord.t_far, chord.exit, false));
    if (ends.entry)
        crossings.insert(crossings.begin() + first, cap_at(chord.t_near, chord.entry, true));
}

namespace {

Crossing complete(const RawCrossing& raw, const Instance& instance, const Ray& ray, const PreparedRay& prepared)
{
    Crossing crossing{};
    crossing.hit.geometry_id = instance.id;
    crossing.hit.primitive_id = raw.primitive;
    if (const auto* in_cell = std::get_if<CrossingInCell>(&raw.found)) {
        crossing.hit.t = prepared.limits.given_t(in_cell->root.t);
        instance.object->complete(crossing.hit, ray, in_cell->root.gradient, instance.placement);
        crossing.entering = instance.object->is_entering(crossing.hit, ray, in_cell->rising);
    } else {
        const auto& in_mesh = std::get<TriangleHit>(raw.found);
        crossing.hit.t = in_mesh.t;
        crossing.hit.uv = in_mesh.uv;
        instance.object->complete(crossing.hit, ray, glm::dvec3(0.0), instance.placement);
        crossing.entering = in_mesh.entering;
    }
    return crossing;
}

} // namespace

void SceneSnapshot::Impl::list(bool SeenBy::*sees, const Ray& ray, std::size_t index, RayQuery& query,
                               std::vector<ListedCrossing>& crossings) const
{
    crossings.clear();
    if (!prepare(ray, index, met(sees).frame, query.prepared))
        return;
    query.all->clear();
    query.begin(ray);
    RTCRayHit ray_hit;
    set_ray(query.prepared.ray, ray_hit);
    embree::intersect(met(sees).top.get(), query, ray_hit);
    query.rethrow();
    list(ray, query.prepared, *query.all, query.chords, crossings);
}

void SceneSnapshot::Impl::list(const Ray& ray, const PreparedRay& prepared, std::vector<RawCrossing>& raw,
                               const std::vector<ChordOfInstance>& chords, std::vector<ListedCrossing>& crossings) const
{
    crossings.clear();
    // Instance by instance, in the order in which the ray meets the crossings.
    std::sort(raw.begin(), raw.end(), [](const RawCrossing& a, const RawCrossing& b) {
        return std::tuple(a.slot, a.t_begin, a.t(), a.primitive) < std::tuple(b.slot, b.t_begin, b.t(), b.primitive);
    });
    std::vector<Crossing> of_instance;
    for (auto first = raw.begin(); first != raw.end();) {
        const Instance& instance = *instances[first->slot];
        const auto last =
            std::find_if(first, raw.end(), [&](const RawCrossing& each) { return each.slot != first->slot; });
        of_instance.clear();
        for (; first != last; ++first)
            of_instance.push_back(complete(*first, instance, ray, prepared));
        instance.object->settle_order(of_instance, ray, instance.placement);
        for (const Crossing& crossing : of_instance)
            crossings.push_back({crossing, false});
    }
    for (const ChordOfInstance& chord : chords)
        add_caps(chord, ray, prepared, crossings);

    // Then sort all by t, as in cast_rays(): see precedes(). Crossings of one instance at the same t stay together.
    for (std::size_t i = 1; i < crossings.size(); ++i) {
        const Hit &before = crossings[i - 1].crossing.hit, &hit = crossings[i].crossing.hit;
        if (hit.geometry_id == before.geometry_id && hit.t == before.t)
            crossings[i].sorts_as_cap = crossings[i - 1].sorts_as_cap;
    }
    std::stable_sort(crossings.begin(), crossings.end(), [](const ListedCrossing& a, const ListedCrossing& b) {
        const Hit &first = a.crossing.hit, &second = b.crossing.hit;
        if (first.t != second.t)
            return first.t < second.t;
        if (a.sorts_as_cap != b.sorts_as_cap)
            return b.sorts_as_cap;
        return a.sorts_as_cap ? first.geometry_id > second.geometry_id : first.geometry_id < second.geometry_id;
    });
}

void append_list(const std::vector<ListedCrossing>& of_ray, std::vector<Crossing>& crossings, std::uint32_t& count)
{
    if (of_ray.size() > std::numeric_limits<std::int32_t>::max())
        throw std::length_error("crossings of a ray: more than " +
                                std::to_string(std::numeric_limits<std::int32_t>::max()));
    for (const ListedCrossing& listed : of_ray)
        crossings.push_back(listed.crossing);
    count = static_cast<std::uint32_t>(of_ray.size());
}

void SceneSnapshot::list_intersections(std::span<const Ray> rays, std::vector<Crossing>& crossings,
                                       std::span<std::uint32_t> counts, bool coherent) const
{
    check_one_per_ray("counts", rays.size(), counts.size());
    if (coherent)
        return RayCaster(*this, RayCaster::Rays::coherent).list(rays, crossings, counts);
    RayQuery query(impl_->instances);
    std::vector<RawCrossing> raw;
    query.all = &raw;
    std::vector<ListedCrossing> of_ray;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        impl_->list(&SeenBy::camera, rays[i], i, query, of_ray);
        append_list(of_ray, crossings, counts[i]);
    }
}

} // namespace isospline
