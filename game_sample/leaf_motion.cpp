#include "leaf_motion.h"

#include <limits>
#include <map>
#include <string>

namespace dimmer::sample {
namespace {

struct Box {
    glm::vec3 low{std::numeric_limits<float>::max()}, high{std::numeric_limits<float>::lowest()};
    void include(const Mesh& mesh) {
        for (const MeshVertex& v : mesh.vertices) {
            const glm::vec3 p(v.position_m[0], v.position_m[1], v.position_m[2]);
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
    }
};

}  // namespace

LeafMotion::LeafMotion(const Pack& pack) : door_(pack.meshes().size()), travel_m_(pack.meshes().size()) {
    std::map<uint32_t, Box> doors;
    std::map<std::pair<uint32_t, std::string>, Box> leaves;
    for (const Mesh& mesh : pack.meshes()) {
        if (!mesh.door) continue;
        doors[*mesh.door].include(mesh);
        leaves[{*mesh.door, mesh.node}].include(mesh);
    }
    for (size_t i = 0; i < pack.meshes().size(); ++i) {
        const Mesh& mesh = pack.meshes()[i];
        if (!mesh.door) continue;
        const Box &leaf = leaves[{*mesh.door, mesh.node}], &door = doors[*mesh.door];
        const glm::vec3 size = leaf.high - leaf.low, apart = (leaf.low + leaf.high) - (door.low + door.high);
        const int along = size.x >= size.z ? 0 : 2;
        door_[i] = Door{*mesh.door};
        travel_m_[i][along] = apart[along] < 0 ? -size[along] : size[along];
    }
}

glm::vec3 LeafMotion::offset(size_t mesh, const LightState& lights) const {
    return door_[mesh] ? travel_m_[mesh] * lights.open(*door_[mesh]) : glm::vec3(0);
}

}  // namespace dimmer::sample
