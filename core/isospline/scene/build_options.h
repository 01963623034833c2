// How Embree's acceleration structures are built.
#pragma once

namespace isospline {

enum class BuildQuality {
    low,    ///< Embree's Morton builder: less memory, built a little faster, traced a little slower
    medium, ///< binned surface area heuristic
    high    ///< the same with spatial splits, which help long triangles
};

struct BuildOptions {
    BuildQuality quality = BuildQuality::medium;
    /// Cells along an edge of the boxes that Embree has of an isosurface: 1, 2, 4, 8 or 16. Inside a box, cells are
    /// found by halving it, and made when the first ray enters it. Below 8, all cells of a level are found when the
    /// scene is built; 1 is a box for each cell of the unpruned shell. The default is the fastest to change a level, by
    /// far, and about the fastest to trace (docs/benchmarks.md); hits do not depend on it.
    int box_edge = 16;
};

} // namespace isospline
