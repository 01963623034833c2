// Progressive pictures.
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
#include <optional>
#include <vector>

namespace isospline {

class Scene;
class SceneSnapshot;

/// The state of a path traced picture: another renderer of the same picture can continue from it.
struct PathSums {
    /// Sums over the samples of a pixel.
    struct Sum {
        glm::dvec3 radiance{0.0}, squares{0.0};
        double covered = 0.0;
    };

    std::vector<Sum> sums;           ///< of the pixels of the image, which may be a window of the picture
    std::vector<glm::dvec3> directs; ///< sums of direct light, if requested
    std::vector<int> tile_samples;   ///< for every tile, see Tiles
    bool through_centers = false;    ///< whether there is one sample per pixel, through its centre
};

/// A path traced picture in progress. Its image is the mean over the samples so far, bit for bit the same for any
/// number of threads and any division into steps. A single sample goes through the centre of its pixel, like depth and
/// ids; with more, each goes through a random position.
///
/// It shows the scene at the time of the first step; after a change of the scene, call reset(). The scene must outlive
/// this object. One thread at a time may call.
class ProgressiveRenderer {
public:
    /// Throws std::invalid_argument for a bad path tracer, camera, size, background, layers or crop (see
    /// RenderOptions).
    ProgressiveRenderer(Scene& scene, const Camera& camera, glm::ivec2 size, PathTracer path_tracer,
                        glm::vec4 background = glm::vec4(0.0f), const Layers& layers = {},
                        const std::optional<Window>& crop = std::nullopt);

    /// Adds samples to every pixel. If `progress` returns false, it throws Cancelled; finished tiles then have more
    /// samples than others, until the next step compensates for it. Throws std::invalid_argument for a bad number of
    /// samples or material of an object, and a geometry id that is not in the scene, and std::logic_error if the
    /// scene has changed since the first step.
    void step(int samples = 1, const Progress& progress = {});

    /// Starts again, with another camera, or with the same one after a change of the scene. If it throws, nothing has
    /// changed.
    void reset(const Camera& camera);
    void reset();

    /// The number of samples of every pixel.
    int samples() const;

    /// The root mean square, over pixels and colour components, of sqrt(mean + error) - sqrt(mean) with the standard
    /// error of the mean, both clipped at 1. This is about the noise that is visible in the displayed picture
    /// (normalised by brightness as in H. Dammertz et al., "A hierarchical automatic stopping condition for Monte Carlo
    /// global illumination", WSCG 2010). Infinite below 2 samples, and while some tiles have more samples than others.
    double noise() const;

    /// Throws std::logic_error if the scene has changed since the first step.
    const PathSums& path_sums() const;

    /// Continues from the state of another renderer with an equal scene, camera and so on: the picture is then the
    /// same, bit for bit, as without a pause. Throws std::invalid_argument, about `parameter`, for a picture of another
    /// size or with other layers, and for numbers that samples cannot produce; nothing has changed then. If `progress`
    /// cancels, the state is that after reset().
    void resume(PathSums path_sums, const char* parameter = "path_sums", const Progress& progress = {});

    /// The mean over the samples and, as a layer, the variance of that mean; zero and infinite without samples. Layers
    /// other than direct and variance come from the ray through the centre of a pixel.
    Image image(ColorEncoding encoding = ColorEncoding::linear) const;

private:
    /// Begins with a number of samples.
    void begin(int samples, const Progress& progress);
    void continue_with(int samples, const Progress& progress);
    std::shared_ptr<const SceneSnapshot> snapshot_for(int samples, const Progress& progress) const;
    void check_current() const;
    void clear_sums(bool through_centers);
    void render_tile(std::size_t tile, int samples);

    Scene& scene_;
    std::shared_ptr<const SceneSnapshot> snapshot_; ///< of the scene as it was at the first step
    Camera camera_;
    Projection projection_;
    Window window_;
    PathTracer path_tracer_; ///< the original argument
    PathTracer prepared_;    ///< with the materials of all objects, as of the first step
    glm::vec4 background_;
    Layers layers_;
    PathSums path_sums_;
    Image centers_; ///< the result of the rays through the centres
    bool has_centers_ = false;
};

} // namespace isospline
