// Pictures that become better and better.
#pragma once

#include "isospline/render/camera.h"
#include "isospline/render/image.h"
#include "isospline/render/path_tracer.h"
#include "isospline/render/projection.h"
#include "isospline/util/progress.h"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <memory>
#include <vector>

namespace isospline {

class Scene;
class SceneSnapshot;

/// A path traced picture in the making. After any number of steps its image is the mean of as many samples a pixel, bit
/// for bit the same for any number of threads and any division into steps. A single sample goes through the centre of
/// its pixel, as depth and ids do; of more each goes through a place by chance.
///
/// It shows the scene as it is at the first step; after a change of the scene call reset(). The scene must live as long
/// as this. One thread at a time may call.
class ProgressiveRenderer {
public:
    /// Throws std::invalid_argument for a bad path tracer, camera, size, background or layers (as of RenderOptions).
    ProgressiveRenderer(Scene& scene, const Camera& camera, glm::ivec2 size, PathTracer path_tracer,
                        glm::vec4 background = glm::vec4(0.0f), const Layers& layers = {});

    /// Adds samples to every pixel. Where `progress` returns false it throws Cancelled; tiles that were done then have
    /// more samples than others, until the next step makes up for it. Throws std::invalid_argument for a bad number of
    /// samples or material of an object, and a geometry id that is not in the scene, and std::logic_error where the
    /// scene has changed since the first step.
    void step(int samples = 1, const Progress& progress = {});

    /// Begins again; with another camera, or with the same after a change of the scene. Where this throws nothing has
    /// changed.
    void reset(const Camera& camera);
    void reset();

    /// Samples that every pixel has.
    int samples() const;

    /// The mean over the samples and, as a layer, the variance of that mean; zero, and infinite, where there are none.
    /// Layers but direct and variance come from the ray through the centre of a pixel.
    Image image(ColorEncoding encoding = ColorEncoding::linear) const;

private:
    /// Sums over the samples of a pixel.
    struct Sum {
        glm::dvec3 radiance{0.0}, squares{0.0};
        double covered = 0.0;
    };

    void begin(const Progress& progress);
    void render_tile(std::size_t tile, int samples);

    Scene& scene_;
    std::shared_ptr<const SceneSnapshot> snapshot_; ///< as of the first step
    Camera camera_;
    Projection projection_;
    PathTracer path_tracer_; ///< as given
    PathTracer prepared_;    ///< with the materials of all objects, as of the first step
    glm::vec4 background_;
    Layers layers_;
    std::vector<Sum> sums_;           ///< of the pixels of the image
    std::vector<glm::dvec3> directs_; ///< sums of direct light, where it is asked for
    std::vector<int> tile_samples_;   ///< of every tile
    Image centers_;                   ///< what the rays through the centres found
    bool has_centers_ = false;
    bool through_centers_ = false; ///< whether the samples so far are single ones, through the centres
};

} // namespace isospline
