#include <bake/door_guides.h>

#include <bake/door_paths.h>
#include <bake/punctual.h>
#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace dimmer::cook {
namespace {

constexpr uint32_t door_points = 256;
// Lamps that bring less than this share of their group's light at a point of the door light no patch worth a box.
constexpr float flux_share_min = 0.01f;
// Boxes of patches have some thickness, so that every point sees them from outside.
constexpr float inflate_m = 0.05f;
// The boxes of the door's leaves take this share of the rays where there are patches too.
constexpr float door_share = 0.5f;
// Of the angle between a point's normal and a box, which may reach higher than its middle.
constexpr float cosine_min = 0.1f;
constexpr float infinity = std::numeric_limits<float>::infinity();
// Leaves that are no further apart are of one opening.
constexpr float same_opening_m = 0.1f;
// A leaf may be made of many pieces; all pairs of so many are looked at.
constexpr size_t pieces_max = 64;
// Axes that are so near the world's are the world's.
constexpr float axis_slack = 1e-3f;

struct Photon {
    glm::vec3 place;
    float flux;
};

GuideBox empty() {
    return {glm::vec3(infinity), glm::vec3(-infinity), 0};
}

void include(GuideBox& box, glm::vec3 p) {
    box.low = glm::min(box.low, p);
    box.high = glm::max(box.high, p);
}

GuideBox boundsOf(std::span<const Photon> photons) {
    GuideBox box = empty();
    for (const Photon& p : photons) {
        include(box, p.place);
        box.flux += p.flux;
    }
    box.low -= inflate_m;
    box.high += inflate_m;
    return box;
}

// Along the largest of these triangles: its normal, and the longer of its two edges that are nearest to a right angle.
glm::mat3 axesOf(const RayScene& rays, std::span<const uint32_t> triangles) {
    float largest = 0;
    glm::mat3 axes(1);
    for (const uint32_t t : triangles) {
        const std::array<glm::vec3, 3> p = {rays.corner(t, 0), rays.corner(t, 1), rays.corner(t, 2)};
        const glm::vec3 normal = glm::cross(p[1] - p[0], p[2] - p[0]);
        const float area = glm::length(normal);
        if (!(area > largest)) continue;
        largest = area;
        float least = infinity;
        for (size_t i = 0; i < 3; ++i) {
            const glm::vec3 a = p[(i + 1) % 3] - p[i], b = p[(i + 2) % 3] - p[i];
            const float cosine = std::abs(glm::dot(a, b)) / (glm::length(a) * glm::length(b));
            if (!(cosine < least)) continue;
            least = cosine;
            axes[0] = glm::normalize(glm::length(a) > glm::length(b) ? a : b);
        }
        axes[2] = normal / area;
        axes[1] = glm::cross(axes[2], axes[0]);
    }
    const auto alongTheWorld = [](glm::vec3 axis) {
        return std::max(std::abs(axis.x), std::max(std::abs(axis.y), std::abs(axis.z))) > 1 - axis_slack;
    };
    const bool world = alongTheWorld(axes[0]) && alongTheWorld(axes[1]) && alongTheWorld(axes[2]);
    return world ? glm::mat3(1) : axes;
}

float largestSideM2(const GuideBox& box) {
    const glm::vec3 d = box.high - box.low;
    return std::max(d.x * d.y, std::max(d.y * d.z, d.z * d.x));
}

float gapM(const GuideBox& a, const GuideBox& b) {
    const glm::vec3 apart = glm::max(glm::max(a.low - b.high, b.low - a.high), glm::vec3(0));
    return std::max(apart.x, std::max(apart.y, apart.z));
}

// Joins the nearest two, until those that are left are apart and no more than `most`.
void joinLeaves(std::vector<GuideBox>& leaves, size_t most) {
    while (leaves.size() > 1) {
        size_t first = 0, second = 1;
        for (size_t i = 0; i < leaves.size(); ++i)
            for (size_t j = i + 1; j < leaves.size(); ++j)
                if (gapM(leaves[i], leaves[j]) < gapM(leaves[first], leaves[second])) first = i, second = j;
        if (gapM(leaves[first], leaves[second]) > same_opening_m && leaves.size() <= most) return;
        include(leaves[first], leaves[second].low);
        include(leaves[first], leaves[second].high);
        leaves.erase(leaves.begin() + static_cast<std::ptrdiff_t>(second));
    }
}

// The openings of a door whose closed leaves these triangles are.
GuideBoxes openingsOf(const RayScene& rays, std::span<const uint32_t> triangles) {
    GuideBoxes door;
    if (triangles.empty()) return door;
    door.world_from_box = axesOf(rays, triangles);
    uint32_t mesh = UINT32_MAX;  // a mesh's triangles follow one another
    for (const uint32_t t : triangles) {
        if (rays.triangles()[t].mesh != mesh) {
            if (door.boxes.size() > pieces_max) joinLeaves(door.boxes, pieces_max);
            door.boxes.push_back(empty());
        }
        mesh = rays.triangles()[t].mesh;
        for (int i = 0; i < 3; ++i) include(door.boxes.back(), rays.corner(t, i) * door.world_from_box);
    }
    joinLeaves(door.boxes, leaf_boxes_max);
    door.leaves = static_cast<uint32_t>(door.boxes.size());
    return door;
}

// Shadow photons: where light of these lamps that passes a point of the door's boxes lands, as if no door stood
// anywhere; along the axes of those.
std::vector<Photon> shadowPhotons(const RayScene& rays, std::span<const uint32_t> lamps, const GuideBoxes& door,
                                  uint32_t seed) {
    std::vector<Photon> photons;
    std::vector<Illumination> lit;
    float area_m2 = 0;
    for (uint32_t l = 0; l < door.leaves; ++l)
        area_m2 += largestSideM2(door.boxes[l]) / static_cast<float>(door.leaves);
    for (uint32_t i = 0; i < door_points; ++i) {
        const glm::vec2 u = sequence2d(i, seed);
        const glm::vec3 within(u, radicalInverse(5, i + 1));
        const GuideBox& leaf = door.boxes[i % door.leaves];
        // Each leaf has as many points, whatever its size.
        const float share = area_m2 > 0 ? largestSideM2(leaf) / area_m2 : 1;
        const glm::vec3 point = door.world_from_box * glm::mix(leaf.low, leaf.high, within);
        float sum = 0;
        lit.clear();
        for (const uint32_t lamp : lamps) {
            lit.push_back(illuminate(rays.scene().lights[lamp], point));
            sum += luminance(lit.back().irradiance_lux);
        }
        for (const Illumination& l : lit) {
            const float lux = luminance(l.irradiance_lux);
            if (!(lux > flux_share_min * sum)) continue;
            if (!(rays.transmittance(point, l.towards_light, shadowRayLengthM(l), Surfaces::Walls) > 0)) continue;
            const auto hit = rays.nearest(point, -l.towards_light, far_away_m, hash(seed, i), Surfaces::Walls);
            if (hit && !hit->back)
                photons.push_back({(point - l.towards_light * hit->distance_m) * door.world_from_box, lux * share});
        }
    }
    return photons;
}

// Splits the cluster that gains most, across its longest side, until there are enough.
std::vector<GuideBox> cluster(std::vector<Photon> photons, size_t boxes_max) {
    if (photons.empty()) return {};
    struct Range {
        size_t begin, end;
        GuideBox box;
        float gain() const {
            const glm::vec3 d = box.high - box.low;
            return end - begin < 2 ? 0 : box.flux * (d.x * d.y + d.y * d.z + d.z * d.x);
        }
    };
    std::vector<Range> ranges{{0, photons.size(), boundsOf(photons)}};
    while (ranges.size() < boxes_max) {
        auto& widest = *std::ranges::max_element(ranges, {}, &Range::gain);
        if (!(widest.gain() > 0)) break;
        const glm::vec3 d = widest.box.high - widest.box.low;
        const int axis = d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
        const float middle = 0.5f * (widest.box.low[axis] + widest.box.high[axis]);
        const auto first = photons.begin() + static_cast<long>(widest.begin);
        const auto last = photons.begin() + static_cast<long>(widest.end);
        const auto split = std::stable_partition(first, last, [&](const Photon& p) { return p.place[axis] < middle; });
        const auto at = static_cast<size_t>(split - photons.begin());
        if (at == widest.begin || at == widest.end) break;
        const Range upper{at, widest.end, boundsOf({photons.data() + at, widest.end - at})};
        widest = {widest.begin, at, boundsOf({photons.data() + widest.begin, at - widest.begin})};
        ranges.push_back(upper);
    }
    std::vector<GuideBox> boxes;
    for (const Range& r : ranges) boxes.push_back(r.box);
    return boxes;
}

}  // namespace

