// Emissive triangles as light sources: which to sample from where, and how likely that is.
#pragma once

#include <bake/cell_grid.h>
#include <bake/sparse_light.h>
#include <trace/ray_scene.h>

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

struct Emitter {
    uint32_t triangle = 0;
    uint32_t group = 0;
    glm::vec3 corner, edge1, edge2, normal;
    float area_m2 = 0;
    glm::vec3 radiance_cd_m2{0};
    bool double_sided = false;
};

// The light group of each of the scene's meshes, for EmitterSampler.
std::vector<uint32_t> meshGroups(const Scene& scene);

// A point on an emitter, seen from a receiver.
struct EmitterSample {
    glm::vec3 direction;  // unit
    float distance_m;
    glm::vec3 radiance_cd_m2;
    uint32_t triangle;
    glm::vec2 at;  // on it, as Hit::u and v
    float pdf;     // per steradian; 0: nothing to see
};

// Rays that each light group's emitters send out to find the cells that they shine into.
inline constexpr uint32_t emitter_probe_rays = 2048;
// Chances that are kept of all cells together, 8 bytes each; others are found again where they are asked for.
inline constexpr size_t kept_choices_max = size_t{8} << 20;

// The chance of each emitter, per light group and per cell of a coarse grid: power over squared distance, as it faces
// the cell. Groups never compete with one another, so adding a set changes nothing for the others. Cells that a group
// does not shine into, as far as a few rays tell, or only faintly, do not ask for it; rays that hit its emitters from
// there count in full, so nothing is lost. Of a group with thousands of emitters, a cell has a chance for each of some
// patches that lie and face alike, and within a patch chances are by power.
class EmitterSampler {
   public:
    EmitterSampler(const RayScene& rays, std::span<const uint32_t> mesh_groups, size_t choices_max = kept_choices_max);

    struct Choice {
        uint32_t patch;
        float cumulative;  // the chance of this one and of those before it
    };
    // What a cell asks of one group.
    struct CellGroup {
        uint32_t group;
        uint32_t identity;  // of the group, for seeds
        float light;        // radiance times solid angle, about
        bool wide;          // it fills a share of the hemisphere that counts
        uint32_t cell;
        std::vector<Choice> choices;  // ascending by patch; empty: not kept
    };
    uint32_t cellAt(glm::vec3 point) const { return grid_.at(point); }
    // The groups worth sampling from `cell`.
    std::span<const CellGroup> groups(uint32_t cell) const;

    // `choice`, `u`: uniform in 0..1: which emitter, and where on it.
    EmitterSample sample(const CellGroup& from, glm::vec3 point, float choice, glm::vec2 u) const;

    // The emitter of a level triangle, or null.
    const Emitter* emitterOf(uint32_t triangle) const;
    // The density per steradian with which sample() from `cell` finds the direction to a hit on `emitter`.
    float pdf(uint32_t cell, const Emitter& emitter, float distance_m, float cos_emitter) const;

    bool empty() const { return emitters_.empty(); }
    std::span<const Emitter> emitters() const { return emitters_; }
    // Of the cells that list a group.
    size_t keptChoices() const;

   private:
    using Cell = std::vector<CellGroup>;
    std::vector<uint8_t> litCells(const RayScene& rays, std::span<const Emitter> of_group) const;
    // Emitters of one group, one after another in emitters_.
    struct Patch {
        uint32_t begin = 0, end = 0;
        glm::vec3 centre{0}, normal{0};
        float radius_m = 0, normal_spread = 0;  // about the centre, and radians about the normal
        float area_m2 = 0, power = 0, brightest = 0;
        bool double_sided = false;
    };
    void makePatches();
    void addHalves(uint32_t begin, uint32_t end, uint32_t patches);
    void addPatch(uint32_t begin, uint32_t end);
    struct PatchRange {
        uint32_t begin = 0, end = 0;
    };
    // The choices, ascending by patch, and the rest of what a CellGroup says.
    struct Chances {
        std::vector<Choice> choices;
        float light = 0;
        bool wide = false;
    };
    // What a worker asked for last of what is not kept. Texels of a cell follow one another.
    struct Recent {
        struct Slot {
            uint32_t cell = UINT32_MAX, group = 0;
            std::vector<Choice> choices;
        };
        std::array<Slot, 1024> slots;  // at most 8 kB each
    };
    Chances chancesAt(uint32_t cell, uint32_t group) const;
    // To be used before the next call by the same thread.
    std::span<const Choice> choicesOf(const CellGroup& from) const;
    // `lit`: per light group, the cells that it shines into; empty where it has no emitters.
    void fillCell(uint32_t cell, std::span<const std::vector<uint8_t>> lit, std::atomic<size_t>& kept,
                  size_t choices_max);
    void leaveFaintGroups();
    float chanceWithin(uint32_t emitter) const;  // its patch
    static float facing(const Patch& patch, glm::vec3 to_centre, float radius_m);

    std::vector<Emitter> emitters_;  // sorted by group
    std::vector<float> within_;      // per emitter: the chance of it and of those before it in its patch
    std::vector<uint32_t> patch_of_emitter_;
    std::vector<uint32_t> emitter_of_;
    std::vector<Patch> patches_;  // in the order of their emitters
    std::vector<PatchRange> patches_of_group_;
    std::vector<uint32_t> identities_;  // per light group
    CellGrid grid_;
    std::vector<Cell> cells_;
    mutable tbb::enumerable_thread_specific<Recent> recent_;
};

}  // namespace dimmer::cook
