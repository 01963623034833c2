// The subject of the benchmarks: a volume with a level, its mesh, and two views of it.
#pragma once

#include "isospline/render/camera.h"
#include "isospline/scene/scene.h"
#include "isospline/shell/isosurface.h"
#include "isospline/spline/volume.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace isospline::bench {

struct Subject {
    std::string name;
    std::shared_ptr<const Volume> volume;
    double level = 0.0;
    glm::ivec2 size{64, 64};          ///< of the picture whose primary rays are cast, multiples of 4
    std::size_t ambient_count = 4096; ///< incoherent rays
    PerspectiveCamera whole, close;   ///< a view of the whole object, and a close view in which every ray hits
    std::vector<glm::vec3> vertices;  ///< of the marching-cubes mesh of the level, in world space
    std::vector<glm::uvec3> faces;
};

/// The subject in the folder given by the environment variable ISOSPLINE_BENCH_SUBJECT, written by
/// bench/suite/native.py; without it, a small sphere. Loaded when it is first needed.
const Subject& subject();

/// Reads a subject. Throws std::runtime_error if a file is missing or too short.
Subject read_subject(const std::filesystem::path& folder);

/// A sphere of radius 3/8 of a cube of size^3 samples, with a mesh of its own.
Subject sphere(int size);

/// A new surface of the subject.
std::shared_ptr<Isosurface> make_surface(Method method = Method::exact);

/// A scene with only the subject's surface, built when it is first needed.
const SceneSnapshot& spline_scene();

} // namespace isospline::bench
