// Takes over of a glTF document what its nodes still refer to.
#pragma once

#include <tiny_gltf.h>
#include <write/glb_document.h>

namespace dimmer::cook {

// Fills an empty `document` with `original`: meshes that no node names any more go, and with them the accessors, buffer
// views and bytes that nothing else uses; indices are put right. Images come into the buffer, wherever they were;
// EXT_meshopt_compression goes, as what it unpacks to is there as well. Where the document uses extensions that may
// refer to accessors in ways not known here, everything stays. `model`: the same document as parsed, with its buffers
// and images. Throws nlohmann's exceptions for a document whose shape glTF does not allow.
void adoptUsed(GlbDocument& document, GlbDocument::Json original, const tinygltf::Model& model);

}  // namespace dimmer::cook
