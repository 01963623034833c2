// Checksums of hits: processors of x86-64 and of aarch64 find the same.
#include "catch.h"
#include "each_target.h"
#include "random_rays.h"
#include "volumes.h"

#include "isospline/math/affine.h"
#include "isospline/scene/scene.h"

#include <bit>
#include <cstdint>
#include <memory>
#include <random>
#include <tuple>
#include <vector>

using namespace isospline;

namespace {

/// FNV-1a.
class Checksum {
public:
    void add(std::uint64_t number)
    {
        for (int byte = 0; byte < 8; ++byte)
            value_ = (value_ ^ (number >> 8 * byte & 0xff)) * 0x100000001b3u;
    }
    void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// Of hits, to the last bit, and of their cells alone.
struct Checksums {
    std::uint64_t hits, cells;

    bool operator==(const Checksums&) const = default;
};

/// Of rays of every kind that meet noise.
Checksums checksums(int degree)
{
    const auto volume = noise_volume({21, 18, 15}, degree);
    Scene scene;
    scene.add(std::make_shared<Isosurface>(volume, 0.1));
    std::mt19937 random(5);
    std::vector<Ray> rays;
    for (int count = 0; count < 4000; ++count) {
        Ray ray = random_lattice_ray(random, volume->cell_shape());
        ray.origin = transform_point(volume->lattice_to_world(), ray.origin);
        ray.direction = transform_vector(volume->lattice_to_world(), ray.direction);
        rays.push_back(ray);
    }
    std::vector<Hit> hits(rays.size());
    scene.snapshot()->cast_rays(rays, hits);
    Checksum all, cells;
    for (const Hit& hit : hits) {
        all.add(hit.t);
        for (int axis = 0; axis < 3; ++axis)
            all.add(hit.position[axis]), all.add(hit.normal[axis]);
        cells.add(hit.primitive_id);
    }
    return {all.value(), cells.value()};
}

/// Whether the SIMD target in use fuses multiply-adds: on x86-64 those from AVX2 on.
bool fuses()
{
    const std::int64_t targets = hwy::SupportedTargets();
    return !HWY_ARCH_X86 || (targets & -targets) <= HWY_AVX2;
}

} // namespace

TEST_CASE("hits are the same to the last bit on all processors that fuse multiply-adds, and on all others", "[scene]")
{
    int degree = 0;
    std::uint64_t fused = 0, rounded = 0, cells = 0;
    std::tie(degree, fused, rounded, cells) = GENERATE(table<int, std::uint64_t, std::uint64_t, std::uint64_t>({
        {1, 0xa087339ad89e1183u, 0x3ff01e3828534027u, 0x68467ca9df71ac64u},
        {2, 0x125bb85ca7c15010u, 0x759af29320f12267u, 0x6f44d245e8ab0038u},
        {3, 0xde2ff119dd789019u, 0xdca283c84482de50u, 0xc137a4240af1c8e5u},
    }));
    CAPTURE(degree);
    const Checksums expected_fused{fused, cells}, expected_rounded{rounded, cells};
    for_each_target([&] {
        const Checksums found = checksums(degree);
        INFO(std::hex << found.hits << " " << found.cells);
        CHECK(found == (fuses() ? expected_fused : expected_rounded));
    });
}
