// How much work goes into Embree's acceleration structures.
#pragma once

namespace isospline {

enum class BuildQuality {
    low,    ///< Embree's Morton builder: less memory, built a little faster, traced a little slower
    medium, ///< binned surface area heuristic
    high    ///< the same with spatial splits, which help long triangles
};

} // namespace isospline
