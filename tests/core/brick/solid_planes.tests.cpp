#include "catch.h"
#include "volumes.h"

#include "isospline/brick/solid_planes.h"
#include "isospline/math/affine.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <cmath>
#include <random>
#include <vector>

using namespace isospline;

namespace {

/// A volume with the numbers of a CT's header: spacings with two decimals, origins with one.
VolumeOptions random_options(std::mt19937& random, int degree, bool oblique)
{
    std::uniform_real_distribution<double> spacing(0.1, 3.0), origin(-200.0, 200.0), unit(-1.0, 1.0);
    VolumeOptions options;
    options.degree = degree;
    for (int axis = 0; axis < 3; ++axis) {
        options.spacing[axis] = std::round(spacing(random) * 100.0) / 100.0;
        options.origin[axis] = std::round(origin(random) * 10.0) / 10.0;
    }
    if (oblique)
        options.direction = glm::dmat3(glm::rotate(glm::dmat4(1.0), 3.0 * unit(random),
                                                   glm::normalize(glm::dvec3(unit(random), unit(random), 1.5))));
    return options;
}

Volume full_volume(const glm::ivec3& shape, const VolumeOptions& options)
{
    const float one = 1.0f;
    return Volume(SampleView{&one, SampleType::float32, shape, {0, 0, 0}}, options);
}

/// The side of a box as a half-space of world space, from points that are computed there.
HalfSpace half_space_in_world(const Volume& volume, int axis, double place, bool is_upper)
{
    const glm::dmat4& map = volume.lattice_to_world();
    glm::dvec3 at(0.0), next(0.0), third(0.0);
    at[axis] = next[axis] = third[axis] = place;
    next[(axis + 1) % 3] = 1.0;
    third[(axis + 2) % 3] = 1.0;
    const glm::dvec3 point = transform_point(map, at);
    glm::dvec3 normal = glm::cross(transform_point(map, next) - point, transform_point(map, third) - point);
    glm::dvec3 inwards(0.0);
    inwards[axis] = is_upper ? -1.0 : 1.0;
    if (glm::dot(normal, transform_vector(map, inwards)) < 0.0)
        normal = -normal;
    return {normal, glm::dot(normal, point)};
}

} // namespace

TEST_CASE("a plane within its rounding of a face of cells is the face", "[brick]")
{
    std::mt19937 random(5);
    for (int trial = 0; trial < 3000; ++trial) {
        const glm::ivec3 shape(3 + trial % 37, 4 + trial % 29, 5 + trial % 31);
        const Volume volume = full_volume(shape, random_options(random, 1 + trial % 3, trial % 2 == 1));
        std::vector<HalfSpace> clip;
        const std::vector<HalfSpace> border = half_spaces(domain_lattice(volume));
        if (trial % 2 == 0) {
            clip = half_spaces(volume.bounds());
        } else {
            for (int axis = 0; axis < 3; ++axis)
                for (const bool is_upper : {false, true})
                    clip.push_back(
                        half_space_in_world(volume, axis, is_upper ? volume.cell_shape()[axis] : 0, is_upper));
        }
        const SolidPlanes planes(volume, clip, true, false);
        REQUIRE(planes.clip() == border);
        // A face inside of the volume, too.
        const int axis = trial % 3, place = trial % volume.cell_shape()[axis];
        const SolidPlanes inner(volume, {half_space_in_world(volume, axis, place, false)}, true, false);
        HalfSpace face{glm::dvec3(0.0), static_cast<double>(place)};
        face.normal[axis] = 1.0;
        REQUIRE(inner.clip().front() == face);
    }
}

TEST_CASE("a plane that is farther from a face than rounding is left there", "[brick]")
{
    std::mt19937 random(6);
    for (int trial = 0; trial < 500; ++trial) {
        const Volume volume = full_volume({9, 10, 11}, random_options(random, 1 + trial % 3, trial % 2 == 1));
        const double away = (trial % 4 < 2 ? 1.0 : -1.0) * 1e-7;
        const SolidPlanes planes(volume, {half_space_in_world(volume, trial % 3, 4.0 + away, false)}, true, false);
        REQUIRE(std::abs(planes.clip().front().offset - 4.0 - away) < 1e-9);
    }
}

TEST_CASE("planes within rounding of each other are one, and only the first has caps", "[brick]")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int trial = 0; trial < 500; ++trial) {
        const Volume volume = full_volume({9, 10, 11}, random_options(random, 1 + trial % 3, true));
        const glm::dvec3 normal(unit(random), unit(random), unit(random));
        const glm::dvec3 middle = volume.bounds().center();
        const HalfSpace plane{normal, glm::dot(normal, middle)};
        const HalfSpace same{normal / 3.0, glm::dot(normal / 3.0, middle)};
        const HalfSpace opposite{-0.7 * normal, glm::dot(-0.7 * normal, middle)};
        const SolidPlanes planes(volume, {plane, same, opposite}, true, true);
        REQUIRE(planes.clip()[0] == planes.clip()[1]);
        REQUIRE(planes.clip()[2] == HalfSpace{-planes.clip()[0].normal, -planes.clip()[0].offset});
        REQUIRE(planes.has_caps(0));
        REQUIRE(!planes.has_caps(1));
        REQUIRE(planes.has_caps(2));
    }
}

TEST_CASE("the border has caps if the solid is closed, and a cut if it is capped", "[brick]")
{
    const Volume volume = full_volume({6, 7, 8}, {});
    const std::vector<HalfSpace> cut{{{0.0, 0.0, 1.0}, 2.25}}, at_border{{{0.0, 0.0, 2.0}, 2.0 * -0.5}};
    const auto caps = [&](const std::vector<HalfSpace>& clip, bool capped, bool closed) {
        const SolidPlanes planes(volume, clip, capped, closed);
        std::vector<int> found;
        for (std::size_t i = 0; i < planes.all().size(); ++i)
            if (planes.has_caps(i))
                found.push_back(static_cast<int>(i));
        REQUIRE(planes.have_caps() == !found.empty());
        REQUIRE(planes.clip().size() == clip.size());
        return found;
    };
    using Caps = std::vector<int>;
    REQUIRE(caps({}, false, false) == Caps{});
    REQUIRE(caps({}, false, true) == Caps{0, 1, 2, 3, 4, 5});
    REQUIRE(caps(cut, false, false) == Caps{});
    REQUIRE(caps(cut, true, false) == Caps{0});
    REQUIRE(caps(cut, false, true) == Caps{1, 2, 3, 4, 5, 6});
    REQUIRE(caps(cut, true, true) == Caps{0, 1, 2, 3, 4, 5, 6});
    // A clip at the border: it has the border's cap, and the border does not.
    REQUIRE(caps(at_border, false, false) == Caps{});
    REQUIRE(caps(at_border, true, false) == Caps{0});
    REQUIRE(caps(at_border, false, true) == Caps{0, 1, 2, 3, 4, 6});
}