DoorGuides::DoorGuides(const RayScene& rays)
    : group_count_(1 + static_cast<uint32_t>(rays.scene().light_sets.size())),
      door_count_(static_cast<uint32_t>(rays.scene().doors.size())) {
    const Scene& scene = rays.scene();
    std::vector<std::vector<uint32_t>> leaves(door_count_);
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const uint32_t condition = rays.triangles()[t].condition;
        if (condition == no_condition || (condition & 1)) continue;  // where the leaf stands closed, the opening is
        leaves[condition / 2].push_back(t);
    }
    for (uint32_t d = 0; d < door_count_; ++d) {
        boxes_.push_back(openingsOf(rays, leaves[d]));
        identity_.push_back(d);
    }
    std::vector<std::vector<uint32_t>> lamps(group_count_);
    for (uint32_t l = 0; l < scene.lights.size(); ++l)
        if (scene.lights[l].bake != BakeMode::None) lamps[groupOf(scene.lights[l].light_set)].push_back(l);
    std::vector<std::vector<GuideBox>> patches(size_t{door_count_} * group_count_);
    tbb::parallel_for(size_t{0}, patches.size(), [&](size_t i) {
        const auto number = static_cast<uint32_t>(i / group_count_);
        const GuideBoxes& door = boxes_[number];
        if (door.leaves > 0)
            patches[i] =
                cluster(shadowPhotons(rays, lamps[i % group_count_], door, number), guide_boxes_max - door.leaves);
    });
    for (size_t i = 0; i < patches.size(); ++i) {
        const auto door = static_cast<uint32_t>(i / group_count_), group = static_cast<uint32_t>(i % group_count_);
        guide_of_.push_back(patches[i].empty() ? door : static_cast<uint32_t>(boxes_.size()));
        if (patches[i].empty()) continue;
        boxes_.push_back(boxes_[door]);
        boxes_.back().boxes.insert(boxes_.back().boxes.end(), patches[i].begin(), patches[i].end());
        group_of_.push_back(group);
        identity_.push_back(hash(hash(door, 1), groupIdentity(scene, group)));
    }
}

