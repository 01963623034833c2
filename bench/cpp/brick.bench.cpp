// The work for a level before and while rays are cast, on one thread: selecting its bricks, and making all of them with
// their blocks, as if rays entered everywhere.
#include "measure.h"
#include "subjects.h"

#include "isospline/brick/bricks.h"
#include "isospline/brick/ranges.h"
#include "isospline/util/parallel.h"

#include <bit>
#include <cstdint>

namespace isospline::bench {

namespace {

/// Makes all bricks and blocks; returns the number of blocks.
std::int64_t make_all(const Bricks& bricks)
{
    std::int64_t blocks = 0;
    unsigned cells = 0;
    Block own;
    for (const Octet& octet : bricks.octets())
        for (unsigned children = octet.bricks; children != 0; children &= children - 1u) {
            BrickPin pin;
            const MadeBrick& brick = bricks.brick(octet, std::countr_zero(children), pin);
            for (std::uint64_t rest = brick.blocks(); rest != 0; rest &= rest - 1u, ++blocks)
                cells ^= brick.block(std::countr_zero(rest), bricks.degree(), bricks.threshold(), own).cells;
        }
    benchmark::DoNotOptimize(cells);
    return blocks;
}

void ranges(benchmark::State& state)
{
    set_thread_count(1);
    for (auto _ : state)
        benchmark::DoNotOptimize(BrickRanges(*subject().volume));
}

void select(benchmark::State& state)
{
    set_thread_count(1);
    const auto surface = make_surface();
    for (auto _ : state)
        surface->set_level(subject().level);
    state.counters["bricks"] = static_cast<double>(surface->snapshot()->bricks().count());
}

void make(benchmark::State& state)
{
    set_thread_count(1);
    const auto surface = make_surface();
    std::int64_t blocks = 0;
    for (auto _ : state) {
        state.PauseTiming();
        surface->set_level(subject().level);
        const auto snapshot = surface->snapshot();
        state.ResumeTiming();
        blocks = make_all(snapshot->bricks());
    }
    state.counters["blocks"] = static_cast<double>(blocks);
    state.SetItemsProcessed(blocks * state.iterations());
}

BENCHMARK(ranges)->Name("bricks/ranges")->Apply(settings);
BENCHMARK(select)->Name("bricks/select")->Apply(settings);
BENCHMARK(make)->Name("bricks/make")->Apply(settings);

} // namespace

} // namespace isospline::bench
