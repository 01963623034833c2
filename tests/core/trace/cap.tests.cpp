#include "catch.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/query/solid.h"
#include "isospline/trace/cap.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

using namespace isospline;

namespace {

const RayLimits no_limits{0.0, 1.0, 0.0, std::numeric_limits<double>::infinity()};

/// Noise, cut by a box and two oblique planes.
std::shared_ptr<const IsosurfaceSnapshot> cut_noise(int degree, bool capped, Inside inside = Inside::above)
{
    IsosurfaceOptions options;
    options.inside = inside;
    options.capped = capped;
    options.clip = half_spaces({{2.25, 3.0, 1.5}, {17.75, 19.0, 16.5}});
    options.clip.push_back({{0.6, -0.3, 0.4}, 3.0});
    options.clip.push_back({{-1.0, -2.0, 0.5}, -38.0});
    return Isosurface(noise_volume({20, 22, 18}, degree), 0.1, options).snapshot();
}

/// A ray in lattice space that is cut by a surface's clip.
std::optional<CappedChord> random_chord(const IsosurfaceSnapshot& surface, const CapBoxes& caps, std::mt19937& random)
{
    std::uniform_real_distribution<double> place(-2.0, 24.0), direction(-1.0, 1.0);
    const Ray ray{{place(random), place(random), place(random)},
                  {direction(random), direction(random), direction(random)},
                  0.0,
                  100.0};
    const std::optional<Chord> kept = clip(ray, surface.clip_lattice());
    return kept ? std::optional(CappedChord(*kept, ray.origin, ray.direction, no_limits, caps)) : std::nullopt;
}

} // namespace

TEST_CASE("ends of chords are on caps if the points next to them are in the solid", "[trace]")
{
    for (int degree = 1; degree <= 3; ++degree)
        for (const Inside inside : {Inside::above, Inside::below}) {
            const auto snapshot = cut_noise(degree, true, inside);
            const IsosurfaceSnapshot& surface = *snapshot;
            const glm::dmat4 to_world = surface.volume().lattice_to_world();
            const auto is_inside = [&](const CappedChord& chord, double t) {
                return contains(surface, transform_point(to_world, chord.at(t)));
            };
            std::mt19937 random(static_cast<unsigned>(degree));
            const CapBoxes caps = cap_boxes(surface);
            int entries = 0, exits = 0, open = 0;
            for (int trial = 0; trial < 4000; ++trial) {
                const auto chord = random_chord(surface, caps, random);
                if (!chord || chord->t_far - chord->t_near < 1e-3)
                    continue;
                const bool entry = chord->entry >= 0 && is_inside(*chord, chord->t_near + 1e-9);
                const bool exit = chord->exit >= 0 && is_inside(*chord, chord->t_far - 1e-9);
                REQUIRE(chord->enters_cap(surface) == entry);
                REQUIRE(chord->leaves_cap(surface) == exit);
                // What f says is not for the crossings to change.
                for (const bool crossing : {false, true}) {
                    const CappedEnds ends = chord->capped_ends(surface, crossing, crossing);
                    REQUIRE(ends.entry == entry);
                    REQUIRE(ends.exit == exit);
                }
                entries += entry;
                exits += exit;
                open += !entry && !exit;
            }
            REQUIRE(std::min({entries, exits, open}) > 100);
        }
}

TEST_CASE("an end on the surface itself is decided by the crossing next to it", "[trace]")
{
    // f = x, and chords that begin or end where it is 4.
    std::vector<float> samples;
    for (int i = 0; i < 8 * 8 * 8; ++i)
        samples.push_back(static_cast<float>(i % 8));
    VolumeOptions linear;
    linear.degree = 1;
    const auto volume = make_volume(samples, {8, 8, 8}, linear);
    IsosurfaceOptions options;
    options.capped = true;
    options.clip = {{{0.0, 0.0, 1.0}, 2.0}, {{0.0, 0.0, -1.0}, -5.0}};
    const auto snapshot = Isosurface(volume, 4.0, options).snapshot();
    const IsosurfaceSnapshot& surface = *snapshot;
    const CapBoxes caps = cap_boxes(surface);
    const auto chord_of = [&](const glm::dvec3& from, const glm::dvec3& to) {
        const Ray ray{from, to - from, 0.0, 100.0};
        return CappedChord(*clip(ray, surface.clip_lattice()), ray.origin, ray.direction, no_limits, caps);
    };
    const auto on_the_way_in = chord_of({4.0, 3.0, 1.0}, {4.0, 3.0, 3.0});
    REQUIRE(on_the_way_in.enters_cap(surface));
    REQUIRE(!on_the_way_in.capped_ends(surface, true, true).entry);
    REQUIRE(on_the_way_in.capped_ends(surface, false, false).entry);
    REQUIRE(!on_the_way_in.capped_ends(surface, false, false).exit);
    REQUIRE(on_the_way_in.capped_ends(surface, true, true).exit);
    // Both ends on it, and nothing in between: they are the same.
    const CappedEnds both = on_the_way_in.capped_ends(surface, {}, {});
    REQUIRE(both.entry == both.exit);
    // One end on it, and nothing in between: it is as the other.
    for (const double side : {-1.0, 1.0}) {
        const CappedEnds ends =
            chord_of({4.0 - side, 3.0, 1.0}, {4.0, 3.0, 2.0}).capped_ends(surface, std::nullopt, std::nullopt);
        REQUIRE(ends.entry == ends.exit);
        REQUIRE(ends.exit == (side > 0.0));
    }
}

TEST_CASE("boxes hold all caps, and lie on their planes", "[trace]")
{
    REQUIRE(cap_boxes(*cut_noise(2, false)).boxes.empty());
    for (int degree = 1; degree <= 3; ++degree) {
        const auto snapshot = cut_noise(degree, true);
        const IsosurfaceSnapshot& surface = *snapshot;
        const CapBoxes caps = cap_boxes(surface);
        const std::vector<Box>& boxes = caps.boxes;
        std::mt19937 random(static_cast<unsigned>(degree));
        int count = 0;
        for (int trial = 0; trial < 4000; ++trial) {
            const auto chord = random_chord(surface, caps, random);
            if (!chord)
                continue;
            for (const bool at_entry : {true, false}) {
                if (!(at_entry ? chord->enters_cap(surface) : chord->leaves_cap(surface)))
                    continue;
                ++count;
                const glm::dvec3 position = chord->at(at_entry ? chord->t_near : chord->t_far);
                REQUIRE(std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) {
                    return glm::clamp(position, box.lower - 1e-9, box.upper + 1e-9) == position;
                }));
            }
        }
        REQUIRE(count > 500);
        for (const Box& box : boxes)
            for (const HalfSpace& half_space : surface.clip_lattice()) {
                const glm::dvec3 most = glm::max(half_space.normal * box.lower, half_space.normal * box.upper);
                REQUIRE(most.x + most.y + most.z >= half_space.offset - 1e-5);
            }
    }
}

TEST_CASE("primitive ids of caps follow those of cells", "[trace]")
{
    const auto snapshot = cut_noise(2, true);
    const IsosurfaceSnapshot& surface = *snapshot;
    const std::uint64_t cells = surface.volume().cell_count();
    REQUIRE(!surface.is_cap(cells - 1));
    REQUIRE(surface.is_cap(cells));
    REQUIRE(surface.primitive_count() == cells + 8);
    REQUIRE(cut_noise(2, false)->primitive_count() == cells);
}
