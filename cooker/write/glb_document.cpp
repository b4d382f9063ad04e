#include <write/glb_document.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace dimmer::cook {
namespace {

// glTF 2.0 specification: constants of "accessor" and "GLB File Format".
constexpr int component_float = 5126, component_uint32 = 5125;
constexpr int target_vertices = 34962, target_indices = 34963;
constexpr uint64_t header_bytes = 12, chunk_header_bytes = 8;
constexpr uint32_t glb_magic = 0x46546C67, glb_version = 2, chunk_json = 0x4E4F534A, chunk_binary = 0x004E4942;

template <class T>
void append(std::vector<std::byte>& out, const T& value) {
    const size_t end = out.size();
    out.resize(end + sizeof(value));
    std::memcpy(out.data() + end, &value, sizeof(value));
}

uint64_t paddedSize(uint64_t bytes) {
    return (bytes + 3) / 4 * 4;
}

void appendChunk(std::vector<std::byte>& out, uint32_t type, std::span<const std::byte> bytes, char padding) {
    const size_t padded = paddedSize(bytes.size());
    append(out, static_cast<uint32_t>(padded));
    append(out, type);
    out.insert(out.end(), bytes.begin(), bytes.end());
    out.insert(out.end(), padded - bytes.size(), static_cast<std::byte>(padding));
}

}  // namespace

size_t GlbDocument::addView(std::span<const std::byte> bytes, int target) {
    buffer_.resize((buffer_.size() + 3) / 4 * 4);
    Json view = {{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}};
    if (target != 0) view["target"] = target;
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    json["bufferViews"].push_back(std::move(view));
    return json["bufferViews"].size() - 1;
}

size_t GlbDocument::addVectors(std::span<const float> values, size_t components, bool with_bounds) {
    Json accessor = {{"bufferView", addView(std::as_bytes(values), target_vertices)},
                     {"componentType", component_float},
                     {"count", values.size() / components},
                     {"type", components == 2 ? "VEC2" : "VEC3"}};
    if (with_bounds) {
        std::vector<float> least(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(components)),
            most = least;
        for (size_t i = 0; i < values.size(); ++i) {
            least[i % components] = std::min(least[i % components], values[i]);
            most[i % components] = std::max(most[i % components], values[i]);
        }
        accessor["min"] = least;
        accessor["max"] = most;
    }
    json["accessors"].push_back(std::move(accessor));
    return json["accessors"].size() - 1;
}

size_t GlbDocument::addIndices(std::span<const uint32_t> values) {
    json["accessors"].push_back({{"bufferView", addView(std::as_bytes(values), target_indices)},
                                 {"componentType", component_uint32},
                                 {"count", values.size()},
                                 {"type", "SCALAR"}});
    return json["accessors"].size() - 1;
}

Expected<std::vector<std::byte>> GlbDocument::bytes(uint64_t bytes_max) {
    json["buffers"] = Json::array();
    if (!buffer_.empty()) json["buffers"].push_back({{"byteLength", buffer_.size()}});
    std::vector<std::string> empty;
    for (const auto& [key, value] : json.items())
        if (value.is_array() && value.empty()) empty.push_back(key);
    for (const std::string& key : empty) json.erase(key);
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    const uint64_t whole = header_bytes + chunk_header_bytes + paddedSize(text.size()) +
                           (buffer_.empty() ? 0 : chunk_header_bytes + paddedSize(buffer_.size()));
    if (whole > bytes_max)
        return fail(ErrorCode::BadInput, fmt::format("it would have {} bytes, more than the {} of a GLB file; part the "
                                                     "level, or make its images smaller",
                                                     whole, bytes_max));
    std::vector<std::byte> file;
    append(file, glb_magic);
    append(file, glb_version);
    append(file, uint32_t{0});
    appendChunk(file, chunk_json, std::as_bytes(std::span(text)), ' ');
    if (!buffer_.empty()) appendChunk(file, chunk_binary, buffer_, 0);
    const auto size = static_cast<uint32_t>(file.size());
    std::memcpy(file.data() + 8, &size, sizeof(size));
    return file;
}

}  // namespace dimmer::cook
