#include <pipeline/level_files.h>

#include <scene/gltf_file.h>
#include <scene/uri.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace dimmer::cook {
namespace {

// The import refuses what nests deeper. It is not built: the library follows it with one stack frame per level.
constexpr int level_nesting_max = 100;

// GLB begins with 12 bytes and the JSON chunk's length and type (glTF 2.0 specification, "GLB File Format").
std::string_view jsonOf(std::span<const unsigned char> bytes) {
    constexpr size_t length_at = 12, json_at = 20;
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (!text.starts_with("glTF")) return text;
    if (text.size() < json_at) return {};
    uint32_t length = 0;
    std::memcpy(&length, text.data() + length_at, sizeof(length));
    return text.substr(json_at, length);
}

void addFile(const std::filesystem::path& folder, std::string_view key, const std::string& text,
             std::vector<std::filesystem::path>& files) {
    if (key == "dimmer_sky_image") files.push_back(folder / text);
    if (key != "uri" || text.starts_with("data:")) return;
    const std::filesystem::path file = percentDecoded(text);
    files.push_back(folder / file);
    // A light profile's may be absolute; buffers and images are below the level's folder even then.
    if (file.is_absolute()) files.push_back(folder / file.relative_path());
}

}  // namespace

std::vector<std::filesystem::path> filesNamedBy(const std::filesystem::path& level) {
    using Event = nlohmann::json::parse_event_t;
    const auto bytes = readFile(level);
    if (!bytes) return {};
    std::vector<std::filesystem::path> files;
    std::string key;
    std::optional<int> extras_depth;  // within somebody's own properties: of these only the sky's is a file's
    const auto visit = [&](int depth, Event event, const nlohmann::json& parsed) {
        if (event == Event::key) {
            key = parsed.get<std::string>();
            if (extras_depth && depth <= *extras_depth) extras_depth.reset();
            if (!extras_depth && key == "extras") extras_depth = depth;
        }
        if (event == Event::value && parsed.is_string() && (!extras_depth || key != "uri"))
            addFile(level.parent_path(), key, parsed.get_ref<const std::string&>(), files);
        return depth < level_nesting_max;
    };
    const bool whole = !nlohmann::json::parse(jsonOf(*bytes), visit, false).is_discarded();
    return whole ? files : std::vector<std::filesystem::path>();
}

}  // namespace dimmer::cook
