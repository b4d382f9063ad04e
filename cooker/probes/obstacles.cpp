#include <probes/obstacles.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace dimmer::cook {
namespace {

// Rays must not slip through the edges that walls are made of.
constexpr float edge_tolerance = 1e-5f;
constexpr float never = std::numeric_limits<float>::infinity();

using Mask [[gnu::vector_size(32)]] = int;

// A bit per lane.
uint32_t lanesOf(const Mask& mask) {
    const Mask bits = mask & Mask{1, 2, 4, 8, 16, 32, 64, 128};
    uint64_t words[4];
    std::memcpy(words, &bits, sizeof words);
    const uint64_t both = words[0] | words[1] | words[2] | words[3];
    return static_cast<uint32_t>(both | both >> 32);
}

}  // namespace

Obstacles::Obstacles(const RayScene& rays, const TriangleCells* cells, const std::array<glm::vec3, 4>& corners)
    : rays_(rays), corners_(corners) {
    if (!cells) return;
    thread_local std::vector<uint32_t> near;
    if (!cells->findNear(corners, near) || near.size() > triangles_max) return;
    const auto opaque = [&](uint32_t t) {
        return rays.scene().materials[rays.triangles()[t].material].alpha_mode == AlphaMode::Opaque;
    };
    if (!std::ranges::all_of(near, opaque)) return;
    by_rays_ = false;
    prepare(near);
}

// Whether no way between points of the tetrahedron can meet the triangle: all corners lie on one side of its plane, or,
// seen along its normal, beyond one of its sides.
bool Obstacles::isClear(const Barycentric& distance, const Barycentric& second, const Barycentric& third) {
    size_t above = 0, beyond_second = 0, beyond_third = 0, beyond_first = 0;
    for (size_t i = 0; i < 4; ++i) {
        above += distance[i] > 0;
        beyond_second += second[i] < -edge_tolerance;
        beyond_third += third[i] < -edge_tolerance;
        beyond_first += second[i] + third[i] > 1 + edge_tolerance;
    }
    return above == 0 || above == 4 || beyond_second == 4 || beyond_third == 4 || beyond_first == 4;
}

void Obstacles::prepare(const std::vector<uint32_t>& near) {
    for (const uint32_t t : near) {
        const glm::vec3 a = rays_.corner(t, 0), to_b = rays_.corner(t, 1) - a, to_c = rays_.corner(t, 2) - a;
        const glm::vec3 normal = glm::cross(to_b, to_c);
        const float square = glm::dot(normal, normal);
        if (!(square > 0)) continue;
        Barycentric distance, second, third;
        for (size_t i = 0; i < 4; ++i) {
            const glm::vec3 p = corners_[i] - a;
            distance[i] = glm::dot(rays_.triangles()[t].normal, p);
            second[i] = glm::dot(glm::cross(p, to_c), normal) / square;
            third[i] = glm::dot(glm::cross(to_b, p), normal) / square;
        }
        if (isClear(distance, second, third)) continue;
        const size_t g = count_ / lanes, lane = count_ % lanes;
        if (lane == 0)  // the rest of the group is what nothing meets: all lies on one side of it
            for (size_t i = 0; i < 4; ++i) distance_[i][g] = second_[i][g] = third_[i][g] = Lanes{} + 1;
        for (size_t i = 0; i < 4; ++i) {
            distance_[i][g][lane] = distance[i];
            second_[i][g][lane] = second[i];
            third_[i][g][lane] = third[i];
        }
        triangles_[count_++] = t;
    }
}

std::array<Obstacle, 4> Obstacles::from(const Barycentric& point, const std::array<bool, 4>& wanted) const {
    std::array<Obstacle, 4> out;
    if (by_rays_) {
        const glm::vec3 at = position(point);
        for (size_t v = 0; v < 4; ++v)
            if (wanted[v]) out[v] = byRays(at, v);
        return out;
    }
    const size_t groups = (count_ + lanes - 1) / lanes;
    std::array<Lanes, triangles_max / lanes> distance, second, third;
    // By reference: vectors of this size are returned in another way where the processor is not known to have them.
    const auto fillHere = [&](const Fields& f, size_t g, Lanes& lanes_here) {
        lanes_here = point[0] * f[0][g] + point[1] * f[1][g] + point[2] * f[2][g] + point[3] * f[3][g];
    };
    for (size_t g = 0; g < groups; ++g) {
        fillHere(distance_, g, distance[g]);
        fillHere(second_, g, second[g]);
        fillHere(third_, g, third[g]);
    }
    for (size_t v = 0; v < 4; ++v) {
        if (!wanted[v]) continue;
        float nearest = never, farthest = -1;
        for (size_t g = 0; g < groups; ++g) {
            const Lanes end = distance_[v][g], on_way = distance[g] / (distance[g] - end);
            const Lanes b = second[g] + on_way * (second_[v][g] - second[g]);
            const Lanes c = third[g] + on_way * (third_[v][g] - third[g]);
            const Mask hit = ((distance[g] > 0) ^ (end > 0)) & (b >= -edge_tolerance) & (c >= -edge_tolerance) &
                             (b + c <= 1 + edge_tolerance);
            for (uint32_t left = lanesOf(hit); left != 0; left &= left - 1) {
                const auto lane = static_cast<size_t>(std::countr_zero(left));
                out[v].any = true;
                if (on_way[lane] < nearest) {
                    nearest = on_way[lane];
                    out[v].first = triangles_[g * lanes + lane];
                    out[v].back = distance[g][lane] < 0;
                    out[v].share = nearest;
                }
                if (on_way[lane] > farthest) {
                    farthest = on_way[lane];
                    out[v].last = triangles_[g * lanes + lane];
                }
            }
        }
    }
    return out;
}

Obstacle Obstacles::byRays(glm::vec3 from, size_t corner) const {
    const float distance_m = glm::distance(from, corners_[corner]);
    if (!(distance_m > 0)) return {};
    const glm::vec3 towards = (corners_[corner] - from) / distance_m;
    const auto seed = static_cast<uint32_t>(corner);
    const auto hit = rays_.nearest(from, towards, distance_m, seed);
    if (!hit) return {};
    const auto last = rays_.nearest(corners_[corner], -towards, distance_m, seed);
    return {true, hit->back, hit->triangle, last ? last->triangle : hit->triangle, hit->distance_m / distance_m};
}

glm::vec3 Obstacles::position(const Barycentric& point) const {
    return point[0] * corners_[0] + point[1] * corners_[1] + point[2] * corners_[2] + point[3] * corners_[3];
}

Barycentric Obstacles::field(uint32_t triangle) const {
    Barycentric out;
    for (size_t i = 0; i < 4; ++i)
        out[i] = glm::dot(rays_.triangles()[triangle].normal, corners_[i] - rays_.corner(triangle, 0));
    return out;
}

}  // namespace dimmer::cook
