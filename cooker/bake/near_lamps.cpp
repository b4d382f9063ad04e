#include <bake/near_lamps.h>

#include <bake/punctual.h>
#include <charts/raster.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr float near_widths = 2;
// Between the middle of what the points are on and theirs: what hides a fifth of a texel moves it as far.
constexpr float apart_max_widths = 0.1f;
// Faces with points that make up less of a texel are not all that it is of.
constexpr float covered_min = 0.99f;

// The part of a face in a texel.
struct Piece {
    std::vector<glm::dvec3> corners_m;  // convex
    double area_m2;
    glm::dvec3 centre_m;  // centre of gravity
};

Piece pieceOf(std::vector<glm::dvec3> corners_m) {
    Piece piece{std::move(corners_m), 0, glm::dvec3(0)};
    const auto& c = piece.corners_m;
    for (size_t i = 2; i < c.size(); ++i) {
        const double area = 0.5 * glm::length(glm::cross(c[i - 1] - c[0], c[i] - c[0]));
        piece.area_m2 += area;
        piece.centre_m += area / 3 * (c[0] + c[i - 1] + c[i]);
    }
    if (piece.area_m2 > 0) piece.centre_m /= piece.area_m2;
    return piece;
}

// As it is seen from `eye` (Van Oosterom and Strackee 1983), sr.
double solidAngle(const Piece& piece, glm::dvec3 eye) {
    const auto towards = [&](size_t i) { return glm::normalize(piece.corners_m[i] - eye); };
    double sum = 0;
    for (size_t i = 2; i < piece.corners_m.size(); ++i) {
        const glm::dvec3 a = towards(0), b = towards(i - 1), c = towards(i);
        sum += 2 * std::atan2(glm::dot(a, glm::cross(b, c)), 1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
    }
    return std::abs(sum);
}

class TexelPieces {
   public:
    TexelPieces(const Gatherer& gatherer, const GatherFrom& from)
        : gatherer_(gatherer), unwrap_(gatherer.unwrap()), address_(gatherer.texels().address[from.texel]) {
        std::vector<uint32_t> faces;
        for (const SamplePoint& p : from.points) faces.push_back(p.face);
        std::ranges::sort(faces);
        faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
        for (const uint32_t face : faces) add(face, clipToCell(unwrap_.uv_texels[face], x(), y()));
        const float area_m2 = gatherer.texels().area_m2[from.texel];
        if (area_m2_ >= covered_min * area_m2) return;
        // Of many faces, most of which have no point: known where the whole texel is of one plane.
        pieces_.clear(), area_m2_ = 0;
        const bool whole = area_m2 >= covered_min * unwrap_.texel_area_m2[faces[0]];
        if (!whole || unwrap_.charts[unwrap_.face_chart[faces[0]]].of_file) return;
        const glm::vec2 corner(x(), y());
        add(faces[0], {corner, corner + glm::vec2(1, 0), corner + glm::vec2(1, 1), corner + glm::vec2(0, 1)});
    }

    double areaM2() const { return area_m2_; }  // 0: not known what the texel is of
    glm::dvec3 centreM() const {
        glm::dvec3 sum(0);
        for (const auto& [piece, normal] : pieces_) sum += piece.area_m2 * piece.centre_m;
        return sum / area_m2_;
    }
    double solidAngleFrom(glm::dvec3 lamp_m) const {
        double sum = 0;
        for (const auto& [piece, normal] : pieces_)
            if (glm::dot(normal, lamp_m - piece.centre_m) > 0) sum += solidAngle(piece, lamp_m);
        return sum;
    }

   private:
    uint32_t x() const { return TexelAddress::x(address_); }
    uint32_t y() const { return TexelAddress::y(address_); }

    void add(uint32_t face, const std::vector<glm::vec2>& polygon_texels) {
        const auto& uv = unwrap_.uv_texels[face];
        const float area = cross2d(uv[1] - uv[0], uv[2] - uv[0]);
        std::vector<glm::dvec3> corners_m;
        for (const glm::vec2 p : polygon_texels)
            corners_m.emplace_back(gatherer_.rays().pointOn(unwrap_.faces[face].triangle,
                                                            cross2d(p - uv[0], uv[2] - uv[0]) / area,
                                                            cross2d(uv[1] - uv[0], p - uv[0]) / area));
        pieces_.emplace_back(pieceOf(std::move(corners_m)), glm::dvec3(unwrap_.frames[face].normal));
        area_m2_ += pieces_.back().first.area_m2;
    }

    const Gatherer& gatherer_;
    const Unwrap& unwrap_;
    uint32_t address_;
    std::vector<std::pair<Piece, glm::dvec3>> pieces_;  // with the normals of their faces
    double area_m2_ = 0;
};

}  // namespace

float nearLampScale(const Gatherer& gatherer, const GatherFrom& from, glm::vec3 lamp_m) {
    if (from.texel == no_index) return 1;
    const float width_m = std::sqrt(gatherer.texels().area_m2[from.texel]), reach_m = near_widths * width_m;
    const auto isNear = [&](const SamplePoint& p) { return glm::distance(p.position_m, lamp_m) < reach_m; };
    if (std::ranges::none_of(from.points, isNear)) return 1;
    const TexelPieces pieces(gatherer, from);
    if (!(pieces.areaM2() > 0)) return 1;
    // Of an even lamp of 1 cd, as illuminate() has it.
    double points_lux = 0;
    glm::dvec3 middle(0);
    for (const SamplePoint& p : from.points) {
        const glm::dvec3 to_lamp = glm::dvec3(lamp_m) - glm::dvec3(p.position_m);
        const double distance_m = glm::length(to_lamp);
        const double height_m = glm::dot(to_lamp, glm::dvec3(gatherer.frameOf(p).normal));
        const double clamped_m = std::max(distance_m, static_cast<double>(lamp_distance_min_m));
        if (height_m > 0) points_lux += height_m / (distance_m * clamped_m * clamped_m);
        middle += glm::dvec3(p.position_m);
    }
    const auto count = static_cast<double>(from.points.size());
    if (glm::distance(middle / count, pieces.centreM()) > static_cast<double>(apart_max_widths * width_m)) return 1;
    const double scale = pieces.solidAngleFrom(lamp_m) / pieces.areaM2() / (points_lux / count);
    return std::isfinite(scale) ? static_cast<float>(scale) : 1;  // no point sees it; or it is a corner of the texel
}

}  // namespace dimmer::cook
