#include "catch.h"

#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/shell/isosurface.h"

#include <glm/geometric.hpp>

#include <limits>
#include <stdexcept>

using namespace isospline;

TEST_CASE("another level reuses the ranges of bricks and gives the shell of a new surface", "[shell]")
{
    const auto volume = noise_volume({20, 12, 9}, 2);
    Isosurface surface(volume, 0.5);
    const auto ranges = surface.shared_ranges();
    const auto before = surface.snapshot();
    surface.set_level(-0.25);
    REQUIRE(surface.level() == -0.25);
    REQUIRE(surface.snapshot()->threshold() == -0.25 - volume->offset());
    REQUIRE(before->level() == 0.5);
    REQUIRE((before->shell().cells() == Isosurface(volume, 0.5).snapshot()->shell().cells()));
    REQUIRE(surface.shared_ranges() == ranges);
    REQUIRE((surface.snapshot()->shell().cells() == Isosurface(volume, -0.25).snapshot()->shell().cells()));
    REQUIRE((surface.snapshot()->shell().cells() == Isosurface(volume, -0.25, {}, ranges).snapshot()->shell().cells()));

    Isosurface copy = surface;
    copy.set_level(0.5);
    REQUIRE(copy.shared_ranges() == ranges);
    IsosurfaceOptions options;
    options.clip = {{{0.0, 0.0, 1.0}, 2.0}};
    REQUIRE(Isosurface(volume, 0.1, options).shared_ranges() == ranges);
    REQUIRE((copy.snapshot()->shell().cells() == Isosurface(volume, 0.5).snapshot()->shell().cells()));
    REQUIRE(surface.level() == -0.25);
}

