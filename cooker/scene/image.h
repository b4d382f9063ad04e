// Decoding of the images that materials use.
#pragma once

#include <scene/import_context.h>

namespace dimmer::cook {

enum class TransferFunction { Srgb, Linear };

// Decodes PNG or JPEG, rows from the top. Alpha is always linear. `index` must be in range; `owner` is the material
// that asks.
Expected<Image> decodeImage(const ImportContext& context, int index, TransferFunction transfer,
                            const std::string& owner);

// The mean over all texels.
glm::vec4 meanTexel(const Image& image);

}  // namespace dimmer::cook
