#include <charts/shared_edges.h>

#include <charts/box_tree.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

// What cuts of neighbouring triangles compute of one point differs by less, by rounding: four steps of floats at the
// largest coordinate.
constexpr float same_place_m = 1e-4f, same_place_share = 4 * 0x1p-23f;
// Twice the area of a triangle that is none.
constexpr float no_area_m2 = 1e-9f;

bool hasArea(const SceneMesh& mesh, glm::uvec3 triangle) {
    const glm::vec3 a = mesh.positions_m[triangle.x];
    return glm::length(glm::cross(mesh.positions_m[triangle.y] - a, mesh.positions_m[triangle.z] - a)) > no_area_m2;
}

class EdgeSplitter {
   public:
    EdgeSplitter(Scene& scene, std::span<const CutMesh> meshes) : scene_(scene), meshes_(meshes) {
        for (const CutMesh& m : meshes_)
            for (size_t v = m.first_new; v < scene_.meshes[m.mesh].positions_m.size(); ++v)
                places_.push_back(scene_.meshes[m.mesh].positions_m[v]);
        std::vector<BoxTree::Box> boxes;
        for (const glm::vec3& p : places_) {
            near_m_ = std::max({near_m_, same_place_share * std::abs(p.x), same_place_share * std::abs(p.y),
                                same_place_share * std::abs(p.z)});
            boxes.push_back({p, p});
        }
        tree_ = BoxTree(std::move(boxes));
    }

    void run() {
        if (places_.empty()) return;
        joinPlaces();
        for (const CutMesh& m : meshes_) split(scene_.meshes[m.mesh], m.first_new);
    }

   private:
    bool isSamePlace(glm::vec3 a, glm::vec3 b) const { return glm::distance(a, b) <= near_m_; }

    // New vertices near a box, as they were found: where they are now is up to as much off.
    std::vector<uint32_t> near(BoxTree::Box box) const {
        box.min_m -= 2 * near_m_;
        box.max_m += 2 * near_m_;
        return tree_.touching(box);
    }

    // Each new vertex goes to the first of those in its place, and all to an old one that is there.
    void joinPlaces() {
        const std::vector<glm::vec3> found = places_;
        std::vector<uint32_t> first(places_.size());
        for (uint32_t i = 0; i < places_.size(); ++i) {
            first[i] = i;
            for (const uint32_t other : near({found[i], found[i]}))
                if (other < i && first[other] == other && isSamePlace(found[other], found[i])) {
                    first[i] = other;
                    break;
                }
        }
        std::vector<bool> is_old(places_.size());
        for (const CutMesh& m : meshes_)
            for (size_t v = 0; v < m.first_new; ++v) {
                const glm::vec3 old = scene_.meshes[m.mesh].positions_m[v];
                for (const uint32_t i : near({old, old})) {
                    if (is_old[first[i]] || !isSamePlace(found[i], old)) continue;
                    is_old[first[i]] = true;
                    places_[first[i]] = old;
                }
            }
        size_t i = 0;
        for (const CutMesh& m : meshes_)
            for (size_t v = m.first_new; v < scene_.meshes[m.mesh].positions_m.size(); ++v, ++i)
                scene_.meshes[m.mesh].positions_m[v] = places_[i] = places_[first[i]];
    }

    // Places of new vertices between the ends of an edge, in order.
    std::vector<glm::vec3> placesOn(glm::vec3 a, glm::vec3 b) const {
        const glm::vec3 along = b - a;
        const float length_m = glm::length(along);
        std::vector<std::pair<float, glm::vec3>> on;
        for (const uint32_t i : near(BoxTree::boxOf(std::array{a, b}))) {
            const glm::vec3 p = places_[i];
            if (isSamePlace(p, a) || isSamePlace(p, b)) continue;
            const float t = glm::dot(p - a, along) / (length_m * length_m);
            if (t <= 0 || t >= 1 || !isSamePlace(p, a + t * along)) continue;
            on.emplace_back(t, p);
        }
        std::ranges::sort(on, {},
                          [](const auto& e) { return std::tuple(e.first, e.second.x, e.second.y, e.second.z); });
        std::vector<glm::vec3> places;
        for (const auto& [t, p] : on)
            if (places.empty() || places.back() != p) places.push_back(p);
        return places;
    }

    // From a triangle's first corner to its second, from there to its third, and back.
    using EdgePlaces = std::array<std::vector<glm::vec3>, 3>;
    using EdgeVertices = std::array<std::vector<uint32_t>, 3>;

    EdgePlaces placesOnEdges(const SceneMesh& mesh, glm::uvec3 triangle) const {
        EdgePlaces places;
        for (int e = 0; e < 3; ++e)
            places[static_cast<size_t>(e)] =
                placesOn(mesh.positions_m[triangle[e]], mesh.positions_m[triangle[(e + 1) % 3]]);
        return places;
    }

