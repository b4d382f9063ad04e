#include "image_file.h"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <system_error>

// stb's own code is outside our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace dimmer::sample {

// In memory first: stb's own writing to files does not say when a disk is full. Half a picture is never at `path`.
Expected<void> writePng(const std::filesystem::path& path, uint32_t width, uint32_t height,
                        std::span<const uint8_t> rgb) {
    std::string png;
    const auto take = [](void* into, void* data, int size) {
        static_cast<std::string*>(into)->append(static_cast<const char*>(data), static_cast<size_t>(size));
    };
    const int stride_bytes = static_cast<int>(width) * 3;
    const bool encoded = stbi_write_png_to_func(take, &png, static_cast<int>(width), static_cast<int>(height), 3,
                                                rgb.data(), stride_bytes) != 0;
    const std::filesystem::path part = path.string() + ".part";
    std::ofstream file(part, std::ios::binary);
    file.write(png.data(), static_cast<std::streamsize>(png.size()));
    file.close();
    std::error_code failed;
    if (encoded && file) std::filesystem::rename(part, path, failed);
    if (encoded && file && !failed) return {};
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    return fail(ErrorCode::Io, fmt::format("{}: cannot be written.", path.string()));
}

}  // namespace dimmer::sample
