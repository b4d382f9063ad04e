// Radiance pictures (.hdr). A reader of our own: stb_image of 2022 never ends on a file that is cut off inside a run.
#pragma once

#include <dimmer/error.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

// A picture's size, and where its scanlines begin.
struct RadianceHeader {
    uint32_t width = 0, height = 0;
    size_t data = 0;
};

// Errors say what is wrong, without the file's name. EXPOSURE is left alone, as renderers do.
std::expected<RadianceHeader, std::string> readRadianceHeader(std::span<const unsigned char> bytes);

// Fills width x height texels (alpha 1), rows from the top. False when the file ends early or a run does not fit.
bool readRadianceTexels(std::span<const unsigned char> bytes, const RadianceHeader& header,
                        std::span<glm::vec4> texels);

}  // namespace dimmer::cook
