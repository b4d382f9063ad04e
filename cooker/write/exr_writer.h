// OpenEXR pictures of 32-bit floats.
#pragma once

#include <dimmer/error.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace dimmer::cook {

struct ExrChannel {
    std::string name;           // "R", "direction.x"
    std::vector<float> values;  // of the window, rows from the top
};

// A window of a picture: outside of it there is nothing.
struct ExrPicture {
    uint32_t width = 0, height = 0;  // of the whole picture, 1 or more
    uint32_t x = 0, y = 0, window_width = 0, window_height = 0;
    std::vector<ExrChannel> channels;
};

// The file's bytes, ZIP-compressed; the same picture gives the same bytes.
Expected<std::vector<std::byte>> exrBytes(const ExrPicture& picture);

}  // namespace dimmer::cook
