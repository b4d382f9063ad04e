// Validates a parsed document before anything follows its indices.
#pragma once

#include <scene/import_context.h>

namespace dimmer::cook {

// Every index is in range, every buffer view inside its buffer, every node has one parent and no node is its own
// ancestor. Accessors are checked where they are read (accessor.h).
Expected<void> checkModel(const ImportContext& context);

// One that the cooker reads.
bool isKnownExtension(std::string_view name);

// Warns of extensions that are used, and ignored at a loss.
void warnOfExtensions(ImportContext& context);

// Warns of scenes that are not the level's.
void warnOfOtherScenes(ImportContext& context);

// The light that a node refers to; empty when none. Valid after checkModel.
std::optional<int> lightOf(const tinygltf::Node& node);

}  // namespace dimmer::cook
