// The stages of a cook that are kept from one cook to the next, and what is said of them.
#pragma once

#include <cache/entries.h>
#include <cache/scene_keys.h>
#include <cache/store.h>
#include <pipeline/fit.h>

#include <map>
#include <string>
#include <vector>

namespace dimmer::cook {

// What became of one stage.
struct CacheLine {
    std::string what;  // "charts", "always-on light", "light set 'hall'", "global grid", "pack"
    bool reused = false;
    std::string why;  // it had to be made again; empty where it was reused
};

// A pack and what its cook had to say.
struct PackEntry {
    std::vector<std::byte> pack;
    uint32_t bounces = 0;
    std::vector<std::string> warnings;
    std::vector<std::vector<std::string>> suggested_combinations;
    std::vector<std::string> parts;  // names of the entries that it was made from: whoever finds the pack uses them too
    std::map<std::string, std::string> depends;  // part -> key of what they depend on, as of CookCache::dependsOn
    std::vector<Remedy> fitted;                  // what `--fit` changed
};

// The cache as one cook of one pack uses it. Remembers what the last cook of the pack depended on, to say what changed.
class CookCache {
   public:
    CookCache(CacheStore store, const std::filesystem::path& pack);

    // What the cook depends on, by name; the names of those that differ from the last cook's explain what is made
    // again.
    void dependsOn(const std::string& part, const Key& key);
    // Of those after the first, which cook with other settings: each is compared with the last cook's same round.
    void beginRound(int round);

    std::optional<ChartsEntry> findCharts(const Key& key);
    void keepCharts(const Key& key, const ChartsEntry& entry);
    std::optional<PackEntry> findPack(const Key& key);
    void keepPack(const Key& key, PackEntry entry);
    std::optional<GroupLight> findGroup(const std::string& what, const Key& key);
    void keepGroup(const Key& key, const GroupLight& light);
    // Of the global grid: all of it; a group's light at places where probes may stand, and what its surfaces send out.
    // `parts`: of all groups, what the grid depends on.
    std::optional<BakedGrid> findGrid(const Key& key, const std::vector<std::string>& parts);
    void keepGrid(const Key& key, const BakedGrid& grid);
    std::vector<Sparse<ProbeTermLight>> findSites(const std::string& what, const Key& group,
                                                  std::span<const SiteBlock> blocks);
    void keepSites(const Key& group, std::span<const SiteBlock> blocks, std::span<const Sparse<ProbeTermLight>> light,
                   std::span<const size_t> fresh);
    std::optional<std::vector<glm::vec3>> findPlaces(const Key& key);
    void keepPlaces(const Key& key, std::span<const glm::vec3> places);
    std::optional<SparseLight> findRadiance(const Key& key);
    void keepRadiance(const Key& key, const SparseLight& radiance);
    // Where rays end.
    std::optional<RayEnds> findRays(const Key& key, size_t rows, uint32_t receivers, uint32_t paths);
    void keepRays(const Key& key, const RayEnds& ends);

    // Ends the cook: removes old entries, and remembers what this one depended on. Warns where that removes what this
    // very cook used.
    void finish(uint64_t bytes_max);

    // Takes back what this cook has kept where that gives so many bytes back to the disk of `folder`. False: it does
    // not, and nothing was removed.
    bool removeKeptFor(const std::filesystem::path& folder, uint64_t bytes);

    const std::vector<CacheLine>& lines() const { return lines_; }
    // What did not work; the cook goes on without.
    const std::vector<std::string>& warnings() const { return warnings_; }

   private:
    // What `decode` makes of an entry's bytes; an entry that it makes nothing of is damaged.
    template <class Decode>
    auto look(std::string_view kind, const Key& key, Find& how, Decode decode) -> decltype(decode({}));
    // The same, with a line of its own.
    template <class Decode>
    auto find(std::string_view kind, const std::string& what, const Key& key, const std::vector<std::string>& parts,
              Decode decode) -> decltype(decode({}));
    void keep(std::string_view kind, const Key& key, std::span<const std::byte> bytes);
    void note(const std::string& name, const Expected<void>& kept);
    std::string whyMissing(Find find, const std::vector<std::string>& parts) const;
    // Of entries of one kind, which are told of together.
    struct Tally {
        size_t asked = 0, missing = 0;
        Find worst = Find::Missing;
        void add(Find find);
    };
    void tell(const std::string& what, const Tally& tally);

    CacheStore store_;
    Key ledger_;
    std::string round_;  // before the names of what a further round of `--fit` makes and depends on
    std::map<std::string, std::string> last_, now_;  // part -> key
    std::vector<std::string> used_;                  // entries found or kept, by name
    std::vector<std::string> kept_;                  // by this cook, likewise
    std::vector<CacheLine> lines_;
    Tally places_, radiance_, rays_;
    std::vector<std::string> warnings_;
};

// The groups of one bake.
class CachedGroups final : public GroupStore {
   public:
    // `keys`: per light group; `rays`: what rays depend on.
    CachedGroups(CookCache& cache, const Scene& scene, std::vector<Key> keys, const Key& grid, const Key& rays)
        : cache_(cache), scene_(scene), keys_(std::move(keys)), grid_(grid), rays_(rays) {}
    std::optional<GroupLight> find(uint32_t group) override;
    void keep(uint32_t group, const GroupLight& light) override { cache_.keepGroup(keys_[group], light); }
    std::optional<BakedGrid> findGrid() override;
    void keepGrid(const BakedGrid& grid) override { cache_.keepGrid(grid_, grid); }
    std::optional<std::vector<glm::vec3>> findPlaces(std::span<const float> what) override {
        return cache_.findPlaces(placesKey(rays_, what));
    }
    void keepPlaces(std::span<const float> what, std::span<const glm::vec3> places) override {
        cache_.keepPlaces(placesKey(rays_, what), places);
    }
    std::vector<Sparse<ProbeTermLight>> findSites(uint32_t group, std::span<const SiteBlock> blocks) override;
    void keepSites(uint32_t group, std::span<const SiteBlock> blocks, std::span<const Sparse<ProbeTermLight>> light,
                   std::span<const size_t> fresh) override {
        cache_.keepSites(keys_[group], blocks, light, fresh);
    }
    std::optional<SparseLight> findRadiance(uint32_t group) override { return cache_.findRadiance(keys_[group]); }
    void keepRadiance(uint32_t group, const SparseLight& radiance) override {
        cache_.keepRadiance(keys_[group], radiance);
    }
    std::optional<RayEnds> findRays(std::string_view kind, std::span<const glm::vec3> places, size_t rows,
                                    uint32_t receivers, uint32_t paths) override {
        return cache_.findRays(raysKey(rays_, kind, places), rows, receivers, paths);
    }
    void keepRays(std::string_view kind, std::span<const glm::vec3> places, const RayEnds& ends) override {
        cache_.keepRays(raysKey(rays_, kind, places), ends);
    }

   private:
    CookCache& cache_;
    const Scene& scene_;
    std::vector<Key> keys_;
    Key grid_, rays_;
};

// What the order of the groups' lamps is called, see lampOrderKey().
inline constexpr const char* lamp_order_part = "order of lamps";

// "always-on light" or "light set 'hall'".
std::string describeGroup(const Scene& scene, uint32_t group);

}  // namespace dimmer::cook
