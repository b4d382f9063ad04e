// Meshes that an export leaves in the file beside what one sees: collision shapes and coarser levels of detail, known
// by the names that engines give them.
#pragma once

#include <scene/import_context.h>

#include <string>
#include <vector>

namespace dimmer::cook {

class Leftovers {
   public:
    // What is baked without having said how, by its node's name or, where that has none, its mesh's.
    void consider(const std::string& name, const std::string& owner);
    // One warning of a kind, however many there are. After all nodes.
    void warn(ImportContext& context) const;

   private:
    struct Detail {
        std::string stem, owner;  // the name without "_LOD1", in small letters
    };
    std::vector<std::string> collision_shapes_;  // owners
    std::vector<Detail> coarser_;
    std::vector<std::string> finest_;  // all others, in small letters and without "_LOD0"
};

}  // namespace dimmer::cook
