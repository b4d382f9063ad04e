#include <pipeline/cook_cache.h>

#include <format/byte_stream.h>
#include <pipeline/human_bytes.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <sstream>

namespace dimmer::cook {
namespace {

constexpr std::string_view charts_kind = "charts", light_kind = "light", pack_kind = "pack", ledger_kind = "ledger",
                           grid_kind = "grid", sites_kind = "sites", radiance_kind = "radiance", rays_kind = "rays",
                           places_kind = "places";

constexpr size_t site_entries_max = 32;  // per light group

size_t blocksPerEntry(size_t blocks) {
    return std::max<size_t>(1, (blocks + site_entries_max - 1) / site_entries_max);
}

void put(const Remedy& remedy, format::ByteWriter& out) {
    out.put(static_cast<uint32_t>(remedy.changes.size()));
    for (const Change& c : remedy.changes) {
        out.putString(c.key);
        out.put(c.from);
        out.put(c.to);
    }
    out.put(remedy.saves);
    out.put(remedy.error);
    out.put(remedy.energy);
    out.putString(remedy.energy_of);
    for (const bool flag : {remedy.fits, remedy.moves_light, remedy.texels, remedy.grid_error.has_value()})
        out.put(static_cast<uint32_t>(flag));
    out.put(remedy.grid_error.value_or(0));
}

Remedy getRemedy(format::ByteReader& in) {
    Remedy remedy;
    for (uint64_t n = in.get<uint32_t>(); in.fits(n, 1) && n > 0; --n) {
        Change& c = remedy.changes.emplace_back();
        c.key = in.getString();
        c.from = in.get<float>();
        c.to = in.get<float>();
    }
    remedy.saves = in.get<uint64_t>();
    remedy.error = in.get<double>();
    remedy.energy = in.get<double>();
    remedy.energy_of = in.getString();
    bool grid_error_is_known = false;
    for (bool* flag : {&remedy.fits, &remedy.moves_light, &remedy.texels, &grid_error_is_known})
        *flag = in.get<uint32_t>() != 0;
    const auto grid_error = in.get<double>();
    if (grid_error_is_known) remedy.grid_error = grid_error;
    return remedy;
}

std::vector<std::byte> toBytes(const PackEntry& entry) {
    format::ByteWriter out;
    out.put(entry.bounces);
    out.put(static_cast<uint32_t>(entry.warnings.size()));
    for (const std::string& warning : entry.warnings) out.putString(warning);
    out.put(static_cast<uint32_t>(entry.suggested_combinations.size()));
    for (const std::vector<std::string>& doors : entry.suggested_combinations) {
        out.put(static_cast<uint32_t>(doors.size()));
        for (const std::string& door : doors) out.putString(door);
    }
    out.put(static_cast<uint32_t>(entry.parts.size()));
    for (const std::string& part : entry.parts) out.putString(part);
    out.put(static_cast<uint32_t>(entry.depends.size()));
    for (const auto& [part, key] : entry.depends) {
        out.putString(part);
        out.putString(key);
    }
    out.put(static_cast<uint32_t>(entry.fitted.size()));
    for (const Remedy& remedy : entry.fitted) put(remedy, out);
    out.putArray(std::span<const std::byte>(entry.pack));
    return out.take();
}

std::optional<PackEntry> packFromBytes(std::span<const std::byte> bytes) {
    format::ByteReader in(bytes);
    PackEntry entry;
    entry.bounces = in.get<uint32_t>();
    for (uint64_t n = in.get<uint32_t>(); in.fits(n, 1) && n > 0; --n) entry.warnings.push_back(in.getString());
    for (uint64_t n = in.get<uint32_t>(); in.fits(n, 1) && n > 0; --n) {
        auto& doors = entry.suggested_combinations.emplace_back();
        for (uint64_t names = in.get<uint32_t>(); in.fits(names, 1) && names > 0; --names)
            doors.push_back(in.getString());
    }
    for (uint64_t n = in.get<uint32_t>(); in.fits(n, 1) && n > 0; --n) entry.parts.push_back(in.getString());
    for (uint64_t n = in.get<uint32_t>(); in.fits(n, 1) && n > 0; --n) {
        std::string part = in.getString();
        entry.depends[std::move(part)] = in.getString();
    }
    for (uint64_t n = in.get<uint32_t>(); in.fits(n, 1) && n > 0; --n) entry.fitted.push_back(getRemedy(in));
    entry.pack = in.getArray<std::byte>();
    return in.atEnd() ? std::optional(std::move(entry)) : std::nullopt;
}

// "part\tkey" lines.
std::map<std::string, std::string> readLedger(std::span<const std::byte> bytes) {
    std::map<std::string, std::string> parts;
    std::istringstream text(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    for (std::string part, key; std::getline(text, part, '\t') && std::getline(text, key);) parts[part] = key;
    return parts;
}

Key partKey(const Key& whole, size_t part) {
    return KeyBuilder("part").add(whole).add(uint64_t{part}).finish();
}

std::vector<std::string> partsOfGroup(const std::string& what) {
    return {
        "code", "geometry", "settings of charts", "settings of the bake", "threshold of " + what, "lamps of " + what};
}

}  // namespace

CookCache::CookCache(CacheStore store, const std::filesystem::path& pack) : store_(std::move(store)) {
    std::error_code ignored;
    const auto place = std::filesystem::weakly_canonical(std::filesystem::absolute(pack, ignored), ignored);
    ledger_ = KeyBuilder::ofAnyCode(ledger_kind).add(place.string()).finish();
    last_ = readLedger(store_.find(ledger_kind, ledger_).bytes);
    dependsOn("code", KeyBuilder("code").finish());
}

void CookCache::dependsOn(const std::string& part, const Key& key) {
    now_[round_ + part] = key.hex();
}

void CookCache::beginRound(int round) {
    round_ = round == 0 ? "" : fmt::format("fit round {}: ", round + 1);
}

std::string CookCache::whyMissing(Find find, const std::vector<std::string>& parts) const {
    if (find == Find::Damaged) return "the entry is damaged";
    if (last_.empty()) return "first cook of this pack here";
    std::vector<std::string> changed;
    for (const std::string& part : parts) {
        // What all rounds depend on alike has no round's name.
        const std::string named = now_.contains(round_ + part) ? round_ + part : part;
        const auto now = now_.find(named), last = last_.find(named);
        if (now == now_.end()) continue;
        if (last == last_.end())
            changed.push_back(part + " is new");
        else if (last->second != now->second)
            changed.push_back(part + " changed");
    }
    return changed.empty() ? "no longer in the cache" : fmt::format("{}", fmt::join(changed, ", "));
}

template <class Decode>
auto CookCache::look(std::string_view kind, const Key& key, Find& how, Decode decode) -> decltype(decode({})) {
    const Entry entry = store_.find(kind, key);
    how = entry.find;
    if (how != Find::Hit) return {};
    auto found = decode(entry.bytes);
    if (found)
        used_.push_back(CacheStore::nameOf(kind, key));
    else
        how = Find::Damaged;
    return found;
}

template <class Decode>
auto CookCache::find(std::string_view kind, const std::string& what, const Key& key,
                     const std::vector<std::string>& parts, Decode decode) -> decltype(decode({})) {
    Find how;
    auto found = look(kind, key, how, decode);
    lines_.push_back({round_ + what, found.has_value(), found ? "" : whyMissing(how, parts)});
    return found;
}

void CookCache::keep(std::string_view kind, const Key& key, std::span<const std::byte> bytes) {
    note(CacheStore::nameOf(kind, key), store_.keep(kind, key, bytes));
}

void CookCache::note(const std::string& name, const Expected<void>& kept) {
    used_.push_back(name);
    if (kept) kept_.push_back(name);
    if (!kept && warnings_.empty()) warnings_.push_back("the cache takes no entries: " + kept.error().message);
}

std::optional<ChartsEntry> CookCache::findCharts(const Key& key) {
    return find(charts_kind, "charts", key, {"code", "geometry", "settings of charts"}, chartsFromBytes);
}

void CookCache::keepCharts(const Key& key, const ChartsEntry& entry) {
    keep(charts_kind, key, cook::toBytes(entry));
}

std::optional<PackEntry> CookCache::findPack(const Key& key) {
    auto entry = find(pack_kind, "pack", key, {"code", "level", "settings"}, packFromBytes);
    if (!entry) return entry;
    for (const std::string& part : entry->parts) {
        store_.markUsed(part);
        used_.push_back(part);
    }
    now_.insert(entry->depends.begin(), entry->depends.end());  // a cook that finds all asks for no parts
    return entry;
}

void CookCache::keepPack(const Key& key, PackEntry entry) {
    std::ranges::sort(used_);
    used_.erase(std::unique(used_.begin(), used_.end()), used_.end());
    entry.parts = used_;
    entry.depends = now_;
    keep(pack_kind, key, toBytes(entry));
}

std::optional<GroupLight> CookCache::findGroup(const std::string& what, const Key& key) {
    return find(light_kind, what, key, partsOfGroup(what), groupFromBytes);
}

void CookCache::keepGroup(const Key& key, const GroupLight& light) {
    keep(light_kind, key, cook::toBytes(light));
}

std::optional<BakedGrid> CookCache::findGrid(const Key& key, const std::vector<std::string>& parts) {
    return find(grid_kind, "global grid", key, parts, gridFromBytes);
}

void CookCache::keepGrid(const Key& key, const BakedGrid& grid) {
    keep(grid_kind, key, cook::toBytes(grid));
}

// An entry holds a few blocks: what is new is written and little else again, and a level of hundreds of lamps has no
// thousands of files.
std::vector<Sparse<ProbeTermLight>> CookCache::findSites(const std::string& what, const Key& group,
                                                         std::span<const SiteBlock> blocks) {
    const size_t per_entry = blocksPerEntry(blocks.size()), count = (blocks.size() + per_entry - 1) / per_entry;
    std::vector<Entry> entries(count);
    std::vector<Sparse<ProbeTermLight>> light(blocks.size());
    const auto of = [&](size_t e) {
        return blocks.subspan(e * per_entry).first(std::min(per_entry, blocks.size() - e * per_entry));
    };
    const auto isEmpty = [&](size_t e) {
        return std::ranges::all_of(of(e), &std::vector<glm::vec3>::empty, &SiteBlock::places_m);
    };
    tbb::parallel_for(size_t{0}, count, [&](size_t e) {
        if (isEmpty(e)) return;
        entries[e] = store_.find(sites_kind, sitesKey(group, of(e)));
        if (entries[e].find != Find::Hit) return;
        if (auto found = siteLightFromBytes(entries[e].bytes, of(e).size()))
            std::ranges::move(*found, light.begin() + static_cast<std::ptrdiff_t>(e * per_entry));
        else
            entries[e].find = Find::Damaged;
    });
    size_t missing = 0, asked = 0;
    Find worst = Find::Missing;
    for (size_t e = 0; e < count; ++e) {
        if (isEmpty(e)) continue;
        asked += of(e).size();
        if (entries[e].find == Find::Hit)
            used_.push_back(CacheStore::nameOf(sites_kind, sitesKey(group, of(e))));
        else
            missing += of(e).size();
        if (entries[e].find == Find::Damaged) worst = Find::Damaged;
    }
    std::string why;
    if (missing > 0)
        why = missing == asked || worst == Find::Damaged
                  ? whyMissing(worst, partsOfGroup(what))
                  : fmt::format("{} of {} groups of places are new", missing, asked);
    lines_.push_back({round_ + "light at probe places: " + what, missing == 0, why});
    return light;
}

void CookCache::keepSites(const Key& group, std::span<const SiteBlock> blocks,
                          std::span<const Sparse<ProbeTermLight>> light, std::span<const size_t> fresh) {
    const size_t per_entry = blocksPerEntry(blocks.size());
    std::vector<size_t> first;  // blocks of the entries that are new
    for (const size_t b : fresh)
        if (first.empty() || b / per_entry != first.back() / per_entry) first.push_back(b - b % per_entry);
    std::vector<Expected<void>> kept(first.size());
    const auto of = [&](auto all, size_t i) {
        return all.subspan(first[i]).first(std::min(per_entry, all.size() - first[i]));
    };
    tbb::parallel_for(size_t{0}, first.size(), [&](size_t i) {
        kept[i] = store_.keep(sites_kind, sitesKey(group, of(blocks, i)), cook::toBytes(of(light, i)));
    });
    for (size_t i = 0; i < first.size(); ++i)
        note(CacheStore::nameOf(sites_kind, sitesKey(group, of(blocks, i))), kept[i]);
}

std::optional<std::vector<glm::vec3>> CookCache::findPlaces(const Key& key) {
    Find how;
    auto found = look(places_kind, key, how, [](std::span<const std::byte> bytes) {
        format::ByteReader in(bytes);
        auto places = in.getArray<glm::vec3>();
        return in.atEnd() ? std::optional(std::move(places)) : std::nullopt;
    });
    places_.add(how);
    return found;
}

void CookCache::keepPlaces(const Key& key, std::span<const glm::vec3> places) {
    format::ByteWriter out;
    out.putArray(places);
    keep(places_kind, key, out.take());
}

std::optional<SparseLight> CookCache::findRadiance(const Key& key) {
    Find how;
    auto found = look(radiance_kind, key, how, radianceFromBytes);
    radiance_.add(how);
    return found;
}

void CookCache::keepRadiance(const Key& key, const SparseLight& radiance) {
    keep(radiance_kind, key, cook::toBytes(radiance));
}

std::optional<RayEnds> CookCache::findRays(const Key& key, size_t rows, uint32_t receivers, uint32_t paths) {
    RayEnds ends(rows, receivers, paths);
    if (ends.parts() == 0) return {};
    std::vector<Find> found(ends.parts());
    tbb::parallel_for(size_t{0}, ends.parts(), [&](size_t part) {
        const Entry entry = store_.find(rays_kind, partKey(key, part));
        found[part] = entry.find;
        if (entry.find == Find::Hit && !ends.fromBytes(part, entry.bytes)) found[part] = Find::Damaged;
    });
    const Find worst = std::ranges::max(found);
    rays_.add(worst);
    if (worst != Find::Hit) return {};
    for (size_t part = 0; part < ends.parts(); ++part)
        used_.push_back(CacheStore::nameOf(rays_kind, partKey(key, part)));
    return ends;
}

void CookCache::keepRays(const Key& key, const RayEnds& ends) {
    std::vector<Expected<void>> kept(ends.parts());
    tbb::parallel_for(size_t{0}, ends.parts(), [&](size_t part) {
        kept[part] = store_.keep(rays_kind, partKey(key, part), ends.toBytes(part));
    });
    for (size_t part = 0; part < ends.parts(); ++part)
        note(CacheStore::nameOf(rays_kind, partKey(key, part)), kept[part]);
}

void CookCache::Tally::add(Find find) {
    ++asked;
    if (find == Find::Hit) return;
    ++missing;
    worst = std::max(worst, find);
}

void CookCache::tell(const std::string& what, const Tally& tally) {
    if (tally.asked == 0) return;
    std::string why;
    if (tally.missing > 0)
        why = tally.missing == tally.asked || tally.worst == Find::Damaged
                  ? whyMissing(tally.worst, {"code", "geometry", "settings of charts", "settings of the bake"})
                  : fmt::format("{} of {} are new", tally.missing, tally.asked);
    lines_.push_back({what, tally.missing == 0, why});
}

void CookCache::finish(uint64_t bytes_max) {
    tell("where rays end", rays_);
    tell("places in the open", places_);
    tell("light that surfaces send on", radiance_);
    // Of what this cook did not ask for, what is known stays.
    auto all = now_;
    all.insert(last_.begin(), last_.end());
    std::string ledger;
    for (const auto& [part, key] : all) ledger += part + "\t" + key + "\n";
    if (all != last_) keep(ledger_kind, ledger_, std::as_bytes(std::span(ledger)));
    const std::vector<std::string> removed = store_.trim(bytes_max);
    const auto lost = std::ranges::count_if(
        removed, [&](const std::string& name) { return std::ranges::find(used_, name) != used_.end(); });
    if (lost > 0)
        warnings_.push_back(
            fmt::format("{}: {} of the entries that this cook used do not fit the {} that the cache may hold, and were "
                        "removed: the next cook makes them again. Raise --cache-limit.",
                        store_.folder().string(), lost, humanBytes(bytes_max)));
}

bool CookCache::removeKeptFor(const std::filesystem::path& folder, uint64_t bytes) {
    struct stat here {
    }, there{};
    if (stat(store_.folder().c_str(), &here) != 0 || stat(folder.c_str(), &there) != 0 || here.st_dev != there.st_dev)
        return false;
    uint64_t kept = 0;
    constexpr uint64_t block_bytes = 512;  // of st_blocks
    for (const std::string& name : kept_)
        if (struct stat file{}; stat((store_.folder() / name).c_str(), &file) == 0)
            kept += block_bytes * static_cast<uint64_t>(file.st_blocks);
    if (kept < bytes) return false;
    for (const std::string& name : std::exchange(kept_, {})) store_.remove(name);
    return true;
}

std::string describeGroup(const Scene& scene, uint32_t group) {
    if (group == always_group) return "always-on light";
    const SceneLightSet& set = scene.light_sets[group - 1];
    return set.always_on ? set.name : fmt::format("light set '{}'", set.name);
}

std::optional<GroupLight> CachedGroups::find(uint32_t group) {
    return cache_.findGroup(describeGroup(scene_, group), keys_[group]);
}

std::optional<BakedGrid> CachedGroups::findGrid() {
    std::vector<std::string> parts = {"settings of the grid", lamp_order_part};
    for (uint32_t g = 0; g < keys_.size(); ++g)
        for (const std::string& part : partsOfGroup(describeGroup(scene_, g)))
            if (std::ranges::find(parts, part) == parts.end()) parts.push_back(part);
    return cache_.findGrid(grid_, parts);
}

std::vector<Sparse<ProbeTermLight>> CachedGroups::findSites(uint32_t group, std::span<const SiteBlock> blocks) {
    return cache_.findSites(describeGroup(scene_, group), keys_[group], blocks);
}

}  // namespace dimmer::cook
