// Decoding of the images that materials use.
#pragma once

#include <scene/import_context.h>

namespace dimmer::cook {

// Decodes PNG or JPEG, rows from the top. Alpha is always linear. `index` must be in range; `owner` is the material
// that asks.
Expected<Texture> decodeImage(const ImportContext& context, int index, TransferFunction transfer,
                              const std::string& owner);

}  // namespace dimmer::cook
