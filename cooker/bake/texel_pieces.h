// What a texel is of: the parts of faces that lie in it.
#pragma once

#include <bake/gather.h>

#include <vector>

namespace dimmer::cook {

// The part of a face in a texel.
struct TexelPiece {
    std::vector<glm::dvec3> corners_m;  // convex, in the face's plane
    uint32_t face = 0;
    glm::dvec3 normal{0};
    double area_m2 = 0;
    glm::dvec3 centre_m{0};  // centre of gravity
};

class TexelPieces {
   public:
    // Of the texel that the points are all of (GatherFrom::texel).
    TexelPieces(const Gatherer& gatherer, const GatherFrom& from);

    // Empty, and an area of 0, where it is not known what the texel is of: of many faces, most of which have no point.
    const std::vector<TexelPiece>& pieces() const { return pieces_; }
    double areaM2() const { return area_m2_; }
    glm::dvec3 centreM() const;  // of gravity
    // Of the pieces that face an eye, as it sees them, sr.
    double solidAngleFrom(glm::dvec3 eye_m) const;

   private:
    void add(const Gatherer& gatherer, uint32_t face, const std::vector<glm::vec2>& polygon_texels);

    std::vector<TexelPiece> pieces_;
    double area_m2_ = 0;
};

}  // namespace dimmer::cook
