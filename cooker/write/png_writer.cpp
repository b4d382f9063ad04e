#include <write/png_writer.h>

// stb's own code is outside our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace dimmer::cook {

Expected<std::vector<std::byte>> pngBytes(uint32_t width, uint32_t height, uint32_t channels,
                                          std::span<const uint8_t> pixels) {
    std::vector<std::byte> bytes;
    const auto append = [](void* to, void* data, int size) {
        const auto* first = static_cast<const std::byte*>(data);
        auto& out = *static_cast<std::vector<std::byte>*>(to);
        out.insert(out.end(), first, first + size);
    };
    const int row = static_cast<int>(width * channels);
    if (pixels.size() != size_t{width} * height * channels ||
        !stbi_write_png_to_func(append, &bytes, static_cast<int>(width), static_cast<int>(height),
                                static_cast<int>(channels), pixels.data(), row))
        return fail(ErrorCode::Internal, "a PNG picture could not be made");
    return bytes;
}

}  // namespace dimmer::cook
