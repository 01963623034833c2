// One allocation of an operation fails: the operation throws std::bad_alloc or succeeds, and works again afterwards.
//
// This is a separate program, because it replaces operator new. Each failure is tried in a separate process, so that a
// crash or hang does not end the others.
#include "long_tests.h"

#include "isospline/isospline.h"

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

namespace {

std::atomic<bool> counting = false;
std::atomic<long> allocations = 0, failing = -1;

bool is_to_fail()
{
    return counting && allocations++ == failing;
}

void* allocate(std::size_t size, std::size_t alignment = alignof(std::max_align_t))
{
    void* const memory = is_to_fail() ? nullptr : std::aligned_alloc(alignment, (size / alignment + 1) * alignment);
    if (memory == nullptr)
        throw std::bad_alloc();
    return memory;
}

} // namespace

void* operator new(std::size_t size)
{
    return allocate(size);
}
void* operator new[](std::size_t size)
{
    return allocate(size);
}
void* operator new(std::size_t size, std::align_val_t alignment)
{
    return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment)
{
    return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept
{
    std::free(memory);
}
void operator delete[](void* memory) noexcept
{
    std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept
{
    std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept
{
    std::free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept
{
    std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
    std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept
{
    std::free(memory);
}

namespace {

using namespace isospline;

/// A capped ball and a square through it, in a scene that has been used.
struct World {
    static constexpr int size = 20;

    World()
    {
        for (int z = 0; z < size; ++z)
            for (int y = 0; y < size; ++y)
                for (int x = 0; x < size; ++x)
                    data.push_back(
                        std::sqrt(static_cast<float>((x - 9) * (x - 9) + (y - 9) * (y - 9) + (z - 9) * (z - 9))));
        volume = std::make_shared<Volume>(samples());
        options.capped = true;
        options.clip = {{{0, 0, 1}, 8.0}};
        surface = std::make_shared<Isosurface>(volume, 6.0, options);
        mesh = std::make_shared<Mesh>(std::vector<glm::dvec3>{{-1, -1, 10}, {21, -1, 10}, {21, 21, 10}, {-1, 21, 10}},
                                      std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}});
        scene.add(surface);
        scene.add(mesh);
        scene.snapshot();
        for (int i = 0; i < 32 * 32; ++i)
            rays.push_back({glm::dvec3(-5, 0, 0) + size / 32.0 * glm::dvec3(0, i % 32, i / 32), {1.0, 0.01, 0.02}});
    }

    SampleView samples() const
    {
        constexpr std::ptrdiff_t step = sizeof(float);
        return {data.data(), SampleType::float32, {size, size, size}, {step, step * size, step * size * size}};
    }

    double cast(bool coherent)
    {
        std::vector<Hit> hits(rays.size());
        scene.snapshot()->cast_rays(rays, hits, coherent);
        double sum = 0.0;
        for (const Hit& hit : hits)
            sum += hit ? hit.t : 0.0;
        return sum;
    }
    double occlude(bool coherent)
    {
        std::vector<std::uint8_t> occluded(rays.size());
        scene.snapshot()->test_occlusions(rays, occluded, coherent);
        double sum = 0.0;
        for (const std::uint8_t is_occluded : occluded)
            sum += is_occluded;
        return sum;
    }
    double list()
    {
        std::vector<Crossing> crossings;
        std::vector<std::uint32_t> counts(rays.size());
        scene.snapshot()->list_intersections(rays, crossings, counts);
        double sum = 0.0;
        for (const Crossing& crossing : crossings)
            sum += crossing.hit.t;
        return sum;
    }
    double sum_of(const Image& image)
    {
        double sum = 0.0;
        for (const glm::vec4& color : image.color)
            sum += static_cast<double>(color.r);
        return sum;
    }
    double picture(float opacity)
    {
        RenderOptions picture;
        picture.size = {32, 24};
        Phong phong;
        phong.opacity = opacity;
        phong.shadows = true;
        picture.shading = phong;
        return sum_of(render(*scene.snapshot(), camera, picture));
    }
    double paths()
    {
        ProgressiveRenderer renderer(scene, camera, {24, 16}, PathTracer());
        renderer.step(2);
        return sum_of(renderer.image());
    }
    double new_scene()
    {
        Scene other;
        other.add(surface);
        other.add(mesh);
        return static_cast<double>(other.snapshot()->build_count());
    }
    double change()
    {
        surface->set_level(7.0);
        const double sum = cast(false);
        const std::uint32_t added = scene.add(mesh);
        scene.set_visibility(added, {true, false});
        scene.snapshot();
        scene.remove(added);
        return sum;
    }
    double nearest()
    {
        ClosestPointFinder find(*surface->snapshot());
        return find({1.0, 3.0, 4.0}).distance;
    }
    double prefilter() { return Volume(samples()).value({9.3, 8.4, 7.2}); }
    double prune()
    {
        const Isosurface other(volume, 5.0);
        return other.snapshot()->is_empty() ? 0.0 : static_cast<double>(other.snapshot()->shell().count());
    }
    double march() { return static_cast<double>(to_mesh(*surface->snapshot()).vertices.size()); }
    double simplify() { return static_cast<double>(to_mesh(*surface->snapshot(), 0.5).vertices.size()); }
    double write()
    {
        write_exr(Image({32, 24}, {}), "image.exr");
        return std::filesystem::remove("image.exr") ? 1.0 : 0.0;
    }

    std::vector<float> data;
    std::shared_ptr<Volume> volume;
    IsosurfaceOptions options;
    std::shared_ptr<Isosurface> surface;
    std::shared_ptr<Mesh> mesh;
    Scene scene;
    std::vector<Ray> rays;
    PerspectiveCamera camera{{-40, 9, 9}, {9, 9, 9}};
};

struct Operation {
    const char* name;
    std::function<double(World&)> run;
};

const Operation operations[] = {
    {"cast", [](World& world) { return world.cast(false); }},
    {"packets", [](World& world) { return world.cast(true); }},
    {"occlusion", [](World& world) { return world.occlude(false); }},
    {"occlusion of packets", [](World& world) { return world.occlude(true); }},
    {"crossings", [](World& world) { return world.list(); }},
    {"picture", [](World& world) { return world.picture(1.0f); }},
    {"translucent picture", [](World& world) { return world.picture(0.5f); }},
    {"path tracing", [](World& world) { return world.paths(); }},
    {"new scene", [](World& world) { return world.new_scene(); }},
    {"change", [](World& world) { return world.change(); }},
    {"closest point", [](World& world) { return world.nearest(); }},
    {"prefilter", [](World& world) { return world.prefilter(); }},
    {"prune", [](World& world) { return world.prune(); }},
    {"mesh", [](World& world) { return world.march(); }},
    {"simplified mesh", [](World& world) { return world.simplify(); }},
    {"exr", [](World& world) { return world.write(); }},
};

enum Outcome { good, wrong, swallowed, other_exception, file_left };

/// The outcome of an operation whose allocation of this number fails; none where it is negative, and their number then
/// goes to `pipe`.
Outcome outcome(const Operation& operation, long number, int pipe)
{
    set_thread_count(number % 2 == 0 ? 1 : 2);
    World world, undisturbed;
    const double expected = operation.run(undisturbed);
    failing = number;
    counting = true;
    std::optional<double> result; // none if there is no memory
    try {
        result = operation.run(world);
    } catch (const std::bad_alloc&) {
        result.reset();
    } catch (const std::filesystem::filesystem_error&) {
        result.reset(); // OpenEXR makes an error of its stream of some
    } catch (const std::exception& error) {
        counting = false;
        std::fprintf(stderr, "%s, allocation %ld: %s\n", operation.name, number, error.what());
        return other_exception;
    }
    counting = false;
    if (number < 0) {
        const long count = allocations;
        return write(pipe, &count, sizeof(count)) == sizeof(count) ? good : wrong;
    }
    if (!std::filesystem::is_empty("."))
        return file_left;
    // An operation that succeeds without the memory must have the same result.
    if (result && result != expected)
        return swallowed;
    return operation.run(world) == expected ? good : wrong;
}

int status_of_child(const Operation& operation, long number, int pipe)
{
    const pid_t child = fork();
    if (child == 0) {
        alarm(60);
        int code = other_exception;
        std::string folder = std::filesystem::temp_directory_path() / "failing_allocations.XXXXXX";
        if (mkdtemp(folder.data()) == nullptr || chdir(folder.c_str()) != 0)
            _exit(code);
        try {
            code = outcome(operation, number, pipe);
        } catch (const std::exception& error) {
            std::fprintf(stderr, "%s, allocation %ld, the next time: %s\n", operation.name, number, error.what());
        }
        std::filesystem::remove_all(folder);
        _exit(code);
    }
    int status = -1;
    waitpid(child, &status, 0);
    return status;
}

} // namespace

int main(int argc, char** argv)
{
    // How many allocations of each operation fail, evenly spread over all.
    const long most = argc > 1 ? std::atol(argv[1]) : are_tests_long() ? 200 : 40;
    int bad = 0;
    for (const Operation& operation : operations) {
        std::array<int, 2> pipe_ends{};
        long count = 0;
        if (pipe(pipe_ends.data()) != 0 || status_of_child(operation, -1, pipe_ends[1]) != 0 ||
            read(pipe_ends[0], &count, sizeof(count)) != sizeof(count))
            return 2;
        const long step = std::max(1L, count / most);
        int tried = 0, bad_here = 0;
        for (long number = 0; number < count; number += step, ++tried) {
            const int status = status_of_child(operation, number, pipe_ends[1]);
            if (WIFEXITED(status) && WEXITSTATUS(status) == good)
                continue;
            ++bad_here;
            std::fprintf(stderr, "%s, allocation %ld of %ld: %s %d\n", operation.name, number, count,
                         WIFSIGNALED(status) ? "signal" : "outcome",
                         WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
        }
        std::printf("%-20s %6ld allocations, %4d tried, %4d bad\n", operation.name, count, tried, bad_here);
        close(pipe_ends[0]);
        close(pipe_ends[1]);
        bad += bad_here;
    }
    return bad == 0 ? 0 : 1;
}
