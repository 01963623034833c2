// Rays in bricks, compared with walks over all cells that do not use bricks and slabs.
#include "isospline/trace/brick_trace.h"

#include "each_target.h"
#include "level_bricks.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/cell/intersector.h"
#include "isospline/math/grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <vector>

using namespace isospline;

namespace {

constexpr float margin = 0x1p-10f;

/// A root of a ray, and the place of its cell in the lattice.
struct Root {
    double t = std::numeric_limits<double>::infinity();
    std::uint64_t cell = std::numeric_limits<std::uint64_t>::max();

    bool precedes(const Root& other) const { return t != other.t ? t < other.t : cell < other.cell; }
};

/// A level, rays, and all that these find in the cells of it that have coefficients of both signs.
struct Subject {
    Subject(std::shared_ptr<const Volume> volume, double threshold, std::size_t ray_count,
            std::vector<HalfSpace> clip_lattice = {})
        : level(std::move(volume), threshold, {}, std::move(clip_lattice)), shape(level.volume->cell_shape()),
          is_in_question(place_count(shape))
    {
        for (const Octet& octet : level.bricks.octets())
            for (int child = 0; child < 8; ++child) {
                if ((octet.bricks >> child & 1) == 0)
                    continue;
                const Brick brick = level.bricks.place(octet, child);
                for_each_cell(level.bricks.cells(brick), [&](int x, int y, int z) {
                    is_in_question[place_in(shape, brick.first + glm::ivec3(x, y, z))] = true;
                });
            }
        make_rays(ray_count);
        find_roots();
    }

    /// Packets of rays of many kinds, then packets whose rays run side by side, every other one about an axis, so
    /// that the signs of their directions differ. Every third ray has limits.
    void make_rays(std::size_t count)
    {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        Ray middle;
        while (rays.size() < count) {
            Ray ray = random_lattice_ray(random, shape);
            const std::size_t packet = rays.size() / packet_capacity, lane = rays.size() % packet_capacity;
            if (packet % 2 != 0) {
                if (lane == 0) {
                    middle = ray;
                    if (packet % 4 == 3) {
                        const glm::dvec3 target = ray.at(2.0);
                        middle.direction = glm::dvec3(0.0);
                        middle.direction[static_cast<int>(packet / 4 % 3)] = packet % 8 == 3 ? 2.0 : -2.0;
                        middle.origin = target - 10.0 * middle.direction;
                    }
                }
                ray = middle;
                ray.direction += 0.02 * glm::length(middle.direction) *
                                 glm::dvec3(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
            }
            if (rays.size() % 3 == 2) {
                ray.t_near = 2.0 * unit(random);
                ray.t_far = ray.t_near + 2.0 * unit(random);
            }
            rays.emplace_back(ray, shape);
        }
    }

    void find_roots()
    {
        const auto first_root = cell_intersector(level.volume->degree(), Method::reference).first_root;
        roots.assign(rays.size(), {});
        met_count = root_count = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            for (std::uint64_t place = 0; place < is_in_question.size(); ++place) {
                if (!is_in_question[place])
                    continue;
                const glm::ivec3 cell = at_place(shape, place);
                const Interval inside = rays[i].inside_cell(glm::dvec3(cell));
                if (!(inside.t_near < inside.t_far))
                    continue;
                ++met_count;
                const VolumeCell coefficients(*level.volume, level.bricks.threshold(), cell);
                if (const auto root = first_root(coefficients, rays[i]))
                    roots[i].push_back({root->t, place});
            }
            std::sort(roots[i].begin(), roots[i].end(), [](const Root& a, const Root& b) { return a.precedes(b); });
            root_count += roots[i].size();
        }
    }

    Root nearest(std::size_t ray) const { return roots[ray].empty() ? Root() : roots[ray].front(); }

    /// Whether a ray meets a cell within its limits, up to twice the margin that cubes have.
    bool meets(const LatticeRay& ray, const glm::ivec3& cell) const
    {
        const double room = 2.0 * static_cast<double>(margin);
        const Ray limited{ray.origin, ray.direction, ray.t_near, ray.t_far};
        return clip(limited, Box{glm::dvec3(cell) - room, glm::dvec3(cell) + 1.0 + room}).has_value();
    }

    LevelBricks level;
    glm::ivec3 shape;
    std::vector<bool> is_in_question; ///< by a cell's place
    std::vector<LatticeRay> rays;
    std::vector<std::vector<Root>> roots; ///< of each ray, the nearest first
    std::size_t met_count = 0, root_count = 0;
};

/// What one ray visits, or one lane of a packet.
struct Visits {
    const Subject* subject;
    std::size_t ray;
    std::vector<std::uint64_t> cells;
    std::size_t wrong =
        0; ///< visits of cells that are not in question, that the ray misses, or with other coefficients