    // Few triangles of many are split: the others' places are not kept.
    void split(SceneMesh& mesh, size_t first_new) const {
        std::vector<uint8_t> is_split(mesh.triangles.size());
        tbb::parallel_for(size_t{0}, is_split.size(), [&](size_t t) {
            const EdgePlaces places = placesOnEdges(mesh, mesh.triangles[t]);
            is_split[t] = !std::ranges::all_of(places, [](const auto& on_edge) { return on_edge.empty(); });
        });
        const bool is_cut = mesh.positions_m.size() > first_new;
        if (!is_cut && std::ranges::count(is_split, 1) == 0) return;
        std::vector<glm::uvec3> triangles;
        std::vector<uint32_t> materials, regions;
        for (size_t t = 0; t < is_split.size(); ++t) {
            const glm::uvec3 triangle = mesh.triangles[t];
            const bool is_new = std::max({triangle.x, triangle.y, triangle.z}) >= first_new;
            if (is_split[t])
                addParts(mesh, triangle, triangles);
            else if (!is_new || hasArea(mesh, triangle))  // joining its corners may have left it none
                triangles.push_back(triangle);
            materials.resize(triangles.size(), mesh.triangle_materials[t]);
            if (!mesh.triangle_regions.empty()) regions.resize(triangles.size(), mesh.triangle_regions[t]);
        }
        mesh.triangles = std::move(triangles);
        mesh.triangle_materials = std::move(materials);
        mesh.triangle_regions = std::move(regions);
    }

    void addParts(SceneMesh& mesh, glm::uvec3 triangle, std::vector<glm::uvec3>& triangles) const {
        const EdgePlaces places = placesOnEdges(mesh, triangle);
        EdgeVertices vertices;
        for (int e = 0; e < 3; ++e)
            for (const glm::vec3 p : places[static_cast<size_t>(e)])
                vertices[static_cast<size_t>(e)].push_back(addVertex(mesh, triangle[e], triangle[(e + 1) % 3], p));
        addParts(mesh, triangle, {vertices[0], vertices[1], vertices[2]}, triangles);
    }

    // Halves the triangle at the middle vertex of its longest edge that has some, and its halves likewise.
    static void addParts(const SceneMesh& mesh, glm::uvec3 triangle, std::array<std::span<const uint32_t>, 3> vertices,
                         std::vector<glm::uvec3>& triangles) {
        const auto place = [&](int i) { return mesh.positions_m[triangle[i % 3]]; };
        int longest = -1;
        float longest_m = 0;
        for (int e = 0; e < 3; ++e) {
            const float length_m = glm::distance(place(e), place(e + 1));
            if (vertices[static_cast<size_t>(e)].empty() || length_m <= longest_m) continue;
            longest = e, longest_m = length_m;
        }
        if (longest < 0) {
            if (hasArea(mesh, triangle)) triangles.push_back(triangle);
            return;
        }
        const auto after = [&](int i) { return static_cast<size_t>((longest + i) % 3); };
        const std::span<const uint32_t> on = vertices[after(0)];
        const uint32_t from = triangle[longest], to = triangle[(longest + 1) % 3], top = triangle[(longest + 2) % 3],
                       at = on[on.size() / 2];
        addParts(mesh, {from, at, top}, {on.first(on.size() / 2), {}, vertices[after(2)]}, triangles);
        addParts(mesh, {at, to, top}, {on.subspan(on.size() / 2 + 1), vertices[after(1)], {}}, triangles);
    }

    static uint32_t addVertex(SceneMesh& mesh, uint32_t from, uint32_t to, glm::vec3 place) {
        const float t =
            glm::distance(mesh.positions_m[from], place) / glm::distance(mesh.positions_m[from], mesh.positions_m[to]);
        const auto blend = [&](const auto& values) { return (1 - t) * values[from] + t * values[to]; };
        mesh.positions_m.push_back(place);
        const glm::vec3 normal = blend(mesh.normals);
        mesh.normals.push_back(glm::length(normal) > 1e-3f ? glm::normalize(normal) : mesh.normals[from]);
        if (!mesh.uv0.empty()) mesh.uv0.push_back(blend(mesh.uv0));
        return static_cast<uint32_t>(mesh.positions_m.size() - 1);
    }

    Scene& scene_;
    std::span<const CutMesh> meshes_;
    std::vector<glm::vec3> places_;  // of new vertices
    float near_m_ = same_place_m;
    BoxTree tree_;  // of them, as they were found
};

}  // namespace

void splitSharedEdges(Scene& scene, std::span<const CutMesh> meshes) {
    EdgeSplitter(scene, meshes).run();
}

}  // namespace dimmer::cook
