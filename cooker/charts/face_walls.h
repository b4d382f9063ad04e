// Walls between faces that lie near one another on one surface.
#pragma once

#include <charts/axes.h>
#include <charts/planar.h>
#include <charts/polygon.h>

#include <array>
#include <optional>
#include <vector>

namespace dimmer::cook {

// Closer points are in one place.
inline constexpr float touching_m = 1e-3f;
// Bilinear filtering and padding reach this far.
inline constexpr float filter_reach_texels = 2;
// A surface this high over another one hides it: the points that texels are lit at lie lower (texels.cpp).
inline constexpr float hiding_m = 5e-4f;

// Which faces a wall parts from one. Thread-safe; holds on to what it is made of.
class FaceWalls {
   public:
    struct Reach {
        float near_m;               // faces further off are not asked for
        float largest_m;            // side of the faces that are
        float lowest_m, highest_m;  // of those faces, over the first corner of the one
        float flat_cos = 2;         // what faces along the plane's normal by as much is ground itself, and no wall
    };
    // `axes`: of the plane that walls stand on: the face's own, or level where it slopes.
    FaceWalls(const PlanarFace& face, const Axes& axes, const Reach& reach, const Standing& standing);

    // Nothing stands where a wall would.
    bool none() const { return shadows_ && shadows_->empty(); }
    // A wall stands between the open of the face and that of the other one.
    bool part(const PlanarFace& other) const;

   private:
    std::optional<std::vector<Rect>> shadowsNear(const Standing& standing) const;
    Rect shadowBetween(const std::array<glm::vec3, 3>& triangle, float low, float high) const;
    bool mayPart(Rect a, const Rect& b) const;
    bool between(const PlanarFace& a, const PlanarFace& b) const;
    bool wallBetween(glm::vec3 p, glm::vec3 q) const;
    bool isInWall(glm::vec3 p) const;
    std::array<glm::vec3, 2> outOfWalls(glm::vec3 p, const PlanarFace& face) const;
    glm::vec3 lift(float height_m) const;

    const PlanarFace& face_;
    Axes axes_;
    Reach reach_;
    const Standing& standing_;
    // Of all that stands as high as a wall, where it is in the plane; nothing: there are too many.
    std::optional<std::vector<Rect>> shadows_;
};

glm::vec3 middleOf(const PlanarFace& face);
// On the edges of a face, nearest to a point.
glm::vec3 nearestOnEdges(const PlanarFace& face, glm::vec3 p);

}  // namespace dimmer::cook
