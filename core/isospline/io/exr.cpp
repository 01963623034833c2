#include "isospline/io/exr.h"

#include "isospline/io/atomic_file.h"
#include "isospline/util/error.h"

#include <Iex.h>
#include <ImathMatrix.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStdIO.h>
#include <half.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <initializer_list>
#include <system_error>
#include <vector>

namespace isospline {

namespace {

/// The channels of a file, each a part of the elements of an array.
class Channels {
public:
    explicit Channels(int width) : width_(static_cast<std::size_t>(width)) {}

    /// Adds the parts of an array's elements, in their order; nothing where the array is empty.
    template <typename Element>
    void add(std::initializer_list<const char*> names, Imf::PixelType type, const std::vector<Element>& array)
    {
        if (array.empty())
            return;
        // The library takes pointers to what it only reads.
        char* part = const_cast<char*>(reinterpret_cast<const char*>(array.data()));
        for (const char* const name : names) {
            list_.insert(name, Imf::Channel(type));
            buffer_.insert(name, Imf::Slice(type, part, sizeof(Element), sizeof(Element) * width_));
            part += sizeof(Element) / names.size();
        }
    }

    const Imf::ChannelList& list() const { return list_; }
    const Imf::FrameBuffer& buffer() const { return buffer_; }

private:
    std::size_t width_;
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

std::vector<HalfColor> to_half(const std::vector<glm::vec4>& color)
{
    std::vector<HalfColor> converted;
    converted.reserve(color.size());
    for (const glm::vec4& c : color)
        converted.push_back({half(c.r), half(c.g), half(c.b), half(c.a)});
    return converted;
}

Imf::Header header_of(const Image& image)
{
    Imf::Header header(image.size.x, image.size.y, static_cast<float>(image.pixel_aspect_ratio));
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
    Channels channels(image.size.x);
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
    // OpenEXR has integers of 32 bits only.
    if (std::endian::native == std::endian::little)
        channels.add({"id.primitive", "id.primitive_high"}, Imf::UINT, image.primitive_ids);
    else
        channels.add({"id.primitive_high", "id.primitive"}, Imf::UINT, image.primitive_ids);

    // The file. OutputFile swallows errors in its destructor, which the stream keeps for commit().
    AtomicFile file(path);
    try {
        Imf::Header header = header_of(image);
        header.channels() = channels.list();
        Imf::StdOFStream stream(file.stream(), path.string().c_str());
        Imf::OutputFile output(stream, header);
        output.setFrameBuffer(channels.buffer());
        constexpr int lines = 16; // that ZIP compresses together
        for (int line = 0; line < image.size.y; line += lines) {
            if (progress && !progress(static_cast<double>(line) / image.size.y))
                throw Cancelled();
            output.writePixels(std::min(lines, image.size.y - line));
        }
    } catch (const Iex::BaseExc& error) {
        const std::error_code reason(file.stream() || errno == 0 ? EIO : errno, std::generic_category());
        throw std::filesystem::filesystem_error(error.what(), path, reason);
    }
    file.commit();
}

} // namespace isospline
