#include <bake/texel_pieces.h>

#include <charts/raster.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// Faces with points that make up less of a texel are not all that it is of.
constexpr float covered_min = 0.99f;

// As it is seen from `eye` (Van Oosterom and Strackee 1983), sr.
double solidAngle(const TexelPiece& piece, glm::dvec3 eye) {
    const auto towards = [&](size_t i) { return glm::normalize(piece.corners_m[i] - eye); };
    double sum = 0;
    for (size_t i = 2; i < piece.corners_m.size(); ++i) {
        const glm::dvec3 a = towards(0), b = towards(i - 1), c = towards(i);
        sum += 2 * std::atan2(glm::dot(a, glm::cross(b, c)), 1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
    }
    return std::abs(sum);
}

}  // namespace

TexelPieces::TexelPieces(const Gatherer& gatherer, const GatherFrom& from) {
    const Unwrap& unwrap = gatherer.unwrap();
    const uint32_t address = gatherer.texels().address[from.texel], x = TexelAddress::x(address),
                   y = TexelAddress::y(address);
    std::vector<uint32_t> faces;
    for (const SamplePoint& p : from.points) faces.push_back(p.face);
    std::ranges::sort(faces);
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    for (const uint32_t face : faces) add(gatherer, face, clipToCell(unwrap.uv_texels[face], x, y));
    const float area_m2 = gatherer.texels().area_m2[from.texel];
    if (area_m2_ >= covered_min * area_m2) return;
    // Of many faces, most of which have no point: known where the whole texel is of one plane.
    pieces_.clear(), area_m2_ = 0;
    const bool whole = area_m2 >= covered_min * unwrap.texel_area_m2[faces[0]];
    if (!whole || unwrap.charts[unwrap.face_chart[faces[0]]].curved) return;
    const glm::vec2 corner(x, y);
    add(gatherer, faces[0], {corner, corner + glm::vec2(1, 0), corner + glm::vec2(1, 1), corner + glm::vec2(0, 1)});
}

glm::dvec3 TexelPieces::centreM() const {
    glm::dvec3 sum(0);
    for (const TexelPiece& piece : pieces_) sum += piece.area_m2 * piece.centre_m;
    return sum / area_m2_;
}

double TexelPieces::solidAngleFrom(glm::dvec3 eye_m) const {
    double sum = 0;
    for (const TexelPiece& piece : pieces_)
        if (glm::dot(piece.normal, eye_m - piece.centre_m) > 0) sum += solidAngle(piece, eye_m);
    return sum;
}

void TexelPieces::add(const Gatherer& gatherer, uint32_t face, const std::vector<glm::vec2>& polygon_texels) {
    const auto& uv = gatherer.unwrap().uv_texels[face];
    const float area = cross2d(uv[1] - uv[0], uv[2] - uv[0]);
    TexelPiece piece;
    piece.face = face;
    piece.normal = glm::dvec3(gatherer.unwrap().frames[face].normal);
    auto& c = piece.corners_m;
    for (const glm::vec2 p : polygon_texels)
        c.emplace_back(gatherer.rays().pointOn(gatherer.unwrap().faces[face].triangle,
                                               cross2d(p - uv[0], uv[2] - uv[0]) / area,
                                               cross2d(uv[1] - uv[0], p - uv[0]) / area));
    for (size_t i = 2; i < c.size(); ++i) {
        const double part_m2 = 0.5 * glm::length(glm::cross(c[i - 1] - c[0], c[i] - c[0]));
        piece.area_m2 += part_m2;
        piece.centre_m += part_m2 / 3 * (c[0] + c[i - 1] + c[i]);
    }
    if (piece.area_m2 > 0) piece.centre_m /= piece.area_m2;
    area_m2_ += piece.area_m2;
    pieces_.push_back(std::move(piece));
}

}  // namespace dimmer::cook
