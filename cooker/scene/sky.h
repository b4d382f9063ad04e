// The sky's keys of the scene, and its image.
#pragma once

#include <scene/extras.h>

#include <filesystem>

namespace dimmer::cook {

// Reads `dimmer_sky_color`, `dimmer_sky_luminance` and `dimmer_sky_image` into the scene.
Expected<void> importSky(ImportContext& context, const Extras& extras);

// Reads a Radiance (.hdr) or OpenEXR file, told apart by content: linear Rec.709, rows from the top. Texels are finite
// and not negative. Errors name the file.
Expected<Image> readSkyImage(const std::filesystem::path& path);

}  // namespace dimmer::cook
