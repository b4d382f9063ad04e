// Rays among what walls are made of: a few, for single places.
#pragma once

#include <charts/box_tree.h>
#include <charts/planar.h>

#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// What light does not pass, indices of faces, and whether they block with both sides.
struct Blocking {
    std::vector<uint32_t> faces;  // ascending
    std::vector<bool> double_sided;
};

// The largest of a place's coordinates, by magnitude.
float largestOf(glm::vec3 p);

// Immutable after construction; queries are thread-safe.
class BlockingRays {
   public:
    BlockingRays() = default;
    // `faces` must outlive this.
    BlockingRays(std::span<const PlanarFace> faces, Blocking blocking);

    struct Met {
        float at_m;  // the largest number: nothing
        bool is_back;
    };
    // The first thing on a ray. Where a face and a back touch it is the face that counts, as for rays of light.
    Met meets(glm::vec3 from, glm::vec3 direction) const;

    // By place among those of the blocking.
    const PlanarFace& face(uint32_t i) const { return faces_[blocking_.faces[i]]; }
    bool isDoubleSided(uint32_t i) const { return blocking_.double_sided[i]; }
    std::vector<uint32_t> touching(const BoxTree::Box& box) const { return boxes_.touching(box); }
    float largestCoordinate() const { return largest_m_; }

   private:
    std::span<const PlanarFace> faces_;
    Blocking blocking_;
    BoxTree boxes_;        // of blocking_.faces
    BoxTree::Box level_;   // that holds what blocks
    float largest_m_ = 0;  // coordinate among theirs
};

}  // namespace dimmer::cook
