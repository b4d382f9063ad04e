#include <fmt/format.h>
#include <scene/leftovers.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace dimmer::cook {
namespace {

std::string inSmallLetters(std::string text) {
    for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return text;
}

// Unreal's prefixes and Godot's suffixes.
bool isCollisionShape(const std::string& name) {
    constexpr std::array<std::string_view, 5> prefixes = {"ucx_", "ubx_", "usp_", "ucp_", "mcdcx_"};
    constexpr std::array<std::string_view, 2> suffixes = {"-colonly", "-convcolonly"};
    return std::ranges::any_of(prefixes, [&](std::string_view p) { return name.starts_with(p); }) ||
           std::ranges::any_of(suffixes, [&](std::string_view s) { return name.ends_with(s); });
}

constexpr std::string_view detail_mark = "_lod";

// The digit of "shelf_lod1", or -1.
int levelOfDetail(const std::string& name) {
    const bool ends = name.size() > detail_mark.size() + 1 && name.back() >= '0' && name.back() <= '9' &&
                      std::string_view(name).substr(0, name.size() - 1).ends_with(detail_mark);
    return ends ? name.back() - '0' : -1;
}

void warnOf(ImportContext& context, const std::vector<std::string>& owners, std::string_view what) {
    if (owners.empty()) return;
    const std::string others = owners.size() > 1 ? fmt::format(" (and {} more like it)", owners.size() - 1) : "";
    context.warn(owners[0] + others,
                 fmt::format("{} Leave it out of the export, or set 'dimmer_lighting' to 'dynamic', "
                             "which bakes nothing of it; 'lightmap' says that it is meant.",
                             what));
}

}  // namespace

void Leftovers::consider(const std::string& stated, const std::string& owner) {
    std::string name = inSmallLetters(stated);
    if (isCollisionShape(name)) return collision_shapes_.push_back(owner);
    const int level = levelOfDetail(name);
    if (level >= 0) name.resize(name.size() - detail_mark.size() - 1);
    if (level > 0)
        coarser_.push_back({std::move(name), owner});
    else
        finest_.push_back(std::move(name));
}

void Leftovers::warn(ImportContext& context) const {
    warnOf(context, collision_shapes_,
           "is named as a collision shape, and was baked as a surface that hides what it encloses.");
    std::vector<std::string> finest = finest_, doubled;
    std::ranges::sort(finest);
    for (const Detail& detail : coarser_)
        if (std::ranges::binary_search(finest, detail.stem)) doubled.push_back(detail.owner);
    warnOf(context, doubled,
           "is named as a coarser level of detail of what is there as well, and was baked in the same place.");
}

}  // namespace dimmer::cook
