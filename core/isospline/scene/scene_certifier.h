// First crossings of rays with a scene, with proven bounds: docs/method.md, "Certified rays".
#pragma once

#include "isospline/math/ray.h"
#include "isospline/scene/scene_snapshot.h"
#include "isospline/trace/certified_ray.h"

#include <limits>
#include <optional>
#include <vector>

namespace isospline {

/// Proves where rays first cross any of the isosurfaces that they see. Any number of threads may use it.
class SceneCertifier {
public:
    /// Throws std::invalid_argument for a scene with meshes among them, and for surfaces that RayCertifier rejects;
    /// `parameter` names what asked for proofs.
    SceneCertifier(const SceneSnapshot& scene, bool SeenBy::*sees, const char* parameter = "certify");

    /// The ray's numbers are finite, except for its limits. If the first crossing is near `t_hint`, which may be any
    /// number, it is found faster.
    RayCertificate certify(const Ray& ray, double t_hint = std::numeric_limits<double>::infinity()) const;
    /// Whether the ray crosses any surface; nothing if that is not proven.
    std::optional<bool> is_crossed(const Ray& ray) const;
    /// Whether the number of crossings with all surfaces is odd; nothing if that is not proven.
    std::optional<bool> crosses_oddly(const Ray& ray) const;

private:
    std::vector<RayCertifier> surfaces_;
};

} // namespace isospline
