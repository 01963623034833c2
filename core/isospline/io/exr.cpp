#include "isospline/io/exr.h"

#include "isospline/io/atomic_file.h"
#include "isospline/util/error.h"

#include <Iex.h>
#include <ImathBox.h>
#include <ImathMatrix.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStdIO.h>
#include <half.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <initializer_list>
#include <system_error>
#include <vector>

namespace isospline {

namespace {

/// The channels of a file; each is a component of an array's elements.
class Channels {
public:
    explicit Channels(const Image& image) : width_(image.size.x), first_(image.first) {}

    /// Adds the components of an array's elements, in order; nothing if the array is empty.
    template <typename Element>
    void add(std::initializer_list<const char*> names, Imf::PixelType type, const std::vector<Element>& array)
    {
        if (array.empty())
            return;
        // The library takes mutable pointers to data that it only reads.
        char* part = const_cast<char*>(reinterpret_cast<const char*>(array.data()));
        // Slices begin at pixel (0, 0) of the picture, which need not be in a window of it.
        const auto step = static_cast<std::ptrdiff_t>(sizeof(Element));
        part -= step * (first_.x + width_ * first_.y);
        for (const char* const name : names) {
            list_.insert(name, Imf::Channel(type));
            buffer_.insert(name, Imf::Slice(type, part, sizeof(Element), static_cast<std::size_t>(step * width_)));
            part += sizeof(Element) / names.size();
        }
    }

    const Imf::ChannelList& list() const { return list_; }
    const Imf::FrameBuffer& buffer() const { return buffer_; }

private:
    std::ptrdiff_t width_;
    glm::ivec2 first_;
    Imf::ChannelList list_;
    Imf::FrameBuffer buffer_;
};

/// Imath's matrices map row vectors, ours column vectors: transposed, and stored by rows instead of columns.
Imath::M44f to_imath(const glm::dmat4& map)
{
    Imath::M44f matrix;
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            matrix[column][row] = static_cast<float>(map[column][row]);
    return matrix;
}

struct HalfColor {
    half r, g, b, a;
};

/// The nearest number of 16 bits; those beyond become the largest ones, because infinity would spread to other pixels.
half to_half(float number)
{
    constexpr float largest = HALF_MAX;
    return half(std::clamp(number, -largest, largest));
}

std::vector<HalfColor> to_half(const std::vector<glm::vec4>& color)
{
    std::vector<HalfColor> converted;
    converted.reserve(color.size());
    for (const glm::vec4& c : color)
        converted.push_back({to_half(c.r), to_half(c.g), to_half(c.b), to_half(c.a)});
    return converted;
}

Imf::Header header_of(const Image& image)
{
    const glm::ivec2 last = image.first + image.size - 1;
    const Imath::Box2i display({0, 0}, {image.full_size.x - 1, image.full_size.y - 1});
    const Imath::Box2i data({image.first.x, image.first.y}, {last.x, last.y});
    Imf::Header header(display, data, static_cast<float>(image.pixel_aspect_ratio));
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::addWorldToCamera(header, to_imath(image.world_to_camera));
    if (image.world_to_ndc)
        Imf::addWorldToNDC(header, to_imath(*image.world_to_ndc));
    return header;
}

} // namespace

void write_exr(const Image& image, const std::filesystem::path& path, const ExrOptions& options,
               const Progress& progress)
{
    if (!image.srgb8.empty())
        throw_invalid("image", "one of linear colour", "one of 8-bit sRGB");
    const std::vector<HalfColor> half_color = options.half ? to_half(image.color) : std::vector<HalfColor>();

    // Channels.
    Channels channels(image);
    if (options.half)
        channels.add({"R", "G", "B", "A"}, Imf::HALF, half_color);
    else
        channels.add({"R", "G", "B", "A"}, Imf::FLOAT, image.color);
    channels.add({"Z"}, Imf::FLOAT, image.depth);
    channels.add({"P.X", "P.Y", "P.Z"}, Imf::FLOAT, image.position);
    channels.add({"N.X", "N.Y", "N.Z"}, Imf::FLOAT, image.normal);
    channels.add({"albedo.R", "albedo.G", "albedo.B"}, Imf::FLOAT, image.albedo);
    channels.add({"gradient_magnitude"}, Imf::FLOAT, image.gradient_magnitude);
    channels.add({"curvature.mean", "curvature.gaussian"}, Imf::FLOAT, image.curvature);
    channels.add({"ambient_occlusion"}, Imf::FLOAT, image.ambient_occlusion);
    channels.add({"direct.R", "direct.G", "direct.B"}, Imf::FLOAT, image.direct);
    channels.add({"variance.R", "variance.G", "variance.B"}, Imf::FLOAT, image.variance);
    channels.add({"id.geometry"}, Imf::UINT, image.geometry_ids);
    channels.add({"certified"}, Imf::UINT, image.certified);
    // OpenEXR only has 32-bit integers. The lower halves are the first ones on all machines that isospline supports.
    channels.add({"id.primitive", "id.primitive_high"}, Imf::UINT, image.primitive_ids);

    // The file. OutputFile ignores errors in its destructor; the stream keeps them for commit().
    AtomicFile file(path);
    try {
        Imf::Header header = header_of(image);
        header.channels() = channels.list();
        Imf::StdOFStream stream(file.stream(), path.string().c_str());
        Imf::OutputFile output(stream, header);
        output.setFrameBuffer(channels.buffer());
        constexpr int lines = 16; // the block that ZIP compresses together
        for (int line = 0; line < image.size.y; line += lines) {
            report(progress, static_cast<double>(line) / image.size.y);
            output.writePixels(std::min(lines, image.size.y - line));
        }
    } catch (const Iex::BaseExc& error) {
        const std::error_code reason(file.stream() || errno == 0 ? EIO : errno, std::generic_category());
        throw std::filesystem::filesystem_error(error.what(), path, reason);
    }
    file.commit();
}

} // namespace isospline
