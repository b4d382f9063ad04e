// Light and doors: which doors have to stand open, and which closed, for light to take its path. Every such set of
// conditions is a path here, and every light group over every kept path a term: what packs store as a contribution.
//
// A leaf is there while its condition holds. Light that reflects off it needs the condition; light that goes through
// the place of it needs the opposite. Both at once cannot be. Summed over all paths this is exact for every state of
// the doors, each open or closed.
#pragma once

#include <scene/scene.h>
#include <trace/ray_scene.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace dimmer::cook {

inline constexpr uint32_t free_path = 0;  // touches no door
inline constexpr uint32_t no_path = UINT32_MAX;
inline constexpr uint32_t no_term = UINT32_MAX;
inline constexpr uint32_t no_door = UINT32_MAX;

// Into Scene::doors, the first less than the second.
using DoorIndices = std::pair<uint32_t, uint32_t>;

// Light group 0 is all always-on light; group 1 + s is light set s.
inline constexpr uint32_t always_group = 0;
// The group of what belongs to an optional light set.
inline uint32_t groupOf(std::optional<uint32_t> light_set) {
    return light_set ? 1 + *light_set : always_group;
}

// Whether the group can never be off: light set or not (pipeline/lamps_apart.h).
bool isAlwaysOn(const Scene& scene, uint32_t group);

// A number of the group's own for seeds: from its set's name, so that other sets, added or removed, change no noise.
uint32_t groupIdentity(const Scene& scene, uint32_t group);

// One light group over paths that need these doors to be open or closed (indices into Scene::doors, ascending).
struct Term {
    uint32_t group = always_group;
    std::vector<uint32_t> doors_open, doors_closed;
    bool free() const { return doors_open.empty() && doors_closed.empty(); }
    bool isAbout(uint32_t door) const {
        return std::ranges::binary_search(doors_open, door) || std::ranges::binary_search(doors_closed, door);
    }
};

// How a leaf stands to light whose path is known so far.
enum class Leaf {
    Absent,  // the path needs the opposite
    There,   // the path needs it
    Either,  // the path parts here: one reflects off the leaf, one goes on
};

// Kept: every term with at most one door, those of two doors that both have to be closed, where these see each other,
// and what `dimmer_combinations` names with all of its parts. A combination with a light set keeps that set's terms
// alone, one without keeps every group's. Light that needs more doors than are kept together goes to the term without
// some that it needs closed: states with no door open, and with one, have it. (It stays when such a door opens: light
// off three closed doors, or off two that do not see each other, is a little too much where the one left out is open.
// Which one that is depends on what any combination names.) Answers never change, and may be asked for by many threads.
// Pairs of paths are joined when they are asked for, and remembered in a table of fixed size: of a hall with many doors
// there are too many for all of them, and most never meet.
class DoorPaths {
   public:
    // `closed_together`: see doorsInSight() (bake/door_pairs.h).
    explicit DoorPaths(const Scene& scene, std::span<const DoorIndices> closed_together = {});

    uint32_t doorCount() const { return condition_count_ / 2; }
    uint32_t pathCount() const { return static_cast<uint32_t>(paths_.size()); }
    // The first terms are the light groups over free paths, so that a term below groupCount() is its own group.
    const std::vector<Term>& terms() const { return terms_; }
    uint32_t termCount() const { return static_cast<uint32_t>(terms_.size()); }
    uint32_t groupCount() const { return group_count_; }
    // Ascending.
    const std::vector<uint32_t>& termsOf(uint32_t group) const { return terms_of_[group]; }
    uint32_t group(uint32_t term) const { return group_of_[term]; }
    // The term's place among those of its group.
    uint32_t numberInGroup(uint32_t term) const { return number_in_group_[term]; }

