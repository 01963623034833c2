#include "catch.h"

#include "isospline/io/exr.h"
#include "isospline/math/affine.h"
#include "isospline/render/projection.h"

#include <ImathMatrix.h>
#include <ImathVec.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace isospline;
namespace fs = std::filesystem;

namespace {

/// An empty folder that goes away with the object.
class TemporaryFolder {
public:
    TemporaryFolder() : path_(fs::temp_directory_path() / ("isospline-" + std::to_string(std::random_device()())))
    {
        fs::create_directory(path_);
    }
    ~TemporaryFolder() { fs::remove_all(path_); }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const fs::path& path() const { return path_; }
    std::ptrdiff_t file_count() const { return std::distance(fs::directory_iterator(path_), fs::directory_iterator()); }

private:
    fs::path path_;
};

const PerspectiveCamera camera{{3, -5, 2}, {0.5, 0.2, 0.1}, {0, 0, 1}, 35.0};

const Layers all_layers{.depth = true,
                        .position = true,
                        .normal = true,
                        .albedo = true,
                        .gradient_magnitude = true,
                        .curvature = true,
                        .ambient_occlusion = true,
                        .direct = true,
                        .variance = true,
                        .geometry_ids = true,
                        .primitive_ids = true};

Image some_image()
{
    const Projection projection(camera, {7, 5});
    Image image({7, 5}, all_layers);
    image.world_to_camera = projection.world_to_camera();
    image.world_to_ndc = projection.world_to_ndc();
    image.pixel_aspect_ratio = 1.5;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform;
    const auto vector = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    for (std::size_t i = 0; i < image.pixel_count(); i += 2) { // every other ray missed
        image.color[i] = glm::vec4(vector(), 1.0f);
        image.depth[i] = 10.0f * uniform(random);
        image.position[i] = 10.0f * vector();
        image.normal[i] = vector();
        image.albedo[i] = vector();
        image.gradient_magnitude[i] = uniform(random);
        image.curvature[i] = {uniform(random) - 0.5f, uniform(random) - 0.5f};
        image.ambient_occlusion[i] = uniform(random);
        image.direct[i] = vector();
        image.geometry_ids[i] = static_cast<std::uint32_t>(i % 3);
        image.primitive_ids[i] = (std::uint64_t{1} << 32) * (i % 4) + 4000000000u + i;
    }
    return image;
}

template <typename T>
std::vector<T> read_channel(Imf::InputFile& file, const char* name, Imf::PixelType type)
{
    std::vector<T> values(35);
    Imf::FrameBuffer buffer;
    REQUIRE(file.header().channels().findChannel(name) != nullptr);
    buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(values.data()), sizeof(T), 7 * sizeof(T)));
    file.setFrameBuffer(buffer);
    file.readPixels(0, 4);
    return values;
}

} // namespace

TEST_CASE("an EXR file holds every channel bit for bit", "[io]")
{
    const TemporaryFolder folder;
    const Image image = some_image();
    const fs::path path = folder.path() / "image.exr";
    write_exr(image, path);
    REQUIRE(folder.file_count() == 1);

    Imf::InputFile file(path.string().c_str());
    REQUIRE(file.header().compression() == Imf::ZIP_COMPRESSION);
    REQUIRE(file.header().pixelAspectRatio() == 1.5f);
    const auto channel = [&](const char* name) { return read_channel<float>(file, name, Imf::FLOAT); };
    const auto require_part = [&](const char* name, const auto& array, int part) {
        const std::vector<float> values = channel(name);
        for (std::size_t i = 0; i < values.size(); ++i)
            REQUIRE(values[i] == array[i][part]);
    };
    for (int part = 0; part < 4; ++part)
        require_part(std::string(1, "RGBA"[part]).c_str(), image.color, part);
    for (int axis = 0; axis < 3; ++axis) {
        require_part((std::string("P.") + "XYZ"[axis]).c_str(), image.position, axis);
        require_part((std::string("N.") + "XYZ"[axis]).c_str(), image.normal, axis);
        require_part((std::string("albedo.") + "RGB"[axis]).c_str(), image.albedo, axis);
        require_part((std::string("direct.") + "RGB"[axis]).c_str(), image.direct, axis);
    }
    require_part("curvature.mean", image.curvature, 0);
    require_part("curvature.gaussian", image.curvature, 1);
    REQUIRE(channel("gradient_magnitude") == image.gradient_magnitude);
    REQUIRE(channel("ambient_occlusion") == image.ambient_occlusion);
    REQUIRE(channel("Z") == image.depth);
    REQUIRE(read_channel<std::uint32_t>(file, "id.geometry", Imf::UINT) == image.geometry_ids);
    const auto low = read_channel<std::uint32_t>(file, "id.primitive", Imf::UINT);
    const auto high = read_channel<std::uint32_t>(file, "id.primitive_high", Imf::UINT);
    for (std::size_t i = 0; i < image.pixel_count(); ++i)
        REQUIRE((std::uint64_t{high[i]} << 32 | low[i]) == image.primitive_ids[i]);
    REQUIRE((low[1] == 0xffffffffu && high[1] == 0xffffffffu)); // a miss
}

