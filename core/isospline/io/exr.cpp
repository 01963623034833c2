#include "isospline/io/exr.h"

#include "isospline/io/atomic_file.h"

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
#include <system_error>
#include <vector>

namespace isospline {

namespace {

/// The channels of a file, each a part of the elements of an array.
class Channels {
public:
    explicit Channels(int width) : width_(static_cast<std::size_t>(width)) {}

    /// Adds the part of an array that begins at its element's byte `offset`.
    template <typename Element>
    void add(const char* name, Imf::PixelType type, const std::vector<Element>& array, std::size_t offset = 0)
    {
        // The library takes pointers to what it only reads.
        char* first = const_cast<char*>(reinterpret_cast<const char*>(array.data()) + offset);
        list_.insert(name, Imf::Channel(type));
        buffer_.insert(name, Imf::Slice(type, first, sizeof(Element), sizeof(Element) * width_));
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
    const std::vector<HalfColor> half_color = options.half ? to_half(image.color) : std::vector<HalfColor>();

    // Channels.
    Channels channels(image.size.x);
    const char* const color_names[] = {"R", "G", "B", "A"};
    for (std::size_t part = 0; part < 4; ++part) {
        if (options.half)
            channels.add(color_names[part], Imf::HALF, half_color, part * sizeof(half));
        else
            channels.add(color_names[part], Imf::FLOAT, image.color, part * sizeof(float));
    }
    channels.add("Z", Imf::FLOAT, image.depth);
    const char* const position_names[] = {"P.X", "P.Y", "P.Z"};
    const char* const normal_names[] = {"N.X", "N.Y", "N.Z"};
    const char* const albedo_names[] = {"albedo.R", "albedo.G", "albedo.B"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        channels.add(position_names[axis], Imf::FLOAT, image.position, axis * sizeof(float));
        channels.add(normal_names[axis], Imf::FLOAT, image.normal, axis * sizeof(float));
        channels.add(albedo_names[axis], Imf::FLOAT, image.albedo, axis * sizeof(float));
    }
    channels.add("gradient_magnitude", Imf::FLOAT, image.gradient_magnitude);
    if (!image.curvature.empty()) {
        channels.add("curvature.mean", Imf::FLOAT, image.curvature);
        channels.add("curvature.gaussian", Imf::FLOAT, image.curvature, sizeof(float));
    }
    if (!image.ambient_occlusion.empty())
        channels.add("ambient_occlusion", Imf::FLOAT, image.ambient_occlusion);
    const char* const direct_names[] = {"direct.R", "direct.G", "direct.B"};
    for (std::size_t part = 0; part < 3 && !image.direct.empty(); ++part)
        channels.add(direct_names[part], Imf::FLOAT, image.direct, part * sizeof(float));
    const char* const variance_names[] = {"variance.R", "variance.G", "variance.B"};
    for (std::size_t part = 0; part < 3 && !image.variance.empty(); ++part)
        channels.add(variance_names[part], Imf::FLOAT, image.variance, part * sizeof(float));
    channels.add("id.geometry", Imf::UINT, image.geometry_ids);
    // OpenEXR has integers of 32 bits only.
    constexpr std::size_t low = std::endian::native == std::endian::little ? 0 : 4;
    channels.add("id.primitive", Imf::UINT, image.primitive_ids, low);
    channels.add("id.primitive_high", Imf::UINT, image.primitive_ids, 4 - low);

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