    void add(const CellCoefficients& cell, const glm::ivec3& index)
    {
        const LevelBricks& level = subject->level;
        cells.push_back(place_in(subject->shape, index));
        const bool is_right = subject->is_in_question.at(cells.back()) && subject->meets(subject->rays[ray], index) &&
                              cell.lower == glm::dvec3(index) && cell.threshold == level.bricks.threshold() &&
                              cell.first == level.volume->cell_coefficients(index.x, index.y, index.z);
        wrong += !is_right;
    }

    void add(const CandidateCells& candidates, int lane)
    {
        const LevelBricks& level = subject->level;
        const glm::ivec3 index = candidates.lower_of(lane);
        cells.push_back(place_in(subject->shape, index));
        bool is_right = subject->is_in_question.at(cells.back()) && subject->meets(subject->rays[ray], index);
        const float* const first = level.volume->cell_coefficients(index.x, index.y, index.z);
        const int n = level.volume->degree();
        const float(*copy)[CandidateCells::capacity] = candidates.coefficients;
        if (!candidates.are_copied)
            is_right = is_right && candidates.only.first == first;
        else
            for (int k = 0; k <= n; ++k)
                for (int j = 0; j <= n; ++j)
                    for (int i = 0; i <= n; ++i)
                        is_right = is_right &&
                                   (*copy++)[lane] ==
                                       first[i + j * level.volume->row_stride() + k * level.volume->slice_stride()];
        wrong += !is_right;
    }

    /// Each cell once, and all that have a root.
    void check()
    {
        REQUIRE(wrong == 0);
        std::sort(cells.begin(), cells.end());
        REQUIRE(std::adjacent_find(cells.begin(), cells.end()) == cells.end());
        REQUIRE(std::all_of(subject->roots[ray].begin(), subject->roots[ray].end(), [&](const Root& root) {
            return std::binary_search(cells.begin(), cells.end(), root.cell);
        }));
    }
};

/// Visits all cells, whatever is in them. Returns how many cells were visited.
std::size_t check_visits(const Subject& subject, const BrickTracer& tracer, const std::vector<ShellBox>& boxes)
{
    std::size_t count = 0;
    for (std::size_t i = 0; i < subject.rays.size(); ++i) {
        Visits visits{&subject, i, {}, 0};
        const auto visit = [](void* context, const CellCoefficients& cell, const glm::ivec3& index) {
            Visits& of = *static_cast<Visits*>(context);
            of.add(cell, index);
            return of.subject->rays[of.ray].t_far;
        };
        for (const ShellBox& box : boxes)
            tracer.trace(subject.level.bricks, box, subject.rays[i], margin, subject.rays[i].t_far, {visit, &visits});
        visits.check();
        count += visits.cells.size();
    }
    return count;
}

/// As a query does, keeps the nearest root and looks at nothing behind it.
void check_nearest(const Subject& subject, const BrickTracer& tracer, const std::vector<ShellBox>& boxes)
{
    struct Nearest {
        const Subject& subject;
        const LatticeRay& ray;
        CellIntersector intersector;
        Root root;
    };
    const CellIntersector intersector = cell_intersector(subject.level.volume->degree(), Method::exact);
    for (std::size_t i = 0; i < subject.rays.size(); ++i) {
        Nearest nearest{subject, subject.rays[i], intersector, {}};
        const auto visit = [](void* context, const CellCoefficients& cell, const glm::ivec3& index) {
            Nearest& of = *static_cast<Nearest*>(context);
            if (const auto found = of.intersector.first_root(cell, of.ray))
                if (const Root root{found->t, place_in(of.subject.shape, index)}; root.precedes(of.root))
                    of.root = root;
            return std::min(of.root.t, of.ray.t_far);
        };
        for (const ShellBox& box : boxes)
            tracer.trace(subject.level.bricks, box, nearest.ray, margin, std::min(nearest.root.t, nearest.ray.t_far),
                         {visit, &nearest});
        REQUIRE(nearest.root.t == subject.nearest(i).t);
        REQUIRE(nearest.root.cell == subject.nearest(i).cell);
    }
}

/// A packet of the rays from `first` on, of which some may be missing or not active.
struct Packet {
    Packet(const Subject& of, std::size_t first_ray, std::mt19937& random) : subject(of), first(first_ray)
    {
        for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane)
            if (first + static_cast<std::size_t>(lane) < subject.rays.size())
                rays.set(lane, ray(lane)), active |= LaneMask{1} << lane;
        if (first / packet_capacity % 3 == 2)
            active &= static_cast<LaneMask>(random());
        for (int lane = 0; lane < LatticeRayPacket::capacity; ++lane)
            t_limit[lane] = rays.t_far[lane];
    }

