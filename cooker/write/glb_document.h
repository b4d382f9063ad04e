// A glTF document with one buffer, to be written as GLB.
#pragma once

#include <dimmer/error.h>

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

class GlbDocument {
   public:
    using Json = nlohmann::ordered_json;

    Json json;

    // Copies bytes into the buffer, at a multiple of 4. `target`: 34962 vertices, 34963 indices, 0 neither. The index
    // of the new buffer view.
    size_t addView(std::span<const std::byte> bytes, int target = 0);
    // Floats, `components` (2 or 3) to an element; with their least and largest, as POSITION needs them.
    size_t addVectors(std::span<const float> values, size_t components, bool with_bounds = false);
    // Corners of triangles.
    size_t addIndices(std::span<const uint32_t> values);

    // The file. Arrays of the document that are empty are left out, as glTF wants it. An error above `bytes_max`: the
    // format counts in 32 bits.
    Expected<std::vector<std::byte>> bytes(uint64_t bytes_max = UINT32_MAX);

   private:
    std::vector<std::byte> buffer_;
};

}  // namespace dimmer::cook