    // The path that needs `condition` too, or what is kept instead; no_path where there is none or the two contradict.
    uint32_t with(uint32_t path, uint32_t condition) const { return joined(path, single_[condition]); }
    bool needs(uint32_t path, uint32_t condition) const { return needs_[path * condition_count_ + condition] != 0; }
    // `own`: the condition under which the receiver itself is there (a leaf's), or no_condition.
    Leaf leaf(uint32_t path, uint32_t own, uint32_t condition) const {
        if (own == condition || needs(path, condition)) return Leaf::There;
        if (own == (condition ^ 1) || needs(path, condition ^ 1)) return Leaf::Absent;
        return Leaf::Either;
    }
    // Or the one kept instead; no_term where there is none.
    uint32_t term(uint32_t group, uint32_t path) const {
        return path == no_path ? no_term : term_of_[path * group_count_ + group];
    }
    // Of a term that needs a door open and others closed, the one that asks for one closed door less: light too faint
    // for records of its own counts there, and is too much only while that door is open as well. no_term: there is
    // none.
    uint32_t lessClosed(uint32_t term) const { return less_closed_[term]; }
    // All terms whose lessClosed() is `term`.
    const std::vector<uint32_t>& moreClosed(uint32_t term) const { return more_closed_[term]; }
    // The one door that a term is about; no_door where there are none or several.
    uint32_t onlyDoor(uint32_t term) const { return only_door_[term]; }
    // What light of term `from` becomes along a ray of `path` to a receiver that is there under `own`, whose terms do
    // not name that condition; no_term where it is not kept or cannot be.
    uint32_t moved(uint32_t from, uint32_t path, uint32_t own) const {
        uint32_t behind = path_of_[from];
        if (own != no_condition) behind = without_[behind * condition_count_ + own];
        if (behind == no_path) return no_term;
        return term(group_of_[from], joined(path, behind));
    }
    // What light of term `from` at a receiver that is there under `own` becomes as it leaves.
    uint32_t leaving(uint32_t from, uint32_t own) const {
        return own == no_condition ? from : term(group_of_[from], with(path_of_[from], own));
    }

   private:
    using Conditions = std::vector<uint32_t>;  // ascending

    // A pair of paths and what they join to, in one number, so that threads that write one slot leave no mixture.
    struct Join {
        static constexpr uint32_t bits = 21, none = (1u << bits) - 1;
        static uint64_t key(uint32_t a, uint32_t b) { return uint64_t{a} << 2 * bits | uint64_t{b} << bits; }
    };
    static constexpr size_t joins_max = size_t{1} << 20;  // slots: 8 MB

    // The path that needs what both do, or what is kept instead; no_path where they contradict.
    uint32_t joined(uint32_t a, uint32_t b) const {
        if (a == free_path || b == free_path) return std::max(a, b);
        const uint64_t key = Join::key(a, b);
        std::atomic<uint64_t>& slot = joins_[(uint64_t{a} * paths_.size() + b) & join_mask_];
        const uint64_t found = slot.load(std::memory_order_relaxed) ^ key;
        if (found <= Join::none) return found == Join::none ? no_path : static_cast<uint32_t>(found);
        return join(a, b, slot);
    }
    uint32_t join(uint32_t a, uint32_t b, std::atomic<uint64_t>& slot) const;
    uint32_t find(const Conditions& conditions) const;

    uint32_t condition_count_ = 0, group_count_ = 1;
    std::vector<Conditions> paths_;
    std::map<Conditions, uint32_t> path_at_;
    std::vector<uint32_t> single_;   // per condition: the path that needs it alone
    std::vector<uint8_t> needs_;     // path, condition
    std::vector<uint32_t> without_;  // path, condition: without it; no_path where it needs the opposite
    std::unique_ptr<std::atomic<uint64_t>[]> joins_;
    uint64_t join_mask_ = 0;
    std::vector<uint32_t> term_of_;                   // path, group
    std::vector<uint32_t> path_of_, group_of_;        // per term
    std::vector<uint32_t> only_door_, less_closed_;   // per term
    std::vector<std::vector<uint32_t>> more_closed_;  // per term
    std::vector<Term> terms_;
    std::vector<uint32_t> number_in_group_;        // per term
    std::vector<std::vector<uint32_t>> terms_of_;  // per group
};

}  // namespace dimmer::cook
