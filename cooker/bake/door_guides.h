// Where rays should look for the light that a door lets through: at the door itself, and at the patches that lamps
// light through it (UBERBAKE, section 4.2: shadow photons from the door to lights and back, clustered into boxes).
#pragma once

#include <trace/ray_scene.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// A box along the axes of its guide, and how much of the light through the door lands in it: arbitrary units.
struct GuideBox {
    glm::vec3 low{0}, high{0};
    float flux = 0;
};

// A whole register: more made no light less noisy. Leaves of one name that stand apart have boxes of their own.
inline constexpr uint32_t guide_boxes_max = 8, leaf_boxes_max = 4;

struct GuideBoxes {
    glm::mat3 world_from_box{1};  // a rotation: along the door's leaves
    uint32_t leaves = 0;          // so many boxes of leaves come first, then those of patches
    std::vector<GuideBox> boxes;
};

inline constexpr uint32_t no_guide = UINT32_MAX;
inline constexpr uint32_t shared_guide = UINT32_MAX;  // in place of a light group

// A guide for every door, and another one for every light group whose own lamps shine through it: what one group's rays
// look at depends on no other's lamps. Immutable after construction.
class DoorGuides {
   public:
    explicit DoorGuides(const RayScene& rays);
    // For light of `group` over paths about `door` alone.
    uint32_t guideOf(uint32_t door, uint32_t group) const { return guide_of_[door * group_count_ + group]; }
    const GuideBoxes& boxes(uint32_t guide) const { return boxes_[guide]; }
    // Whose light alone asks for it; shared_guide: of several groups.
    uint32_t ownGroup(uint32_t guide) const {
        return guide < door_count_ ? shared_guide : group_of_[guide - door_count_];
    }
    // For seeds.
    uint32_t identity(uint32_t guide) const { return identity_[guide]; }

   private:
    uint32_t group_count_ = 1, door_count_ = 0;
    std::vector<uint32_t> guide_of_;  // door, group
    std::vector<GuideBoxes> boxes_;   // per guide; those of doors alone come first
    std::vector<uint32_t> group_of_;  // per guide with patches
    std::vector<uint32_t> identity_;  // per guide
};

// Directions from one point towards a door's boxes: a mixture over boxes, over the sides of a box that face the point,
// uniform over a side. From outside a box, every direction into it passes exactly one such side.
class Guide {
   public:
    // `normal`: boxes below its horizon are left out; zero: none are.
    Guide(const GuideBoxes& boxes, glm::vec3 point, glm::vec3 normal);
    // Nothing in sight: no box lies above the horizon, or the point is inside of all that do.
    bool empty() const { return count_ == 0; }
    // Unit direction; `choice` picks box and side, `u` the place on it; all in [0, 1).
    glm::vec3 sample(float choice, glm::vec2 u) const;
    // Per steradian.
    float pdf(glm::vec3 direction) const;

   private:
    using PerTarget = std::array<float, guide_boxes_max>;

    // Of every box: its corners, from the point; its chance; by axis, the chance within the box of the side across it,
    // and the density on that side per area, over all.
    glm::mat3 world_from_box_;
    uint32_t count_ = 0;
    std::array<PerTarget, 3> low_{}, high_{}, side_chance_, density_m2_{};
    PerTarget chance_;
};

}  // namespace dimmer::cook
