#include "subjects.h"

#include "isospline/spline/samples.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace isospline::bench {

namespace {

std::ifstream open(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw std::runtime_error(path.string() + ": cannot be read");
    return file;
}

/// All items of a file that contains only such items.
template <typename Item>
std::vector<Item> read_items(const std::filesystem::path& path)
{
    std::ifstream file = open(path);
    std::vector<Item> items(std::filesystem::file_size(path) / sizeof(Item));
    file.read(reinterpret_cast<char*>(items.data()), static_cast<std::streamsize>(items.size() * sizeof(Item)));
    if (!file || items.empty())
        throw std::runtime_error(path.string() + ": expected at least one item");
    return items;
}

/// The numbers and words of a text file, by the name that each line begins with.
class Fields {
public:
    explicit Fields(const std::filesystem::path& path) : path_(path)
    {
        std::ifstream file = open(path);
        for (std::string name, rest; file >> name && std::getline(file >> std::ws, rest);)
            lines_[name] = rest;
    }

    std::string text(const std::string& name) const
    {
        const auto found = lines_.find(name);
        if (found == lines_.end())
            throw std::runtime_error(path_.string() + ": expected a line that begins with " + name);
        return found->second;
    }

    /// Exactly `count` numbers.
    std::vector<double> numbers(const std::string& name, std::size_t count) const
    {
        std::istringstream line(text(name));
        std::vector<double> values;
        for (double value; line >> value;)
            values.push_back(value);
        if (values.size() != count)
            throw std::runtime_error(path_.string() + ": " + name + ": expected " + std::to_string(count) +
                                     " numbers, got " + std::to_string(values.size()));
        return values;
    }

    glm::dvec3 vector(const std::string& name) const
    {
        const auto v = numbers(name, 3);
        return {v[0], v[1], v[2]};
    }

private:
    std::filesystem::path path_;
    std::map<std::string, std::string> lines_;
};

/// Types of samples by their NumPy names.
const std::map<std::string, SampleType>& sample_types()
{
    static const std::map<std::string, SampleType> types{
        {"uint8", SampleType::uint8},     {"int8", SampleType::int8},       {"uint16", SampleType::uint16},
        {"int16", SampleType::int16},     {"uint32", SampleType::uint32},   {"int32", SampleType::int32},
        {"uint64", SampleType::uint64},   {"int64", SampleType::int64},     {"float16", SampleType::float16},
        {"float32", SampleType::float32}, {"float64", SampleType::float64},
    };
    return types;
}

SampleView view_of(const std::vector<char>& samples, SampleType type, const glm::ivec3& shape)
{
    const auto count =
        static_cast<std::size_t>(shape.x) * static_cast<std::size_t>(shape.y) * static_cast<std::size_t>(shape.z);
    const auto item = static_cast<std::ptrdiff_t>(samples.size() / count);
    return {samples.data(), type, shape, {item, item * shape.x, item * shape.x * shape.y}};
}

PerspectiveCamera camera_of(const Fields& fields, const std::string& name)
{
    const auto v = fields.numbers(name, 10);
    return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]}, v[9]};
}

/// A mesh of rings of latitude; the triangles between neighbouring rings are about a voxel wide.
void add_sphere_mesh(Subject& subject, const glm::dvec3& center, double radius)
{
    const auto rings = static_cast<unsigned int>(radius * std::numbers::pi), sectors = 2 * rings;
    for (unsigned int ring = 0; ring <= rings; ++ring)
        for (unsigned int sector = 0; sector < sectors; ++sector) {
            const double polar = std::numbers::pi * ring / rings, azimuth = 2.0 * std::numbers::pi * sector / sectors;
            subject.vertices.emplace_back(center + radius * glm::dvec3(std::sin(polar) * std::cos(azimuth),
                                                                       std::sin(polar) * std::sin(azimuth),
                                                                       std::cos(polar)));
        }
    for (unsigned int ring = 0; ring < rings; ++ring)
        for (unsigned int sector = 0; sector < sectors; ++sector) {
            const unsigned int a = ring * sectors + sector, b = ring * sectors + (sector + 1) % sectors;
            if (ring > 0)
                subject.faces.emplace_back(a, a + sectors, b);
            if (ring + 1 < rings)
                subject.faces.emplace_back(b, a + sectors, b + sectors);
        }
}

} // namespace

Subject read_subject(const std::filesystem::path& folder)
{
    const Fields fields(folder / "subject.txt");
    Subject subject;
    subject.name = fields.text("name");
    subject.level = fields.numbers("level", 1)[0];
    subject.size = glm::dvec2(fields.numbers("size", 2)[0], fields.numbers("size", 2)[1]);
    subject.ambient_count = static_cast<std::size_t>(fields.numbers("ambient_count", 1)[0]);
    subject.whole = camera_of(fields, "whole");
    subject.close = camera_of(fields, "close");
    subject.vertices = read_items<glm::vec3>(folder / "vertices.float32");
    subject.faces = read_items<glm::uvec3>(folder / "faces.uint32");

    VolumeOptions options;
    options.spacing = fields.vector("spacing");
    options.origin = fields.vector("origin");
    for (int axis = 0; axis < 3; ++axis)
        options.direction[axis] = fields.vector("axis" + std::to_string(axis));
    const std::vector<char> samples = read_items<char>(folder / "samples");
    subject.volume = std::make_shared<const Volume>(
        view_of(samples, sample_types().at(fields.text("type")), fields.vector("shape")), options);
    return subject;
}

Subject sphere(int size)
{
    const double radius = 0.375 * size;
    const glm::dvec3 center(0.5 * (size - 1));
    std::vector<float> samples;
    for (int z = 0; z < size; ++z)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                samples.push_back(static_cast<float>(radius - glm::length(glm::dvec3(x, y, z) - center)));
    constexpr std::ptrdiff_t step = sizeof(float);
    Subject subject;
    subject.name = "sphere " + std::to_string(size);
    subject.volume = std::make_shared<const Volume>(
        SampleView{samples.data(), SampleType::float32, glm::ivec3(size), {step, step * size, step * size * size}});
    subject.whole = {center + 3.0 * size * glm::dvec3(0.6, -0.64, 0.48), center, {0, 0, 1}, 25.0};
    subject.close = {center + 1.1 * radius * glm::dvec3(0.6, -0.64, 0.48), center, {0, 0, 1}, 40.0};
    add_sphere_mesh(subject, center, radius);
    return subject;
}

const Subject& subject()
{
    static const Subject loaded = [] {
        const char* const folder = std::getenv("ISOSPLINE_BENCH_SUBJECT");
        return folder != nullptr ? read_subject(folder) : sphere(32);
    }();
    return loaded;
}

std::shared_ptr<Isosurface> make_surface(Method method)
{
    IsosurfaceOptions options;
    options.method = method;
    return std::make_shared<Isosurface>(subject().volume, subject().level, options);
}

const SceneSnapshot& spline_scene()
{
    static const std::shared_ptr<const SceneSnapshot> snapshot = [] {
        Scene scene;
        scene.add(make_surface());
        return scene.settle();
    }();
    return *snapshot;
}

} // namespace isospline::bench
