#include <probes/visibility.h>

#include <bake/sampling.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace dimmer::cook {
namespace {

constexpr uint32_t samples_max = 32;
constexpr uint32_t leak_cost = 3, miss_cost = 1;
constexpr uint32_t lonely_miss_cost = 8;  // of a point that no other probe is taken to see
constexpr std::array<int8_t, 4> seen_everywhere = {127, 127, 127, 127};
constexpr std::array<int8_t, 4> seen_nowhere = {-127, -127, -127, -127};

using Weights = std::array<float, 4>;  // barycentric

// Evenly over the tetrahedron: the unit cube folded onto it (Rocchini and Cignoni 2000).
Weights pointInside(glm::vec3 u) {
    if (u.x + u.y > 1) u = {1 - u.x, 1 - u.y, u.z};
    if (u.y + u.z > 1)
        u = {u.x, 1 - u.z, 1 - u.x - u.y};
    else if (u.x + u.y + u.z > 1)
        u = {1 - u.y - u.z, u.y, u.x + u.y + u.z - 1};
    return {1 - u.x - u.y - u.z, u.x, u.y, u.z};
}

struct Plane {
    glm::vec3 point, normal;
};

float value(const Weights& field, const Weights& at) {
    return field[0] * at[0] + field[1] * at[1] + field[2] * at[2] + field[3] * at[3];
}

// Signed distances of the corners, positive on the probe's side.
Weights distances(const Plane& plane, const std::array<glm::vec3, 4>& corners, size_t probe) {
    Weights out;
    for (size_t i = 0; i < 4; ++i) out[i] = glm::dot(plane.normal, corners[i] - plane.point);
    if (out[probe] < 0)
        for (float& d : out) d = -d;
    return out;
}

std::array<int8_t, 4> quantised(const Weights& field) {
    float largest = 0;
    for (const float f : field) largest = std::max(largest, std::abs(f));
    std::array<int8_t, 4> out;
    // Rounded down: what is hidden stays hidden.
    for (size_t i = 0; i < 4; ++i) out[i] = static_cast<int8_t>(std::floor(127 * field[i] / largest));
    return out;
}

float value(const std::array<int8_t, 4>& row, const Weights& at) {
    return value(Weights{static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2]),
                         static_cast<float>(row[3])},
                 at);
}

class Table {
   public:
    Table(const RayScene& rays, const std::array<glm::vec3, 4>& corners, const std::array<bool, 4>& free,
          uint32_t samples)
        : rays_(rays), corners_(corners), samples_(samples) {
        for (uint32_t i = 0; i < samples_; ++i) points_[i] = pointInside(sequence3d(i, 1));
        for (size_t v = 0; v < 4; ++v)
            if (free[v]) look(v);
    }

    TetrahedronVisibility find() {
        TetrahedronVisibility out;
        for (auto& costs : miss_) costs.fill(miss_cost);
        for (size_t v = 0; v < 4; ++v) out.seen[v] = bestRow(v);
        if (!markLonely(out)) return out;
        for (size_t v = 0; v < 4; ++v) out.seen[v] = bestRow(v);
        return out;
    }

   private:
    void look(size_t v) {
        for (uint32_t i = 0; i < samples_; ++i) {
            const Weights& w = points_[i];
            const glm::vec3 to = w[0] * corners_[0] + w[1] * corners_[1] + w[2] * corners_[2] + w[3] * corners_[3];
            const float distance = glm::distance(to, corners_[v]);
            const auto hit = rays_.nearest(corners_[v], (to - corners_[v]) / distance, distance, i);
            seen_[v][i] = !hit;
            if (!hit) continue;
            const Plane plane{rays_.pointOn(hit->triangle, hit->u, hit->v), rays_.triangles()[hit->triangle].normal};
            const Weights field = distances(plane, corners_, v);
            if (field[v] > 0) rows_[v].push_back(quantised(field));
        }
    }

    uint32_t cost(size_t v, const std::array<int8_t, 4>& row) const {
        uint32_t sum = 0;
        for (uint32_t i = 0; i < samples_; ++i) {
            const bool taken_for_seen = value(row, points_[i]) > 0;
            if (taken_for_seen != seen_[v][i]) sum += taken_for_seen ? leak_cost : miss_[v][i];
        }
        return sum;
    }

    std::array<int8_t, 4> bestRow(size_t v) const {
        std::array<int8_t, 4> best = seen_everywhere;
        uint32_t least = cost(v, best);
        const auto consider = [&](const std::array<int8_t, 4>& row) {
            const uint32_t c = cost(v, row);
            if (c < least) least = c, best = row;
        };
        if (least == 0) return best;
        consider(seen_nowhere);
        for (const auto& row : rows_[v]) consider(row);
        return best;
    }

    // Points that some probe sees and none is taken to see count more from now on.
    bool markLonely(const TetrahedronVisibility& table) {
        bool any = false;
        for (uint32_t i = 0; i < samples_; ++i) {
            bool taken = false;
            for (size_t v = 0; v < 4; ++v) taken = taken || value(table.seen[v], points_[i]) > 0;
            for (size_t v = 0; v < 4 && !taken; ++v)
                if (seen_[v][i]) {
                    miss_[v][i] = lonely_miss_cost;
                    any = true;
                }
        }
        return any;
    }

    const RayScene& rays_;
    const std::array<glm::vec3, 4>& corners_;
    uint32_t samples_;
    std::array<Weights, samples_max> points_;
    std::array<std::array<bool, samples_max>, 4> seen_{};
    std::array<std::array<uint32_t, samples_max>, 4> miss_{};
    std::array<std::vector<std::array<int8_t, 4>>, 4> rows_;  // planes that stopped rays
};

}  // namespace

TetrahedronVisibility findVisibility(const RayScene& rays, const std::array<glm::vec3, 4>& corners,
                                     const std::array<bool, 4>& free, Look look) {
    return Table(rays, corners, free, look == Look::Hasty ? samples_max / 2 : samples_max).find();
}

}  // namespace dimmer::cook
