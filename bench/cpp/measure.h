// Timing of rays: in chunks whose hits stay in the cache, like the tiles of a picture, on one thread.
#pragma once

#include "views.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace isospline::bench {

/// The settings of all benchmarks.
inline void settings(benchmark::internal::Benchmark* benchmark)
{
    benchmark->UseRealTime()->Unit(benchmark::kMillisecond);
}

inline constexpr std::size_t chunk_size = 4096; ///< rays

/// Calls `cast(rays, answers)` for all chunks of the rays.
template <typename Answer, typename Cast>
void cast_in_chunks(std::span<const Ray> rays, std::vector<Answer>& answers, const Cast& cast)
{
    for (std::size_t first = 0; first < rays.size(); first += chunk_size) {
        const auto chunk = rays.subspan(first, std::min(chunk_size, rays.size() - first));
        cast(chunk, std::span(answers).first(chunk.size()));
        benchmark::DoNotOptimize(answers.data());
        benchmark::ClobberMemory();
    }
}

/// Times `cast(rays, answers)`. `is_hit(answer)` is used to count hits, for comparison.
template <typename Answer, typename Cast, typename IsHit>
void time_rays(benchmark::State& state, Rays kind, const Cast& cast, const IsHit& is_hit)
{
    const std::vector<Ray>& rays = rays_of(kind);
    std::vector<Answer> answers(chunk_size);
    std::size_t hits = 0;
    cast_in_chunks(std::span(rays), answers, [&](std::span<const Ray> chunk, std::span<Answer> of_chunk) {
        cast(chunk, of_chunk);
        hits += static_cast<std::size_t>(std::count_if(of_chunk.begin(), of_chunk.end(), is_hit));
    });
    for (auto _ : state)
        cast_in_chunks(std::span(rays), answers, cast);
    state.counters["rays"] = static_cast<double>(rays.size());
    state.counters["hit"] = static_cast<double>(hits) / static_cast<double>(rays.size());
    state.SetItemsProcessed(static_cast<std::int64_t>(rays.size()) * state.iterations());
}

/// Like time_rays(), for first hits.
template <typename Answer, typename Cast>
void time_first_hits(benchmark::State& state, Rays kind, const Cast& cast)
{
    time_rays<Answer>(state, kind, cast, [](const Answer& hit) { return std::isfinite(hit.t); });
}

/// Like time_rays(), for occlusions.
template <typename Cast>
void time_occlusions(benchmark::State& state, Rays kind, const Cast& cast)
{
    time_rays<std::uint8_t>(state, kind, cast, [](std::uint8_t occluded) { return occluded != 0; });
}

} // namespace isospline::bench
