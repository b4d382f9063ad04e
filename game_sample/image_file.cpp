#include "image_file.h"

#include <fmt/format.h>

// stb's own code is outside our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace dimmer::sample {

Expected<void> writePng(const std::filesystem::path& path, uint32_t width, uint32_t height,
                        std::span<const uint8_t> rgb) {
    const int stride_bytes = static_cast<int>(width) * 3;
    if (stbi_write_png(path.c_str(), static_cast<int>(width), static_cast<int>(height), 3, rgb.data(), stride_bytes))
        return {};
    return fail(ErrorCode::Io, fmt::format("{}: cannot be written.", path.string()));
}

}  // namespace dimmer::sample
