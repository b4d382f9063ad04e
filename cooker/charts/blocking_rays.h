// Rays among what walls are made of: a few, for single places.
#pragma once

#include <charts/box_tree.h>
#include <charts/planar.h>

#include <cstdint>
#include <functional>
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
    // Somewhere a ray leaves more solids than it enters: backs in one place with as many faces, as where boxes stand
    // side by side, tell nothing. False where that is in doubt.
    bool startsInSolid(glm::vec3 from, glm::vec3 direction) const;

    // By place among those of the blocking.
    const PlanarFace& face(uint32_t i) const { return faces_[blocking_.faces[i]]; }
    bool isDoubleSided(uint32_t i) const { return blocking_.double_sided[i]; }
    std::vector<uint32_t> touching(const BoxTree::Box& box) const { return boxes_.touching(box); }
    float largestCoordinate() const { return largest_m_; }

   private:
    // What a ray meets at once: faces, and backs of single-sided ones.
    struct Place {
        float at_m;
        int faces, backs;
        bool on_edge;  // of a triangle: its neighbour may be counted as well, or neither
    };
    std::vector<Place> placesAlong(glm::vec3 from, glm::vec3 direction, float end_m) const;
    // Asks `enough` of the places on the way, nearest first, up to farther and farther away.
    void lookAlong(glm::vec3 from, glm::vec3 direction,
                   const std::function<bool(std::span<const Place>)>& enough) const;

    std::span<const PlanarFace> faces_;
    Blocking blocking_;
    BoxTree boxes_;        // of blocking_.faces
    BoxTree::Box level_;   // that holds what blocks
    float largest_m_ = 0;  // coordinate among theirs
};

}  // namespace dimmer::cook
