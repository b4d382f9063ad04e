#include <scene/sky.h>

#include <scene/gltf_file.h>
#include <scene/radiance_image.h>

#include <ImfChannelList.h>
#include <ImfChromaticities.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

namespace dimmer::cook {
namespace {

// 8192 x 4096: a sky of that size is half a gibibyte in memory, and finer than any bake can tell.
constexpr uint64_t sky_texels_max = uint64_t{1} << 25;

constexpr int exr_side_max = 65536;

std::unexpected<Error> refuse(const std::string& file, std::string_view what) {
    return fail(ErrorCode::BadInput, fmt::format("{}: {}", file, what));
}

Expected<Image> sized(int64_t width, int64_t height, const std::string& file) {
    if (width < 1 || height < 1 || static_cast<uint64_t>(width) > sky_texels_max ||
        static_cast<uint64_t>(width) * static_cast<uint64_t>(height) > sky_texels_max)
        return refuse(file, fmt::format("has {} x {} texels. Scale it to 8192 x 4096 or less.", width, height));
    Image image{static_cast<uint32_t>(width), static_cast<uint32_t>(height), {}};
    image.texels.resize(size_t{image.width} * image.height, glm::vec4(0, 0, 0, 1));
    return image;
}

Expected<Image> decodeRadiance(std::span<const unsigned char> bytes, const std::string& file) {
    const auto header = readRadianceHeader(bytes);
    if (!header) return refuse(file, header.error());
    auto image = sized(header->width, header->height, file);
    if (image && !readRadianceTexels(bytes, *header, image->texels))
        return refuse(file, "is a damaged or truncated Radiance picture. Save or copy it again.");
    return image;
}

// OpenEXR reads from streams of its own kind.
class MemoryInput : public Imf::IStream {
   public:
    MemoryInput(std::span<const unsigned char> bytes, const std::string& file)
        : Imf::IStream(file.c_str()), bytes_(bytes) {}
    bool read(char to[], int count) override {
        if (count < 0 || static_cast<size_t>(count) > bytes_.size() - at_)
            throw std::runtime_error("the file ends too early");
        std::memcpy(to, bytes_.data() + at_, static_cast<size_t>(count));
        at_ += static_cast<size_t>(count);
        return at_ < bytes_.size();
    }
    uint64_t tellg() override { return at_; }
    void seekg(uint64_t position) override { at_ = std::min<uint64_t>(position, bytes_.size()); }

   private:
    std::span<const unsigned char> bytes_;
    size_t at_ = 0;
};

Expected<Image> sized(const Imath::Box2i& window, const std::string& file) {
    return sized(int64_t{window.max.x} - window.min.x + 1, int64_t{window.max.y} - window.min.y + 1, file);
}

// The picture is what is displayed: files may keep less of it, where the rest is black, or more.
Expected<Image> displayed(Image kept, const Imath::Box2i& window, const Imath::Box2i& display,
                          const std::string& file) {
    if (window == display) return kept;
    auto image = sized(display, file);
    if (!image) return image;
    const int64_t first_x = std::max(window.min.x, display.min.x), last_x = std::min(window.max.x, display.max.x);
    const int64_t first_y = std::max(window.min.y, display.min.y), last_y = std::min(window.max.y, display.max.y);
    if (last_x < first_x) return image;
    for (int64_t y = first_y; y <= last_y; ++y)
        std::copy_n(kept.texels.begin() + (y - window.min.y) * kept.width + (first_x - window.min.x),
                    last_x - first_x + 1,
                    image->texels.begin() + (y - display.min.y) * image->width + (first_x - display.min.x));
    return image;
}

// To Rec.709, where the file's primaries are others (ACES, say). What lies outside of it becomes negative.
void toRec709(const Imf::Header& header, Image& image) {
    if (!Imf::hasChromaticities(header)) return;
    const Imf::Chromaticities own = Imf::chromaticities(header), rec709;  // the library's default
    if (own == rec709) return;
    const Imath::M44f to_709 = Imf::RGBtoXYZ(own, 1) * Imf::XYZtoRGB(rec709, 1);
    for (glm::vec4& texel : image.texels) {
        const Imath::V3f rgb = Imath::V3f(texel.x, texel.y, texel.z) * to_709;
        texel = {rgb.x, rgb.y, rgb.z, texel.w};
    }
}

Expected<Image> decodeOpenExr(std::span<const unsigned char> bytes, const std::string& file) {
    try {
        // A hostile header must not make the library reserve a table of four billion rows.
        Imf::Header::setMaxImageSize(exr_side_max, exr_side_max);
        MemoryInput stream(bytes, file);
        Imf::InputFile input(stream, 0);
        const Imath::Box2i window = input.header().dataWindow();
        for (const char* name : {"R", "G", "B"})
            if (!input.header().channels().findChannel(name))
                return refuse(file, "has no channels R, G and B. Save it as a plain RGB image.");
        auto image = sized(window, file);
        if (!image) return image;
        // A slice's base is where texel (0, 0) would lie, which the window need not hold: unsigned arithmetic wraps.
        const size_t row_bytes = image->width * sizeof(glm::vec4);
        const auto first = reinterpret_cast<uintptr_t>(image->texels.data());
        const uintptr_t origin = first - static_cast<uintptr_t>(int64_t{window.min.x}) * sizeof(glm::vec4) -
                                 static_cast<uintptr_t>(int64_t{window.min.y}) * row_bytes;
        Imf::FrameBuffer frame;
        for (size_t c = 0; const char* name : {"R", "G", "B"})
            frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(origin + sizeof(float) * c++),
                                          sizeof(glm::vec4), row_bytes));
        input.setFrameBuffer(frame);
        input.readPixels(window.min.y, window.max.y);
        toRec709(input.header(), *image);
        return displayed(std::move(*image), window, input.header().displayWindow(), file);
    } catch (const std::bad_alloc&) {
        throw;  // importLevel says what that means
    } catch (const std::exception& problem) {
        return refuse(file, fmt::format("is a damaged OpenEXR image ({}). Save it again.", problem.what()));
    }
}

