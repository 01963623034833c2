#include "catch.h"

#include "noise_volume.h"

#include "isospline/math/affine.h"
#include "isospline/shell/isosurface.h"

#include <glm/geometric.hpp>

#include <limits>
#include <stdexcept>

using namespace isospline;

TEST_CASE("another level re-uses the bounds and gives the shell of a new surface", "[shell]")
{
    const auto volume = noise_volume({20, 12, 9}, 2);
    Isosurface surface(volume, 0.5);
    const auto bounds = surface.shared_bounds();
    const auto before = surface.snapshot();
    surface.set_level(-0.25);
    REQUIRE(surface.level() == -0.25);
    REQUIRE(surface.snapshot()->threshold() == -0.25 - volume->offset());
    REQUIRE(before->level() == 0.5);
    REQUIRE((before->shell().cells() == Isosurface(volume, 0.5).snapshot()->shell().cells()));
    REQUIRE(surface.shared_bounds() == bounds);
    REQUIRE((surface.snapshot()->shell().cells() == Isosurface(volume, -0.25).snapshot()->shell().cells()));
    REQUIRE((surface.snapshot()->shell().cells() == Isosurface(volume, -0.25, {}, bounds).snapshot()->shell().cells()));

    Isosurface copy = surface;
    copy.set_level(0.5);
    REQUIRE(copy.shared_bounds() == bounds);
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

TEST_CASE("what an isosurface is made of is checked", "[shell]")
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