Guide::Guide(const GuideBoxes& guide, glm::vec3 point, glm::vec3 normal) : world_from_box_(guide.world_from_box) {
    const bool everywhere = normal == glm::vec3(0);
    point = point * world_from_box_;
    normal = normal * world_from_box_;
    const std::span<const GuideBox> boxes = guide.boxes;
    std::array<glm::vec3, guide_boxes_max> side_area_m2;
    std::array<bool, guide_boxes_max> is_leaf;
    float patches = 0, door = 0;
    for (size_t b = 0; b < boxes.size(); ++b) {
        const glm::vec3 low = boxes[b].low - point, high = boxes[b].high - point;
        const glm::vec3 size = high - low, centre = 0.5f * (low + high);
        const glm::vec3 area_m2 = {size.y * size.z, size.z * size.x, size.x * size.y};
        const float distance2 = glm::dot(centre, centre) + 0.25f * glm::dot(size, size);
        glm::vec3 side_chance(0);
        float seen = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (!(low[axis] > 0 || high[axis] < 0)) continue;  // the point lies between the two sides
            const float away = low[axis] > 0 ? low[axis] : -high[axis];
            side_chance[axis] = area_m2[axis] * away / (distance2 * std::sqrt(distance2));
            seen += side_chance[axis];
        }
        const glm::vec3 highest(normal.x > 0 ? high.x : low.x, normal.y > 0 ? high.y : low.y,
                                normal.z > 0 ? high.z : low.z);
        // A patch on the point's own surface sends nothing there.
        if (!(seen > 0)) continue;
        const bool leaf = b < guide.leaves;
        if (!everywhere && !(glm::dot(highest, normal) > (leaf ? 0 : 2 * inflate_m))) continue;
        const float cosine = everywhere ? 1 : std::max(cosine_min, glm::dot(centre, normal) / std::sqrt(distance2));
        const float largest_m2 = std::max(area_m2.x, std::max(area_m2.y, area_m2.z));
        chance_[count_] = leaf ? seen : boxes[b].flux / largest_m2 * seen * cosine;
        (leaf ? door : patches) += chance_[count_];
        is_leaf[count_] = leaf;
        side_area_m2[count_] = area_m2;
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<size_t>(axis);
            low_[a][count_] = low[axis];
            high_[a][count_] = high[axis];
            side_chance_[a][count_] = side_chance[axis] / seen;
        }
        ++count_;
    }
    if (count_ == 0) return;
    const float of_door = door > 0 ? (patches > 0 ? door_share : 1) : 0;
    for (uint32_t i = 0; i < count_; ++i) {
        chance_[i] = is_leaf[i] ? chance_[i] / door * of_door : chance_[i] / patches * (1 - of_door);
        for (size_t a = 0; a < 3; ++a)
            if (side_chance_[a][i] > 0)
                density_m2_[a][i] = chance_[i] * side_chance_[a][i] / side_area_m2[i][static_cast<int>(a)];
    }
}