    const LatticeRay& ray(int lane) const { return subject.rays[first + static_cast<std::size_t>(lane)]; }

    const Subject& subject;
    std::size_t first;
    LatticeRayPacket rays;
    LaneMask active = 0;
    alignas(64) double t_limit[LatticeRayPacket::capacity];
};

template <typename Do>
void for_each_lane(LaneMask lanes, const Do& use)
{
    for (; lanes != 0; lanes &= lanes - 1u)
        use(std::countr_zero(lanes));
}

std::size_t check_packet_visits(const Subject& subject, const BrickTracer& tracer, const std::vector<ShellBox>& boxes)
{
    struct Visit {
        LaneMask active;
        std::vector<Visits> of_lane;
    };
    std::size_t count = 0;
    std::mt19937 random(11);
    for (std::size_t first = 0; first < subject.rays.size(); first += packet_capacity) {
        const Packet packet(subject, first, random);
        Visit context{packet.active, {}};
        for (std::size_t lane = 0; lane < packet_capacity; ++lane)
            context.of_lane.push_back({&subject, first + lane, {}, 0});
        const auto visit = [](void* of, const CandidateCells& cells) {
            auto& now = *static_cast<Visit*>(of);
            REQUIRE(cells.lanes != 0);
            REQUIRE((cells.lanes & ~now.active) == 0);
            for_each_lane(cells.lanes, [&](int lane) {
                Visits& visits = now.of_lane[static_cast<std::size_t>(lane)];
                visits.add(cells, lane);
            });
            return false;
        };
        for (const ShellBox& box : boxes)
            tracer.trace_packet(subject.level.bricks, box, packet.rays, margin, packet.active,
                                {visit, &context, packet.t_limit});
        for_each_lane(packet.active, [&](int lane) {
            Visits& visits = context.of_lane[static_cast<std::size_t>(lane)];
            visits.check();
            count += visits.cells.size();
        });
    }
    return count;
}

void check_packet_nearest(const Subject& subject, const BrickTracer& tracer, const std::vector<ShellBox>& boxes)
{
    struct Nearest {
        Packet packet;
        CellIntersector intersector;
        Root roots[LatticeRayPacket::capacity];
    };
    const CellIntersector intersector = cell_intersector(subject.level.volume->degree(), Method::exact);
    std::mt19937 random(13);
    for (std::size_t first = 0; first < subject.rays.size(); first += packet_capacity) {
        Nearest nearest{Packet(subject, first, random), intersector, {}};
        const auto visit = [](void* context, const CandidateCells& cells) {
            auto& found_before = *static_cast<Nearest*>(context);
            Packet& packet = found_before.packet;
            RootPacket found;
            const LaneMask with_root = found_before.intersector.first_roots(
                cells, packet.subject.level.bricks.threshold(), packet.rays, packet.t_limit, found);
            for_each_lane(with_root, [&](int lane) {
                Root& nearest_root = found_before.roots[lane];
                const Root root{found.t[lane], place_in(packet.subject.shape, cells.lower_of(lane))};
                if (root.precedes(nearest_root)) {
                    nearest_root = root;
                    packet.t_limit[lane] = root.t;
                }
            });
            return with_root != 0;
        };
        for (const ShellBox& box : boxes)
            tracer.trace_packet(subject.level.bricks, box, nearest.packet.rays, margin, nearest.packet.active,
                                {visit, &nearest, nearest.packet.t_limit});
        for_each_lane(nearest.packet.active, [&](int lane) {
            const Root expected = subject.nearest(first + static_cast<std::size_t>(lane));
            REQUIRE(nearest.roots[lane].t == expected.t);
            REQUIRE(nearest.roots[lane].cell == expected.cell);
        });
    }
}

/// Sheets and blobs with a little noise, all of some cells' width.
std::shared_ptr<const Volume> wavy_volume(const glm::ivec3& shape, int degree)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> noise(-0.05, 0.05);
    VolumeOptions options;
    options.degree = degree;
    const auto sample = [&](int x, int y, int z) {
        return std::sin(0.31 * x) * std::cos(0.23 * y) + std::sin(0.27 * y) * std::cos(0.37 * z) +
               std::sin(0.19 * z) * std::cos(0.29 * x) + noise(random);
    };
    return sampled_volume(sample, shape, options);
}

