#include "image_file.h"

#include "output_files.h"

#include <fmt/format.h>

#include <string>

// stb's own code is outside our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace dimmer::sample {

// In memory first: stb's own writing to files does not say when a disk is full.
Expected<void> writePng(const std::filesystem::path& path, uint32_t width, uint32_t height,
                        std::span<const uint8_t> rgb) {
    std::string png;
    const auto take = [](void* into, void* data, int size) {
        static_cast<std::string*>(into)->append(static_cast<const char*>(data), static_cast<size_t>(size));
    };
    const int stride_bytes = static_cast<int>(width) * 3;
    const bool encoded = stbi_write_png_to_func(take, &png, static_cast<int>(width), static_cast<int>(height), 3,
                                                rgb.data(), stride_bytes) != 0;
    if (!encoded) return fail(ErrorCode::OutOfMemory, fmt::format("{}: no memory to encode it.", path.string()));
    return writeFile(path, png);
}

}  // namespace dimmer::sample
