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
};

} // namespace isospline
