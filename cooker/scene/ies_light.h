// EXT_lights_ies: lights by measured profile, placed in the world.
#pragma once

#include <scene/ies.h>
#include <scene/import_context.h>

#include <map>
#include <memory>

namespace dimmer::cook {

// Whether a node carries a light of this extension.
bool hasLightProfile(const tinygltf::Node& node);

// The file's profiles, each read when the first light asks for it.
class LightProfiles {
   public:
    explicit LightProfiles(ImportContext& context) : context_(context) {}

    // The light of a node that hasLightProfile(): a point light along the node's -Z. Node name, bake mode and light set
    // are left at their defaults.
    Expected<PunctualLight> place(int node, const glm::dmat4& world_from_node);

   private:
    using Profile = std::shared_ptr<const LightProfile>;
    Expected<Profile> profile(int index, const std::string& owner);
    Expected<Profile> read(const tinygltf::Value& source, const std::string& label);

    ImportContext& context_;
    std::map<int, Profile> read_;
};

}  // namespace dimmer::cook
