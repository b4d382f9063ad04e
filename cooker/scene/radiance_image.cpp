#include <scene/radiance_image.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

namespace dimmer::cook {
namespace {

// Widths that the newer run-length encoding can state.
constexpr uint32_t runs_width_min = 8, runs_width_max = 32767;

using Rgbe = glm::u8vec4;

// A shared exponent, biased by 128, over mantissas of 8 bits (G. Ward, Real Pixels, Graphics Gems II).
glm::vec4 decode(Rgbe t) {
    if (t.a == 0) return {0, 0, 0, 1};
    const float scale = std::ldexp(1.0f, int{t.a} - (128 + 8));
    return {glm::vec3(t) * scale, 1};
}

class Scanlines {
   public:
    Scanlines(std::span<const unsigned char> bytes, uint32_t width) : bytes_(bytes), row_(width) {}

    bool next() {
        const auto width = static_cast<uint32_t>(row_.size());
        const bool runs = width >= runs_width_min && width <= runs_width_max && bytes_.size() >= 4 && bytes_[0] == 2 &&
                          bytes_[1] == 2 && (uint32_t{bytes_[2]} << 8 | bytes_[3]) == width;
        if (!runs) return texelByTexel();
        bytes_ = bytes_.subspan(4);
        for (int channel = 0; channel < 4; ++channel)
            if (!channelInRuns(channel)) return false;
        return true;
    }
    const std::vector<Rgbe>& row() const { return row_; }

   private:
    bool channelInRuns(int channel) {
        for (size_t x = 0; x < row_.size();) {
            if (bytes_.size() < 2) return false;
            const bool repeat = bytes_[0] > 128;
            const size_t count = repeat ? bytes_[0] - 128 : bytes_[0], taken = repeat ? 1 : count;
            if (count == 0 || count > row_.size() - x || bytes_.size() < 1 + taken) return false;
            for (size_t i = 0; i < count; ++i) row_[x + i][channel] = bytes_[repeat ? 1 : 1 + i];
            x += count;
            bytes_ = bytes_.subspan(1 + taken);
        }
        return true;
    }

    // Plain texels; one with three mantissas of 1 repeats the texel before it, in the older encoding.
    bool texelByTexel() {
        int shift = 0;
        for (size_t x = 0; x < row_.size();) {
            if (bytes_.size() < 4) return false;
            const Rgbe texel(bytes_[0], bytes_[1], bytes_[2], bytes_[3]);
            bytes_ = bytes_.subspan(4);
            if (texel.r != 1 || texel.g != 1 || texel.b != 1) {
                row_[x++] = texel;
                shift = 0;
                continue;
            }
            const size_t count = shift < 24 ? size_t{texel.a} << shift : 0;
            if (x == 0 || count > row_.size() - x) return false;
            for (size_t i = 0; i < count; ++i) row_[x + i] = row_[x - 1];
            x += count;
            shift += 8;
        }
        return true;
    }

    std::span<const unsigned char> bytes_;
    std::vector<Rgbe> row_;
};

// "-Y 512 +X 1024": rows from the top, columns from the left.
bool parseSize(std::string_view line, RadianceHeader& header) {
    const auto part = [&](std::string_view prefix, uint32_t& value) {
        if (!line.starts_with(prefix)) return false;
        line.remove_prefix(prefix.size());
        const auto [end, problem] = std::from_chars(line.data(), line.data() + line.size(), value);
        line.remove_prefix(static_cast<size_t>(end - line.data()));
        return problem == std::errc();
    };
    return part("-Y ", header.height) && part(" +X ", header.width) && line.empty();
}

}  // namespace

std::expected<RadianceHeader, std::string> readRadianceHeader(std::span<const unsigned char> bytes) {
    std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto nextLine = [&] {
        const std::string_view line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(line.size() + 1, rest.size()));
        return line;
    };
    for (std::string_view line = nextLine(); !line.empty(); line = nextLine())
        if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
            return std::unexpected("is not a picture of RGB radiance. Save it as 32-bit_rle_rgbe.");
    RadianceHeader header;
    if (!parseSize(nextLine(), header))
        return std::unexpected("is a damaged Radiance picture, or one that is turned. Save it again.");
    header.data = bytes.size() - rest.size();
    return header;
}

bool readRadianceTexels(std::span<const unsigned char> bytes, const RadianceHeader& header,
                        std::span<glm::vec4> texels) {
    Scanlines lines(bytes.subspan(header.data), header.width);
    for (uint32_t y = 0; y < header.height; ++y) {
        if (!lines.next()) return false;
        for (uint32_t x = 0; x < header.width; ++x) texels[size_t{y} * header.width + x] = decode(lines.row()[x]);
    }
    return true;
}

}  // namespace dimmer::cook
