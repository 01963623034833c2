// How Embree's acceleration structures are built.
#pragma once

namespace isospline {

enum class BuildQuality {
    low,    ///< Embree's Morton builder: less memory, built a little faster, traced a little slower
    medium, ///< binned surface area heuristic
    high    ///< medium with spatial splits, which help with long triangles
};

struct BuildOptions {
    BuildQuality quality = BuildQuality::medium;
    /// Cells along an edge of an isosurface's boxes in Embree: 1, 2, 4, 8 or 16. A box is halved until cells are
    /// reached; they are made when the first ray enters the box. Below 8, all cells of a level are found when the scene
    /// is built; 1 gives a box for each cell of the unpruned shell. With the default, a change of the level is by far
    /// the fastest, and tracing is about the fastest (docs/benchmarks.md). Hits do not depend on it.
    int box_edge = 16;
};

} // namespace isospline
