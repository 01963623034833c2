#include "isospline/measure/components.h"

#include "catch.h"
#include "volumes.h"

#include "isospline/cell/coefficients.h"
#include "isospline/cell/value-inl.h"
#include "isospline/measure/component_measures.h"
#include "isospline/spline/degree.h"
#include "isospline/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

using namespace isospline;

namespace {

/// A solid with all that it refers to.
struct Subject {
    Subject(std::shared_ptr<const Volume> of, double level, double sign = 1.0, const Mask& mask = {})
        : volume(std::move(of)), ranges(*volume),
          unmasked(mask, *volume), solid{*volume, ranges, level - volume->offset(), sign, unmasked, {}}
    {
    }

    /// The component of each cell, -1 where it has none, by place.
    static std::vector<std::ptrdiff_t> labels(const Components& components, const glm::ivec3& shape)
    {
        std::vector<std::ptrdiff_t> labels(static_cast<std::size_t>(place_count(shape)), -1);
        const glm::ivec3 bricks = brick_shape(shape);
        for (std::size_t i = 0; i < place_count(bricks); ++i) {
            const Brick brick = brick_at(shape, at_place(bricks, i));
            for (std::size_t piece = components.first_piece(i); piece < components.first_piece(i + 1); ++piece)
                for_each_cell(components.pieces()[piece].cells, [&](int x, int y, int z) {
                    auto& label = labels[static_cast<std::size_t>(place_in(shape, brick.first + glm::ivec3(x, y, z)))];
                    REQUIRE(label == -1);
                    label = static_cast<std::ptrdiff_t>(components.pieces()[piece].component);
                });
        }
        return labels;
    }

    double value(const glm::ivec3& cell, const glm::dvec3& local) const
    {
        return dispatch_degree(volume->degree(), [&](auto degree) {
            return solid.sign * scalar::value_in_cell<degree>(VolumeCell(*volume, solid.threshold, cell), local);
        });
    }

    std::shared_ptr<const Volume> volume;
    BrickRanges ranges;
    CellSet unmasked;
    Solid solid;
};

/// Balls: f is the distance to their nearest centre, less its radius, negated.
std::shared_ptr<const Volume> balls(const glm::ivec3& shape, const std::vector<glm::dvec4>& all, int degree)
{
    std::vector<float> samples;
    for (int z = 0; z < shape.z; ++z)
        for (int y = 0; y < shape.y; ++y)
            for (int x = 0; x < shape.x; ++x) {
                double most = -1e9;
                for (const glm::dvec4& ball : all)
                    most = std::max(most, ball.w - glm::length(glm::dvec3(x, y, z) - glm::dvec3(ball)));
                samples.push_back(static_cast<float>(most));
            }
    VolumeOptions options;
    options.degree = degree;
    return make_volume(samples, shape, options);
}

} // namespace

TEST_CASE("cells are connected if the solid passes through the face between them", "[measure]")
{
    for (const int degree : {1, 2, 3})
        for (const double sign : {1.0, -1.0}) {
            const glm::ivec3 samples{27, 18, 19};
            Mask mask(27 * 18 * 19, 1);
            for (std::size_t i = 0; i < mask.size(); i += 17)
                mask[i] = 0;
            const Subject subject(noise_volume(samples, degree), sign * 0.55, sign, mask);
            const glm::ivec3 shape = subject.volume->cell_shape();
            const Components components(subject.solid);
            const auto labels = Subject::labels(components, shape);
            REQUIRE(components.counts().size() > 10);
            constexpr int steps = 6;
            for (std::uint64_t i = 0; i < place_count(shape); ++i) {
                const glm::ivec3 cell = at_place(shape, i);
                const auto label = labels[static_cast<std::size_t>(i)];
                if (!subject.unmasked.contains(cell)) {
                    REQUIRE(label == -1);
                    continue;
                }
                for (int axis = 0; axis < 3; ++axis)
                    for (int at = 0; at < steps * steps; ++at) {
                        const int row = at / steps, column = at % steps;
                        glm::dvec3 local(1.0);
                        local[(axis + 1) % 3] = column / (steps - 1.0);
                        local[(axis + 2) % 3] = row / (steps - 1.0);
                        if (!(subject.value(cell, local) > 1e-9))
                            continue;
                        REQUIRE(label >= 0);
                        glm::ivec3 next = cell;
                        ++next[axis];
                        if (next[axis] < shape[axis] && subject.unmasked.contains(next))
                            REQUIRE(labels[static_cast<std::size_t>(place_in(shape, next))] == label);
                    }
            }
        }
}

TEST_CASE("counts and boxes of components do not depend on the number of threads", "[measure]")
{
    const Subject subject(noise_volume({40, 33, 25}, 2), 0.4);
    const glm::ivec3 shape = subject.volume->cell_shape();
    const Components components(subject.solid);
    const auto labels = Subject::labels(components, shape);
    std::vector<ComponentCount> counts(components.counts().size());
    for (std::uint64_t i = 0; i < place_count(shape); ++i)
        if (const auto label = labels[static_cast<std::size_t>(i)]; label >= 0) {
            const glm::dvec3 lower(at_place(shape, i));
            ++counts[static_cast<std::size_t>(label)].cells;
            counts[static_cast<std::size_t>(label)].box_lattice.extend(Box{lower, lower + 1.0});
        }
    for (std::size_t i = 0; i < counts.size(); ++i) {
        REQUIRE(counts[i].cells == components.counts()[i].cells);
        REQUIRE(components.counts()[i].inside <= counts[i].cells);
        REQUIRE(counts[i].box_lattice.lower == components.counts()[i].box_lattice.lower);
        REQUIRE(counts[i].box_lattice.upper == components.counts()[i].box_lattice.upper);
    }
    set_thread_count(1);
    const auto alone = Subject::labels(Components(subject.solid), shape);
    set_thread_count(0);
    REQUIRE(alone == labels);
}

TEST_CASE("the largest components are those of the largest volumes", "[measure]")
{
    for (const int degree : {1, 2, 3}) {
        const std::vector<glm::dvec4> all{
            {10, 10, 10, 5.2}, {30, 10, 10, 5.0}, {30, 30, 10, 0.8}, {10, 30, 12, 7.5}, {20, 20, 30, 5.1}};
        const Subject subject(balls({40, 40, 40}, all, degree), 0.0);
        const auto measured = measure_components(subject.solid, {});
        REQUIRE(measured.size() == 5);
        const double radii[] = {7.5, 5.2, 5.1, 5.0, 0.8};
        for (std::size_t i = 0; i < 4; ++i)
            REQUIRE(measured[i].integrals.value[0] ==
                    Approx(4.0 / 3.0 * std::numbers::pi * std::pow(radii[i], 3)).epsilon(0.03));
        const glm::ivec3 centers[] = {{10, 30, 12}, {10, 10, 10}, {20, 20, 30}, {30, 10, 10}, {30, 30, 10}};
        for (std::size_t count = 1; count <= 6; ++count) {
            const CellSet kept = largest_components(subject.solid, count);
            for (std::size_t i = 0; i < 5; ++i)
                REQUIRE(kept.contains(centers[i]) == (i < count));
        }
    }
}

TEST_CASE("a cancelled search for components throws", "[measure]")
{
    const Subject subject(noise_volume({30, 30, 30}, 2), 0.3);
    REQUIRE_THROWS_AS(Components(subject.solid, [](double) { return false; }), Cancelled);
    REQUIRE_THROWS_AS(largest_components(subject.solid, 2, [](double) { return false; }), Cancelled);
}
