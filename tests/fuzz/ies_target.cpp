// Luminaires (IES LM-63).
#include <fuzz/target.h>
#include <scene/ies.h>

#include <cmath>

namespace dimmer::fuzz {

void runIes(Input input) {
    const auto file = cook::parseLightProfile(textOf(input), "fuzz.ies");
    if (!file) {
        require(file.error().message.find("fuzz.ies") != std::string::npos, "an error names the file");
        return;
    }
    const cook::LightProfile& profile = file->profile;
    require(std::isfinite(profile.peak_cd) && profile.peak_cd >= 0, "the peak is an intensity");
    require(profile.share.size() == profile.vertical_deg.size() * profile.horizontal_deg.size(), "a share per angle");
    for (int i = 0; i < 32; ++i) {
        const float z = static_cast<float>(i) / 15.5f - 1, turn = static_cast<float>(i) * 2.4f;
        const float r = std::sqrt(std::max(0.0f, 1 - z * z));
        const float share = profile.shareTowards({r * std::cos(turn), r * std::sin(turn), z});
        require(share >= 0 && share <= 1.0001f, "a share is within 0 and 1");
    }
}

std::vector<Bytes> iesSeeds() {
    std::vector<Bytes> seeds;
    for (const char* text :
         {"IESNA:LM-63-2002\n[TEST] none\n[MORE] x\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 20\n0 45 90\n0\n100 60 10\n",
          "IESNA91\nTILT=INCLUDE\n1\n2\n0 90\n1 0.8\n1 1000 1.5 2 3 1 1 .1 .2 .3\n1 1 20\n0 180\n0 45 90\n1 2\n3 4\n5 "
          "6\n",
          "my lamp\nTILT=NONE\n1 -1 1 2 5 1 2 0 0 0\n1, 0.9, 20\n0 90\n0 45 90 135 180\n1 2 3 4 5 6 7 8 9 10\n",
          "IES:LM-63-2019\r\n[TESTLAB] x\r\nTILT=NONE\r\n1 -1 1 2 5 1 2 0 0 0\r\n1 1 20\r\n90 180\r\n0 90 180 270 "
          "360\r\n"
          "1 2 3 4 5 6 7 8 1 2\r\n",
          "IESNA:LM-63-1995\nTILT=lamp.tlt\n1 -1 1 2 1 2 1 0 0 0\n1 1 20\n0 90\n0\n1 2\n"})
        seeds.push_back(bytesOf(text));
    return seeds;
}

}  // namespace dimmer::fuzz