Expected<void> clean(Image& image, const std::string& file) {
    for (glm::vec4& texel : image.texels)
        for (int c = 0; c < 3; ++c) {
            if (!isFiniteFloat(static_cast<double>(texel[c])))
                return refuse(file, "holds NaN or infinite values. Clamp them and save it again.");
            texel[c] = std::max(texel[c], 0.0f);  // resampling filters leave small negative lobes
        }
    return {};
}

float largest(const Image& image) {
    float most = 0;
    for (const glm::vec4& t : image.texels) most = std::max(most, std::max(t.x, std::max(t.y, t.z)));
    return most;
}

}  // namespace

Expected<Image> readSkyImage(const std::filesystem::path& path) {
    const std::string file = path.string();
    const auto bytes = readFile(path);
    if (!bytes) return std::unexpected(bytes.error());
    const auto startsWith = [&](std::string_view magic) {
        return bytes->size() >= magic.size() && std::memcmp(bytes->data(), magic.data(), magic.size()) == 0;
    };
    const bool radiance = startsWith("#?"), openexr = startsWith("\x76\x2f\x31\x01");
    if (!radiance && !openexr) return refuse(file, "is neither Radiance (.hdr) nor OpenEXR (.exr). Convert it.");
    auto image = radiance ? decodeRadiance(*bytes, file) : decodeOpenExr(*bytes, file);
    if (!image) return image;
    if (const auto ok = clean(*image, file); !ok) return std::unexpected(ok.error());
    return image;
}

Expected<void> importSky(ImportContext& context, const Extras& extras) {
    Scene& scene = context.scene;
    const auto color = extras.numbers("dimmer_sky_color", 3);
    if (!color) return std::unexpected(color.error());
    const auto luminance = extras.number("dimmer_sky_luminance");
    if (!luminance) return std::unexpected(luminance.error());
    const auto name = extras.text("dimmer_sky_image");
    if (!name) return std::unexpected(name.error());
    if (!*name && color->has_value() != luminance->has_value()) {
        context.warn("scene", "the sky needs both 'dimmer_sky_color' and 'dimmer_sky_luminance'; it stays black.");
        return {};
    }
    if (!*name && !*color) return {};
    glm::dvec3 c(1);
    if (*color) c = {(**color)[0], (**color)[1], (**color)[2]};
    const double cd_m2 = luminance->value_or(1);
    double brightest = 1;
    if (*name) {
        auto image = readSkyImage(std::filesystem::path(scene.file).parent_path() / **name);
        if (!image) return context.error("scene", "'dimmer_sky_image': " + image.error().message);
        brightest = static_cast<double>(largest(*image));
        scene.sky_image = std::make_shared<const Image>(std::move(*image));
    }
    if (!isFinite(c * cd_m2) || !isFinite(c * cd_m2 * brightest) || cd_m2 < 0 ||
        glm::any(glm::lessThan(c, glm::dvec3(0))))
        return context.error("scene",
                             "'dimmer_sky_color' times 'dimmer_sky_luminance' is negative or infinite. Correct them.");
    scene.sky_radiance_cd_m2 = c * cd_m2;
    return {};
}

}  // namespace dimmer::cook
