// What every step of the import shares: the parsed file, the scene under construction, and the wording of messages.
#pragma once

#include <scene/scene.h>
#include <tiny_gltf.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <string_view>

namespace dimmer::cook {

struct ImportContext {
    const tinygltf::Model& model;
    Scene& scene;

    // "file: owner: text". `text` says what is wrong and how to mend it; `owner` comes from the functions below.
    std::unexpected<Error> error(std::string_view owner, std::string_view text) const;
    // One line for all owners of the same text, of whom it names the first few: a kit's part stands in hundreds of
    // places.
    void warn(std::string_view owner, std::string_view text);

    // "node 'lamp'", or "node 7" when it has no name. The index must be in range.
    std::string nodeLabel(int index) const;
    std::string meshLabel(int index) const;
    std::string materialLabel(int index) const;
    std::string lightLabel(int index) const;
    std::string cameraLabel(int index) const;
    std::string imageLabel(int index) const;

    bool uses(std::string_view extension) const;

    struct Warned {
        size_t line;  // of scene.warnings
        size_t owners = 0;
        std::string names = {};
    };
    std::map<std::string, Warned, std::less<>> warned = {};  // by text
};

// A glTF number is a double; the scene's are floats. Too large for a float counts as infinite.
inline bool isFiniteFloat(double value) {
    return std::isfinite(static_cast<float>(value));
}

inline bool isFinite(glm::dvec3 v) {
    return isFiniteFloat(v.x) && isFiniteFloat(v.y) && isFiniteFloat(v.z);
}

}  // namespace dimmer::cook