/// All ways to trace. Returns how many cells a ray and its lane visit in all.
std::size_t check_all(Subject& subject)
{
    REQUIRE(subject.root_count > subject.rays.size() / 4);
    std::size_t visits = 0;
    for_each_target([&] {
        subject.find_roots(); // of which the last bit is the target's own
        const BrickTracer tracer = brick_tracer();
        const std::vector<ShellBox> boxes = shell_boxes(subject.level.bricks);
        const std::size_t alone = check_visits(subject, tracer, boxes);
        const std::size_t together = check_packet_visits(subject, tracer, boxes);
        visits = std::max(visits, std::max(alone, together));
        check_nearest(subject, tracer, boxes);
        check_packet_nearest(subject, tracer, boxes);
    });
    return visits;
}

} // namespace

TEST_CASE("rays visit all cells of noise in which they have a root", "[trace][slow]")
{
    const int degree = GENERATE(1, 2, 3);
    Subject subject(noise_volume({19, 10, 21}, degree), 0.3, 240);
    check_all(subject);
}

TEST_CASE("rays visit all cells of smooth surfaces in which they have a root, and few others", "[trace][slow]")
{
    const int degree = GENERATE(1, 2, 3);
    Subject subject(wavy_volume({37, 22, 30}, degree), 0.4, 240);
    const std::size_t visits = check_all(subject);
    // Slabs leave less of the cells that rays meet.
    CHECK(visits < 3 * subject.met_count / 4);
}

TEST_CASE("rays visit the cells that a clip keeps", "[trace][slow]")
{
    const auto volume = wavy_volume({37, 22, 30}, 2);
    const std::vector<HalfSpace> clip_lattice{{glm::normalize(glm::dvec3(1.0, 2.0, -0.5)), 12.0},
                                              {{0.0, 0.0, -1.0}, -20.0}};
    Subject subject(volume, 0.4, 240, clip_lattice);
    REQUIRE(subject.level.bricks.count() < LevelBricks(volume, 0.4).bricks.count());
    check_all(subject);
}

TEST_CASE("rays along a volume of the most cells along an axis visit all cells in which they have a root", "[trace]")
{
    // Cells whose indices need all of 16 bits.
    Subject subject(noise_volume({65535, 2, 3}, 2), 0.3, 0);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int i = 0; i < 64; ++i) {
        const glm::dvec3 target(65535.0 - 20.0 * unit(random), 2.0 * unit(random), 3.0 * unit(random));
        const glm::dvec3 origin =
            target + 30.0 * glm::dvec3(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
        subject.rays.emplace_back(Ray{origin, target - origin}, subject.shape);
    }
    subject.find_roots();
    REQUIRE(subject.root_count > 16);
    const BrickTracer tracer = brick_tracer();
    const std::vector<ShellBox> boxes = shell_boxes(subject.level.bricks);
    check_visits(subject, tracer, boxes);
    check_packet_visits(subject, tracer, boxes);
}

TEST_CASE("boxes hold each cell in question once", "[trace]")
{
    const LevelBricks level(wavy_volume({37, 22, 30}, 2), 0.4);
    const glm::ivec3 shape = level.volume->cell_shape();
    std::vector<int> held(place_count(shape));
    for (const ShellBox& box : shell_boxes(level.bricks)) {
        const Box bounds = bounds_of(level.bricks, box);
        const glm::ivec3 first(bounds.lower), size = glm::ivec3(bounds.upper) - first;
        REQUIRE(glm::dvec3(first) == bounds.lower);
        REQUIRE(std::max({size.x, size.y, size.z}) <= 2 * brick_size);
        for (int z = 0; z < size.z; ++z)
            for (int y = 0; y < size.y; ++y)
                for (int x = 0; x < size.x; ++x)
                    ++held.at(place_in(shape, first + glm::ivec3(x, y, z)));
    }
    REQUIRE(*std::max_element(held.begin(), held.end()) == 1);
    // Boxes are cut to blocks in question, which may leave out cells that no ray crosses.
    for (const Octet& octet : level.bricks.octets())
        for (int child = 0; child < 8; ++child)
            if ((octet.bricks >> child & 1) != 0) {
                const Brick brick = level.bricks.place(octet, child);
                const std::uint64_t blocks = level.bricks.blocks_in_question(octet, child);
                for_each_cell(level.bricks.cells(brick), [&](int x, int y, int z) {
                    if ((blocks >> (x / 2 + 4 * (y / 2) + 16 * (z / 2)) & 1u) != 0)
                        REQUIRE(held[place_in(shape, brick.first + glm::ivec3(x, y, z))] == 1);
                });
            }
}
