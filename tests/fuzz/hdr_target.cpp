// Radiance pictures, whose reader is our own.
#include <fuzz/target.h>
#include <scene/radiance_image.h>

#include <cmath>

namespace dimmer::fuzz {

void runHdr(Input input) {
    const auto header = cook::readRadianceHeader(input);
    if (!header) {
        require(!header.error().empty(), "an error says something");
        return;
    }
    require(header->data <= input.size(), "a header ends within the file");
    constexpr uint64_t texels_max = 1 << 20;  // the importer's own limit is 32 times that
    const uint64_t texels = uint64_t{header->width} * header->height;
    if (texels == 0 || texels > texels_max) return;  // as the importer does
    std::vector<glm::vec4> picture(texels);
    if (!cook::readRadianceTexels(input, *header, picture)) return;
    for (const glm::vec4& t : picture) require(t.x >= 0 && std::isfinite(t.x) && t.a == 1, "texels are light");
}

std::vector<Bytes> hdrSeeds() {
    Bytes flat = bytesOf("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n");
    for (const uint8_t byte : {128, 64, 32, 129, 1, 2, 3, 128}) flat.push_back(byte);
    // A row of 8 texels, each channel one run.
    Bytes runs = bytesOf("#?RGBE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n");
    for (int row = 0; row < 2; ++row)
        for (const uint8_t byte : {2, 2, 0, 8, 136, 10, 136, 20, 136, 30, 136, 129}) runs.push_back(byte);
    // And one of two runs and a part without.
    Bytes mixed = bytesOf("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n");
    for (const uint8_t byte : {2, 2, 0, 8, 132, 1, 4, 1, 2, 3, 4, 136, 9, 136, 9, 136, 128}) mixed.push_back(byte);
    return {flat, runs, mixed};
}

}  // namespace dimmer::fuzz
