// What the parser passes over or has no words for: values of the wrong type, which it takes for absent ones, and
// extensions that the file requires.
#pragma once

#include <dimmer/error.h>

#include <string>
#include <string_view>

namespace dimmer::cook {

// Of a glTF document that is valid JSON, the properties that the cooker reads. BadInput names the place and the mend.
Expected<void> checkTypes(std::string_view gltf_json, const std::string& file);

}  // namespace dimmer::cook