TEST_CASE("a level that throws or is cancelled changes nothing", "[shell]")
{
    Isosurface surface(noise_volume({20, 12, 9}, 2), 0.5);
    const auto before = surface.snapshot();
    REQUIRE_THROWS_AS(surface.set_level(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
    REQUIRE_THROWS_AS(surface.set_level(0.0, [](double) { return false; }), Cancelled);
    REQUIRE(surface.level() == 0.5);
    REQUIRE(surface.snapshot() == before);
}

TEST_CASE("the first surface of a volume and its bounds can be cancelled at any time, and nothing is kept", "[shell]")
{
    const auto volume = noise_volume({70, 40, 40}, 2);
    double last = 0.0;
    const auto surface = Isosurface(volume, 0.5, {}, nullptr, [&](double fraction) {
        REQUIRE(fraction >= last);
        last = fraction;
        return true;
    });
    REQUIRE(last == 1.0);
    for (const double limit : {0.0, 0.4, 0.85, 0.95}) {
        const auto fresh = noise_volume({70, 40, 40}, 2);
        const auto make = [&] { return Isosurface(fresh, 0.5, {}, nullptr, [=](double f) { return f < limit; }); };
        REQUIRE_THROWS_AS(make(), Cancelled);
    }
    const auto snapshot = surface.snapshot();
    const auto never = [](double) { return false; };
    REQUIRE_THROWS_AS(snapshot->bounds_lattice(never), Cancelled);
    REQUIRE_THROWS_AS(snapshot->is_empty(never), Cancelled);
    REQUIRE_THROWS_AS(snapshot->shell(never), Cancelled);
    REQUIRE_FALSE(snapshot->bounds_lattice().empty());
    REQUIRE_FALSE(snapshot->is_empty());
    REQUIRE(snapshot->shell().count() > 0);
}

TEST_CASE("the clip is given in world space and kept in lattice space", "[shell]")
{
    VolumeOptions options;
    options.spacing = {0.5, 2.0, 3.0};
    options.origin = {10.0, 20.0, 30.0};
    const auto volume = noise_volume({16, 16, 16}, options);
    IsosurfaceOptions cut;
    cut.clip = half_spaces({{12.0, -1e9, -1e9}, {1e9, 1e9, 1e9}});
    const auto snapshot = Isosurface(volume, 0.0, cut).snapshot();
    const IsosurfaceSnapshot& surface = *snapshot;

    const HalfSpace& side = surface.clip_lattice().front();
    REQUIRE(glm::length(side.normal) == Approx(1.0));
    const glm::dvec3 on_plane = transform_point(volume->world_to_lattice(), {12.0, 25.0, 40.0});
    REQUIRE(glm::dot(side.normal, on_plane) == Approx(side.offset));

    // x = 12 is index 4 and lattice coordinate 4.5: in cell 4.
    for (const Cell& cell : surface.shell().cells())
        REQUIRE(cell.x >= 4);
    REQUIRE(surface.shell().count() < Isosurface(volume, 0.0).snapshot()->shell().count());
}

TEST_CASE("whether a surface is empty, and its bounds, are those of its shell", "[shell]")
{
    Mask mask(33 * 20 * 27, 1);
    for (int i = 0; i < 33 * 20 * 14; ++i)
        mask[static_cast<std::size_t>(i)] = 0;
    const Mask nothing(mask.size(), 0);
    const std::vector<HalfSpace> half{{{1.0, 0.3, 0.2}, 20.0}}, outside{{{1.0, 0.0, 0.0}, 100.0}};
    std::size_t empty = 0, full = 0, pruned_empty = 0;
    for (int degree = 1; degree <= 3; ++degree) {
        const auto volume = noise_volume({33, 20, 27}, degree);
        for (const Mask& cut : {Mask(), mask, nothing})
            for (const auto& clip : {std::vector<HalfSpace>(), half, outside})
                for (const int depth : {0, 2, 4})
                    for (const double level : {0.0, 1.2, 2.0, 2.3, -2.1, 1e3}) {
                        IsosurfaceOptions options;
                        options.shell = {.prune_depth = depth, .prune_border = true, .mask = cut};
                        options.clip = clip;
                        const auto surface = Isosurface(volume, level, options).snapshot();
                        const auto asked_later = Isosurface(volume, level, options).snapshot();
                        Box expected;
                        for (const Cell& cell : asked_later->shell().cells()) {
                            const glm::dvec3 lower(cell.x, cell.y, cell.z);
                            expected.extend(Box{lower, lower + 1.0});
                        }
                        for (const auto& asked : {surface, asked_later, surface}) {
                            REQUIRE(asked->is_empty() == expected.empty());
                            REQUIRE(asked->bounds_lattice().empty() == expected.empty());
                            if (expected.empty())
                                continue;
                            REQUIRE(asked->bounds_lattice().lower == expected.lower);
                            REQUIRE(asked->bounds_lattice().upper == expected.upper);
                        }
                        ++(expected.empty() ? empty : full);
                        pruned_empty += expected.empty() && surface->bricks().count() > 0;
                    }
    }
    REQUIRE(empty > 50);
    REQUIRE(full > 50);
    REQUIRE(pruned_empty > 5);
}

TEST_CASE("memory grows with the requested data", "[shell]")
{
    const auto surface = Isosurface(noise_volume({33, 20, 27}, 2), 0.1).snapshot();
    const std::size_t before = surface->memory();
    REQUIRE(before >= surface->shared_ranges()->memory() + surface->bricks().memory());
    REQUIRE_FALSE(surface->is_empty());
    surface->bounds_lattice();
    REQUIRE(surface->memory() == before);
    const std::size_t shell = surface->shell().memory();
    REQUIRE(shell >= surface->shell().count() * sizeof(Cell));
    REQUIRE(surface->memory() == before + shell);
}

TEST_CASE("the arguments of an isosurface are checked", "[shell]")
{
    const auto volume = noise_volume({4, 5, 6}, 2);
    REQUIRE_THROWS_AS(Isosurface(nullptr, 0.0), std::invalid_argument);
    REQUIRE_THROWS_AS(Isosurface(volume, std::numeric_limits<double>::infinity()), std::invalid_argument);
    for (const int degree : {0, 4, 5})
        REQUIRE_THROWS_AS(Isosurface(noise_volume({4, 5, 6}, degree), 0.0), std::invalid_argument);
    for (const int degree : {1, 3})
        REQUIRE_THROWS_AS(Isosurface(noise_volume({4, 1, 6}, degree), 0.0), std::invalid_argument);
    REQUIRE_NOTHROW(Isosurface(noise_volume({4, 1, 6}, 2), 0.0));
    REQUIRE_THROWS_AS(Isosurface(noise_volume({65536, 1, 1}, 2), 0.0), std::invalid_argument);
    REQUIRE_NOTHROW(Isosurface(noise_volume({65535, 1, 1}, 2), 0.0));

    for (const int depth : {-1, 7}) {
        IsosurfaceOptions bad_depth;
        bad_depth.shell.prune_depth = depth;
        REQUIRE_THROWS_AS(Isosurface(volume, 0.0, bad_depth), std::invalid_argument);
    }

    IsosurfaceOptions short_mask;
    short_mask.shell.mask.assign(4 * 5 * 6 - 1, 1);
    REQUIRE_THROWS_AS(Isosurface(volume, 0.0, short_mask), std::invalid_argument);

    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const auto& half_space :
         {HalfSpace{{0.0, 0.0, 0.0}, 1.0}, HalfSpace{{nan, 0.0, 1.0}, 1.0}, HalfSpace{{0.0, 0.0, 1.0}, nan}}) {
        IsosurfaceOptions bad_clip;
        bad_clip.clip = {half_space};
        REQUIRE_THROWS_AS(Isosurface(volume, 0.0, bad_clip), std::invalid_argument);
    }
}
