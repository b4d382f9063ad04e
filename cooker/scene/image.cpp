#include <fmt/format.h>
#include <scene/image.h>
#include <stb/stb_image.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <span>

namespace dimmer::cook {
namespace {

// 8192 x 8192: 256 MiB, and what GPUs handle everywhere.
constexpr uint64_t image_texels_max = uint64_t{1} << 26;

// Of the encoded bytes: deflate packs at most 1032 bytes into one (RFC 1951), and a byte of PNG at most 8 texels.
// Without it a header alone would have hundreds of megabytes reserved.
constexpr uint64_t texels_per_byte_max = 1032 * 8;

// IEC 61966-2-1.
float linearFromSrgb(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

using DecodeTable = std::array<float, 256>;

DecodeTable makeTable(TransferFunction transfer) {
    DecodeTable table{};
    for (size_t i = 0; i < table.size(); ++i) {
        const float encoded = static_cast<float>(i) / 255.0f;
        table[i] = transfer == TransferFunction::Srgb ? linearFromSrgb(encoded) : encoded;
    }
    return table;
}

const DecodeTable& decodeTable(TransferFunction transfer) {
    static const std::array tables = {makeTable(TransferFunction::Srgb), makeTable(TransferFunction::Linear)};
    return tables[transfer == TransferFunction::Srgb ? 0 : 1];
}

glm::vec4 decoded(const DecodeTable& table, glm::u8vec4 texel) {
    return {table[texel.r], table[texel.g], table[texel.b], static_cast<float>(texel.a) / 255.0f};
}

// The encoded bytes; the buffer view's range was checked by checkModel.
std::span<const unsigned char> encodedBytes(const tinygltf::Model& model, const tinygltf::Image& image) {
    if (image.bufferView < 0) return image.image;
    const tinygltf::BufferView& view = model.bufferViews[static_cast<size_t>(image.bufferView)];
    return std::span(model.buffers[static_cast<size_t>(view.buffer)].data).subspan(view.byteOffset, view.byteLength);
}

bool isPngOrJpeg(std::span<const unsigned char> bytes) {
    const bool png = bytes.size() > 8 && bytes[0] == 0x89 && bytes[1] == 'P' && bytes[2] == 'N' && bytes[3] == 'G';
    return png || (bytes.size() > 3 && bytes[0] == 0xFF && bytes[1] == 0xD8 && bytes[2] == 0xFF);
}

constexpr size_t png_signature_bytes = 8;

// Whether every chunk of a PNG ends within it: the decoder reserves what a chunk claims before it looks. True of
// others.
bool pngChunksFit(std::span<const unsigned char> bytes) {
    if (bytes.size() < png_signature_bytes || bytes[0] != 0x89) return true;
    constexpr size_t frame_bytes = 12;  // length, type, checksum
    for (size_t at = png_signature_bytes; at + frame_bytes <= bytes.size();) {
        const uint64_t length = uint64_t{bytes[at]} << 24 | bytes[at + 1] << 16 | bytes[at + 2] << 8 | bytes[at + 3];
        if (length > bytes.size() - at - frame_bytes) return false;
        if (bytes[at + 4] == 'I' && bytes[at + 5] == 'E') return true;  // IEND; what follows is nobody's
        at += frame_bytes + length;
    }
    return true;
}

// Texel coordinates wrapped into 0..size-1.
uint32_t wrap(float coordinate, uint32_t size) {
    const float wrapped = coordinate - std::floor(coordinate / static_cast<float>(size)) * static_cast<float>(size);
    return std::min(static_cast<uint32_t>(std::max(wrapped, 0.0f)), size - 1);
}

}  // namespace

glm::vec4 Texture::sample(glm::vec2 uv) const {
    if (texels.empty()) return glm::vec4(1);
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = glm::vec2(0);
    uv -= glm::floor(uv);  // first, so that large coordinates keep their fraction's precision
    const float x = uv.x * static_cast<float>(width) - 0.5f, y = uv.y * static_cast<float>(height) - 0.5f;
    const float x0 = std::floor(x), y0 = std::floor(y);
    const uint32_t left = wrap(x0, width), right = wrap(x0 + 1, width);
    const uint32_t top = wrap(y0, height), bottom = wrap(y0 + 1, height);
    const DecodeTable& table = decodeTable(transfer);
    const auto texel = [&](uint32_t column, uint32_t row) {
        return decoded(table, texels[size_t{row} * width + column]);
    };
    return glm::mix(glm::mix(texel(left, top), texel(right, top), x - x0),
                    glm::mix(texel(left, bottom), texel(right, bottom), x - x0), y - y0);
}

glm::vec4 Texture::mean() const {
    const DecodeTable& table = decodeTable(transfer);
    glm::dvec4 sum(0);
    for (const glm::u8vec4 texel : texels) sum += glm::dvec4(decoded(table, texel));
    return glm::vec4(sum / static_cast<double>(std::max<size_t>(texels.size(), 1)));
}

Expected<Texture> decodeImage(const ImportContext& context, int index, TransferFunction transfer,
                              const std::string& owner) {
    const tinygltf::Image& source = context.model.images[static_cast<size_t>(index)];
    const bool is_data = source.uri.starts_with("data:");
    const std::string label =
        context.imageLabel(index) + (source.uri.empty() || is_data ? "" : " (" + source.uri + ")");
    const std::span<const unsigned char> bytes = encodedBytes(context.model, source);
    if (bytes.empty() && is_data)
        return context.error(owner, label + " is a data URI that is not base64. Export the level again.");
    if (bytes.empty())
        return context.error(owner,
                             label + " cannot be read. Put it beside the level, or export the level with its images.");
    if (!isPngOrJpeg(bytes))
        return context.error(owner, label + " is neither PNG nor JPEG. Convert it and export the level again.");

    const auto size = static_cast<int>(std::min<size_t>(bytes.size(), std::numeric_limits<int>::max()));
    int width = 0, height = 0, channels = 0;
    bool known = stbi_info_from_memory(bytes.data(), size, &width, &height, &channels) != 0;
    const uint64_t texels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
    if (known && texels > image_texels_max)
        return context.error(
            owner, fmt::format("{} has {} x {} texels. Scale it to 8192 x 8192 or less.", label, width, height));
    known = known && texels <= texels_per_byte_max * bytes.size() && pngChunksFit(bytes);
    const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
        known ? stbi_load_from_memory(bytes.data(), size, &width, &height, &channels, 4) : nullptr, stbi_image_free);
    if (!pixels || width < 1 || height < 1)
        return context.error(owner, label + " is damaged. Save it again and export the level again.");

    Texture texture{static_cast<uint32_t>(width), static_cast<uint32_t>(height), transfer, {}};
    texture.texels.resize(size_t{texture.width} * texture.height);
    static_assert(sizeof(glm::u8vec4) == 4);
    std::memcpy(texture.texels.data(), pixels.get(), 4 * texture.texels.size());
    return texture;
}

}  // namespace dimmer::cook
