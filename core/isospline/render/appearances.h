// The looks of all objects of a scene in one light.
#pragma once

#include "isospline/render/renderer.h"

#include <cstdint>
#include <map>
#include <optional>

namespace isospline {

/// A checked shading with its lights, and values that are needed at every hit.
struct Appearance {
    Shading shading;
    std::optional<double> even_opacity; ///< nothing if it varies from point to point
    bool needs_curvature;
};

class Appearances {
public:
    /// Throws std::invalid_argument for a bad shading, and for geometry ids that the scene does not have.
    Appearances(const SceneSnapshot& scene, const Look& look, const Projection& projection, const DepthRange& depths);

    const Appearance& of(std::uint32_t geometry_id) const
    {
        const auto found = of_geometry_.find(geometry_id);
        return found == of_geometry_.end() ? others_ : found->second;
    }

    bool needs_visibility() const { return needs_visibility_; }
    bool all_opaque() const { return all_opaque_; }

private:
    Appearance prepared(Shading shading, const Projection& projection, const DepthRange& depths);

    bool needs_visibility_ = false, all_opaque_ = true;
    Appearance others_;
    std::map<std::uint32_t, Appearance> of_geometry_;
};

} // namespace isospline
