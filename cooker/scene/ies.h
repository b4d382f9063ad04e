// Luminous intensity distributions measured from real luminaires: IES LM-63 files, type C photometry.
#pragma once

#include <dimmer/error.h>

#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// Intensity by direction, in the luminaire's frame as EXT_lights_ies maps it: vertical angle 0 (the nadir) is -Z; the
// horizontal angle turns counter-clockwise about +Z, from +X. Dark outside of the vertical angles.
struct LightProfile {
    std::vector<float> vertical_deg;    // ascending, within 0..180
    std::vector<float> horizontal_deg;  // ascending; symmetries are unfolded, so that they span 0..360 at least
    std::vector<float> share;           // of peak_cd, 0..1; all vertical angles of the first horizontal one, and so on
    float peak_cd = 0;                  // with all the factors that the file states
    // A narrow beam, if it has one: cones about an axis, from the narrowest on, outside of which all is darker than a
    // half of the peak, a fifth, and so on; cosines of their half angles, of those below 45 degrees.
    glm::vec3 beam_axis{0, 0, -1};
    std::vector<float> beam_cos = {};

    // Share of the peak towards a unit direction, bilinear in the two angles.
    float shareTowards(glm::vec3 direction) const;
};

struct LightProfileFile {
    LightProfile profile;
    std::vector<std::string> notes;  // what of a usable file was not heeded; "file:line: ..."
};

// Reads LM-63-1986 (no header), IESNA91, IESNA:LM-63-1995, IESNA:LM-63-2002 and IES:LM-63-2019. `file` is for messages
// only: "file:line: ...". TILT's factors are read and left unused, as the extension allows.
Expected<LightProfileFile> parseLightProfile(std::string_view text, const std::string& file);

}  // namespace dimmer::cook
