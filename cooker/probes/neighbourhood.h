// Places in cells, to find those near another one.
#pragma once

#include <trace/ray_scene.h>

#include <array>
#include <glm/glm.hpp>
#include <map>
#include <vector>

namespace dimmer::cook {

class Neighbourhood {
   public:
    explicit Neighbourhood(float cell_m) : cell_m_(cell_m) {}
    void add(glm::vec3 p) { cells_[key(glm::ivec3(glm::floor(p / cell_m_)))].push_back(p); }
    // Whether one stands within `radius_m` (at most the cell's side) and in sight.
    bool anySeen(const RayScene& rays, glm::vec3 p, float radius_m) const {
        const glm::ivec3 centre(glm::floor(p / cell_m_));
        for (int i = 0; i < 27; ++i) {
            const auto found = cells_.find(key(centre + glm::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
            if (found == cells_.end()) continue;
            for (const glm::vec3& q : found->second)
                if (glm::distance(p, q) < radius_m && !rays.blocked(p, q)) return true;
        }
        return false;
    }

   private:
    static std::array<int, 3> key(glm::ivec3 c) { return {c.x, c.y, c.z}; }
    float cell_m_;
    std::map<std::array<int, 3>, std::vector<glm::vec3>> cells_;
};

}  // namespace dimmer::cook