glm::vec3 Guide::sample(float choice, glm::vec2 u) const {
    uint32_t i = 0;
    for (; i + 1 < count_ && choice >= chance_[i]; ++i) choice -= chance_[i];
    choice = std::clamp(choice / chance_[i], 0.0f, 1.0f);
    size_t axis = 0;
    for (; axis < 2 && choice >= side_chance_[axis][i]; ++axis) choice -= side_chance_[axis][i];
    while (side_chance_[axis][i] <= 0) axis = (axis + 2) % 3;  // rounding may have run past the last side
    const size_t across = (axis + 1) % 3, along = (axis + 2) % 3;
    std::array<float, 3> place;
    place[axis] = low_[axis][i] > 0 ? low_[axis][i] : high_[axis][i];
    place[across] = glm::mix(low_[across][i], high_[across][i], u.x);
    place[along] = glm::mix(low_[along][i], high_[along][i], u.y);
    return world_from_box_ * glm::normalize(glm::vec3(place[0], place[1], place[2]));
}

// Eight boxes at a time: this is asked for along every ray, for every guide.
float Guide::pdf(glm::vec3 direction) const {
    using Eight [[gnu::vector_size(32)]] = float;
    constexpr size_t lanes = sizeof(Eight) / sizeof(float);
    const glm::vec3 inverse = 1.0f / (direction * world_from_box_), steepness = glm::abs(inverse);
    PerTarget share;
    for (size_t i = 0; i < count_; i += lanes) {
        Eight near[3], far[3], density[3];
        for (size_t a = 0; a < 3; ++a) {
            Eight low, high;
            std::memcpy(&low, &low_[a][i], sizeof low);
            std::memcpy(&high, &high_[a][i], sizeof high);
            std::memcpy(&density[a], &density_m2_[a][i], sizeof low);
            low *= inverse[static_cast<int>(a)];
            high *= inverse[static_cast<int>(a)];
            near[a] = low < high ? low : high;
            far[a] = low < high ? high : low;
            // From uniform on a side to directions: squared distance over area and cosine.
            density[a] *= steepness[static_cast<int>(a)];
        }
        Eight distance = near[0], found = density[0], end = far[0];
        for (size_t a = 1; a < 3; ++a) {
            found = near[a] > distance ? density[a] : found;
            distance = near[a] > distance ? near[a] : distance;
            end = far[a] < end ? far[a] : end;
        }
        // Not what a side that is never aimed at makes of an infinite steepness.
        const Eight of_box = distance > 0 && distance <= end && found > 0 ? found * distance * distance : Eight{};
        std::memcpy(&share[i], &of_box, sizeof of_box);
    }
    float sum = 0;
    for (uint32_t i = 0; i < count_; ++i) sum += share[i];
    return sum;
}

}  // namespace dimmer::cook