TEST_CASE("an EXR header holds the camera's matrices in Imath's convention", "[io]")
{
    const TemporaryFolder folder;
    const fs::path path = folder.path() / "image.exr";
    write_exr(some_image(), path);
    Imf::InputFile file(path.string().c_str());

    const Projection projection(camera, {7, 5});
    const glm::dvec3 position = projection.ray({2.5, 4.5}).at(3.0);
    const Imath::V3f point(static_cast<float>(position.x), static_cast<float>(position.y),
                           static_cast<float>(position.z));
    const Imath::V3f ndc = point * Imf::worldToNDC(file.header());
    REQUIRE(7 * ndc.x == Approx(2.5).epsilon(1e-5));
    REQUIRE(5 * ndc.y == Approx(4.5).epsilon(1e-5));
    const Imath::V3f in_camera = point * Imf::worldToCamera(file.header());
    REQUIRE(in_camera.z == Approx(3.0).epsilon(1e-5));
    REQUIRE(in_camera.x < 0.0f); // left of and below the middle
    REQUIRE(in_camera.y < 0.0f);
}

TEST_CASE("an EXR file has the channels of the image's layers, and no others", "[io]")
{
    const TemporaryFolder folder;
    const fs::path path = folder.path() / "image.exr";
    Layers layers;
    layers.gradient_magnitude = true;
    write_exr(Image({7, 5}, layers), path);
    Imf::InputFile file(path.string().c_str());
    std::vector<std::string> names;
    for (auto channel = file.header().channels().begin(); channel != file.header().channels().end(); ++channel)
        names.emplace_back(channel.name());
    REQUIRE(names == std::vector<std::string>{"A", "B", "G", "R", "gradient_magnitude"});
    REQUIRE(read_channel<float>(file, "gradient_magnitude", Imf::FLOAT) == std::vector<float>(35, 0.0f));

    const fs::path refused = folder.path() / "refused.exr";
    REQUIRE_THROWS_WITH(write_exr(Image({7, 5}, {}, ColorEncoding::srgb8), refused),
                        "image: expected one of linear colour, got one of 8-bit sRGB");
    REQUIRE(!fs::exists(refused));
}

TEST_CASE("half colour only changes R, G, B and A", "[io]")
{
    const TemporaryFolder folder;
    const Image image = some_image();
    const fs::path path = folder.path() / "image.exr";
    write_exr(image, path, {true});
    Imf::InputFile file(path.string().c_str());
    REQUIRE(file.header().channels()["G"].type == Imf::HALF);
    REQUIRE(file.header().channels()["Z"].type == Imf::FLOAT);
    const std::vector<float> green = read_channel<float>(file, "G", Imf::FLOAT);
    for (std::size_t i = 0; i < green.size(); ++i)
        REQUIRE(green[i] == Approx(image.color[i].g).epsilon(1e-3));
}

TEST_CASE("a file that cannot be written leaves nothing behind and names the path", "[io]")
{
    const TemporaryFolder folder;
    const Image image = some_image();

    const fs::path missing = folder.path() / "missing" / "image.exr";
    REQUIRE_THROWS_AS(write_exr(image, missing), fs::filesystem_error);
    REQUIRE_THROWS_WITH(write_exr(image, missing), ContainsSubstring(missing.string()));

    const fs::path occupied = folder.path() / "folder.exr";
    fs::create_directory(occupied);
    REQUIRE_THROWS_WITH(write_exr(image, occupied), ContainsSubstring(occupied.string()));

    const Image empty; // which OpenEXR refuses
    const fs::path old = folder.path() / "old.exr";
    std::ofstream(old) << "old";
    REQUIRE_THROWS_WITH(write_exr(empty, old), ContainsSubstring(old.string()));

    REQUIRE(folder.file_count() == 2);
    REQUIRE(fs::file_size(old) == 3);
    write_exr(image, old);
    REQUIRE(fs::file_size(old) > 100);
    REQUIRE(folder.file_count() == 2);
}
