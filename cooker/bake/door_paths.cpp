#include <bake/door_paths.h>

#include <bake/sampling.h>

#include <algorithm>
#include <bit>
#include <set>

namespace dimmer::cook {
namespace {

using Conditions = std::vector<uint32_t>;  // ascending

// Every way that some of `doors`, from `first` on, may stand open or closed.
void addStates(const std::vector<uint32_t>& doors, size_t first, const Conditions& so_far, std::set<Conditions>& out) {
    out.insert(so_far);
    for (size_t i = first; i < doors.size(); ++i)
        for (uint32_t open : {0u, 1u}) {
            Conditions more = so_far;
            more.push_back(2 * doors[i] + open);
            addStates(doors, i + 1, more, out);
        }
}

// The conditions of both; empty where they contradict.
std::optional<Conditions> join(const Conditions& a, const Conditions& b) {
    Conditions all;
    std::ranges::set_union(a, b, std::back_inserter(all));
    for (size_t i = 1; i < all.size(); ++i)
        if (all[i] == (all[i - 1] ^ 1)) return std::nullopt;
    return all;
}

// Per light group, the paths that are kept.
std::vector<std::set<Conditions>> keptPaths(const Scene& scene, std::span<const DoorIndices> closed_together,
                                            uint32_t groups) {
    std::set<Conditions> everyone;
    for (uint32_t door = 0; door < scene.doors.size(); ++door) addStates({door}, 0, {}, everyone);
    everyone.insert(Conditions{});
    for (const auto& [a, b] : closed_together) everyone.insert(Conditions{2 * a, 2 * b});
    std::vector<std::set<Conditions>> kept(groups, everyone);
    for (const auto& combination : scene.combinations) {
        std::vector<uint32_t> doors;
        std::optional<uint32_t> set;
        for (const ElementRef& element : combination) {
            if (element.is_door)
                doors.push_back(element.index);
            else
                set = element.index;
        }
        std::ranges::sort(doors);
        for (uint32_t g = 0; g < groups; ++g)
            if (!set || g == groupOf(set)) addStates(doors, 0, {}, kept[g]);
    }
    return kept;
}

// What a path is taken for where it is not kept: doors that no combination names together are baked each with the
// others closed, so that they have to be need not be said. That one has to be open cannot be left out.
std::optional<Conditions> nearestKept(const Conditions& path, const auto& kept) {
    if (kept.contains(path)) return path;
    for (std::set<Conditions> tried = {path}; !tried.empty();) {
        std::set<Conditions> shorter;
        for (const Conditions& c : tried) {
            if (kept.contains(c)) return c;
            for (size_t i = 0; i < c.size(); ++i) {
                if (c[i] & 1) continue;
                Conditions rest = c;
                rest.erase(rest.begin() + static_cast<ptrdiff_t>(i));
                shorter.insert(std::move(rest));
            }
        }
        tried = std::move(shorter);
    }
    return std::nullopt;
}

Term makeTerm(uint32_t group, const Conditions& conditions) {
    Term term{group, {}, {}};
    for (uint32_t c : conditions) (c & 1 ? term.doors_open : term.doors_closed).push_back(c / 2);
    return term;
}

}  // namespace

bool isAlwaysOn(const Scene& scene, uint32_t group) {
    return group == always_group || scene.light_sets[group - 1].always_on;
}

uint32_t groupIdentity(const Scene& scene, uint32_t group) {
    if (group == always_group) return 0;
    uint32_t id = 1;
    for (const char c : scene.light_sets[group - 1].name) id = hash(id, static_cast<unsigned char>(c));
    return id;
}

DoorPaths::DoorPaths(const Scene& scene, std::span<const DoorIndices> closed_together)
    : condition_count_(2 * static_cast<uint32_t>(scene.doors.size())),
      group_count_(1 + static_cast<uint32_t>(scene.light_sets.size())) {
    const auto kept = keptPaths(scene, closed_together, group_count_);
    std::set<Conditions> all;
    for (const auto& of_group : kept) all.insert(of_group.begin(), of_group.end());
    paths_.assign(all.begin(), all.end());
    std::ranges::stable_sort(paths_, {}, &Conditions::size);  // the free path first
    for (const Conditions& path : paths_) path_at_.emplace(path, static_cast<uint32_t>(path_at_.size()));
    for (uint32_t c = 0; c < condition_count_; ++c) single_.push_back(path_at_.at({c}));
    needs_.resize(paths_.size() * condition_count_);
    without_.resize(needs_.size());
    for (uint32_t p = 0; p < paths_.size(); ++p) {
        const size_t row = size_t{p} * condition_count_;
        std::fill_n(without_.begin() + static_cast<ptrdiff_t>(row), condition_count_, p);
        for (const uint32_t c : paths_[p]) {
            Conditions rest = paths_[p];
            std::erase(rest, c);
            without_[row + c] = find(rest);
            without_[row + (c ^ 1)] = no_path;
            needs_[row + c] = 1;
        }
    }
    // Without collisions where all pairs have a slot each; else a pair displaces another one.
    join_mask_ = std::bit_ceil(std::min(paths_.size() * paths_.size(), joins_max)) - 1;
    joins_ = std::make_unique<std::atomic<uint64_t>[]>(join_mask_ + 1);
    term_of_.assign(paths_.size() * group_count_, no_term);
    terms_of_.resize(group_count_);
    for (uint32_t p = 0; p < paths_.size(); ++p)
        for (uint32_t g = 0; g < group_count_; ++g) {
            if (!kept[g].contains(paths_[p])) continue;
            term_of_[p * group_count_ + g] = static_cast<uint32_t>(terms_.size());
            number_in_group_.push_back(static_cast<uint32_t>(terms_of_[g].size()));
            terms_of_[g].push_back(static_cast<uint32_t>(terms_.size()));
            terms_.push_back(makeTerm(g, paths_[p]));
            path_of_.push_back(p);
            group_of_.push_back(g);
            only_door_.push_back(paths_[p].size() == 1 ? paths_[p][0] / 2 : no_door);
        }
    less_closed_.assign(terms_.size(), no_term);
    more_closed_.resize(terms_.size());
    for (uint32_t t = 0; t < terms_.size(); ++t) {
        if (terms_[t].doors_open.empty() || terms_[t].doors_closed.empty()) continue;
        less_closed_[t] =
            term(group_of_[t], without_[path_of_[t] * condition_count_ + 2 * terms_[t].doors_closed.back()]);
        more_closed_[less_closed_[t]].push_back(t);
    }
    for (uint32_t g = 0; g < group_count_; ++g)
        for (uint32_t p = 0; p < paths_.size(); ++p) {
            if (kept[g].contains(paths_[p])) continue;
            const auto instead = nearestKept(paths_[p], kept[g]);
            if (instead) term_of_[p * group_count_ + g] = term_of_[path_at_.at(*instead) * group_count_ + g];
        }
}

// Of conditions that do not contradict each other: the path, or what is kept instead.
uint32_t DoorPaths::find(const Conditions& conditions) const {
    const auto kept_path = nearestKept(conditions, path_at_);
    return kept_path ? path_at_.at(*kept_path) : no_path;
}

uint32_t DoorPaths::join(uint32_t a, uint32_t b, std::atomic<uint64_t>& slot) const {
    const auto all = cook::join(paths_[a], paths_[b]);
    const uint32_t path = all ? find(*all) : no_path;
    // Of so many paths that their numbers do not fit, joins are found anew each time.
    if (paths_.size() < Join::none) slot.store(Join::key(a, b) | std::min(path, Join::none), std::memory_order_relaxed);
    return path;
}

}  // namespace dimmer::cook
