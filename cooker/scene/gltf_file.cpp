#include <fmt/format.h>
#include <format/layout.h>
#include <scene/gltf_file.h>
#include <scene/json_types.h>
#include <scene/uri.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

namespace dimmer::cook {
namespace {

using Bytes = std::vector<unsigned char>;

// The parser recurses into nested extras; this keeps a hostile file from exhausting the stack. Real files nest ~10.
constexpr size_t nesting_max = 100;
// The parser counts bytes in 32 bits, images in 31.
constexpr uintmax_t file_bytes_max = std::numeric_limits<int32_t>::max();

uint32_t littleEndian32(std::span<const unsigned char> bytes, size_t offset) {
    return uint32_t{bytes[offset]} | uint32_t{bytes[offset + 1]} << 8 | uint32_t{bytes[offset + 2]} << 16 |
           uint32_t{bytes[offset + 3]} << 24;
}

bool isGlb(std::span<const unsigned char> bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

// glTF 2.0 specification, "GLB File Format": a 12-byte header, then chunks of 8 + length bytes.
constexpr size_t header_bytes = 12, chunk_header_bytes = 8;
constexpr uint32_t json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;

struct GlbParts {
    std::string_view json;
    std::span<const unsigned char> binary;  // its chunk, header included; empty: there is none, or nothing in it
    bool only = true;                       // nothing else is in the file
};

// tinygltf's own check lets a last chunk reach 8 bytes past the end.
Expected<GlbParts> glbParts(std::span<const unsigned char> bytes, const std::string& file) {
    const auto truncated = [&](std::string_view what) {
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: the GLB file is truncated: {}. Export or copy it again.", file, what));
    };
    if (bytes.size() < header_bytes + chunk_header_bytes) return truncated("it ends inside its header");
    if (const uint32_t version = littleEndian32(bytes, 4); version != 2)
        return fail(ErrorCode::BadInput, fmt::format("{}: is GLB version {}. Export it as glTF 2.0.", file, version));
    const size_t length = littleEndian32(bytes, 8);
    if (length < header_bytes + chunk_header_bytes || length > bytes.size())
        return truncated(fmt::format("its header says {} bytes, the file has {}", length, bytes.size()));
    GlbParts parts;
    for (size_t offset = header_bytes; offset < length;) {
        if (length - offset < chunk_header_bytes) return truncated("it ends inside a chunk's header");
        const size_t chunk_bytes = littleEndian32(bytes, offset);
        if (chunk_bytes > length - offset - chunk_header_bytes)
            return truncated(fmt::format("the chunk at byte {} reaches past its end", offset));
        const auto chunk = bytes.subspan(offset, chunk_header_bytes + chunk_bytes);
        if (offset > header_bytes) {
            const bool binary = parts.binary.empty() && chunk_bytes > 0 && littleEndian32(chunk, 4) == binary_chunk;
            if (binary) parts.binary = chunk;
            parts.only = parts.only && binary;
        }
        offset += chunk.size();
    }
    if (littleEndian32(bytes, header_bytes + 4) != json_chunk)
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: the GLB file does not start with JSON. Export it again.", file));
    parts.json = std::string_view(reinterpret_cast<const char*>(bytes.data()) + header_bytes + chunk_header_bytes,
                                  littleEndian32(bytes, header_bytes));
    return parts;
}

// Without an empty binary chunk and those of types that are not known, which the parser refuses and glTF wants ignored.
Bytes withoutOtherChunks(const Bytes& glb, const GlbParts& parts) {
    const size_t json_end = header_bytes + chunk_header_bytes + parts.json.size();
    Bytes out(glb.begin(), glb.begin() + static_cast<std::ptrdiff_t>(json_end));
    out.insert(out.end(), parts.binary.begin(), parts.binary.end());
    for (size_t i = 0; i < 4; ++i) out[8 + i] = static_cast<unsigned char>(out.size() >> 8 * i);
    return out;
}

// Deepest nesting; on_string(begin, end, depth) for every string's content, so many brackets deep.
size_t scanJson(std::span<const unsigned char> json, auto&& on_string) {
    size_t depth = 0, deepest = 0, string_begin = 0;
    bool in_string = false;
    for (size_t i = 0; i < json.size(); ++i) {
        const unsigned char c = json[i];
        if (in_string) {
            if (c == '\\') ++i;
            if (c != '"') continue;
            in_string = false;
            on_string(string_begin, i, depth);
        } else if (c == '"') {
            in_string = true;
            string_begin = i + 1;
        } else if (c == '{' || c == '[') {
            deepest = std::max(deepest, ++depth);
        } else if ((c == '}' || c == ']') && depth > 0) {
            --depth;
        }
    }
    return deepest;
}

// What a bake does not ask for, and the parser refuses in forms that glTF allows: skins without inverse bind matrices,
// animations of what is no node. It passes over members that it does not know, so these get names of the same length.
void hideFromParser(std::span<unsigned char> json) {
    constexpr std::array<std::string_view, 2> hidden = {"animations", "skins"};
    scanJson(json, [&](size_t begin, size_t end, size_t depth) {
        const auto text = json.subspan(begin, end - begin);
        const auto after =
            std::ranges::find_if_not(json.subspan(end + 1), [](unsigned char c) { return std::isspace(c); });
        if (depth != 1 || after == json.end() || *after != ':') return;
        if (std::ranges::any_of(hidden, [&](std::string_view name) { return std::ranges::equal(text, name); }))
            text.back() = '_';
    });
}

// Files that the level names.
struct ExternalFiles {
    std::string folder;
    std::map<std::string, std::string>
        meant;                             // by the path that the parser makes of a URI, the one that it means, or none
    std::map<std::string, size_t> length;  // per such path, what all buffers there have
    std::string unread;                    // why the first buffer's file that could not be read could not
};

// The parser takes a '+' for a blank, and a buffer's file that is longer than the buffer for an error; it may be longer
// (glTF 2.0 specification, "Buffers and Buffer Views").
ExternalFiles externalFiles(std::string_view gltf_json, std::string folder) {
    ExternalFiles files{std::move(folder), {}, {}, {}};
    const auto json = nlohmann::json::parse(gltf_json, nullptr, false);
    for (const char* list : {"buffers", "images"}) {
        const auto all = json.is_object() ? json.find(list) : json.end();
        if (all == json.end() || !all->is_array()) continue;
        for (const nlohmann::json& file : *all) {
            if (!file.is_object() || !file.contains("uri") || !file["uri"].is_string()) continue;
            const std::string uri = file["uri"].get<std::string>();
            if (uri.starts_with("data:")) continue;
            std::string parsed = uri;
            std::ranges::replace(parsed, '+', ' ');
            const std::string path = pathIn(files.folder, percentDecoded(uri));
            const auto [meant, first] = files.meant.try_emplace(pathIn(files.folder, percentDecoded(parsed)), path);
            if (!first && meant->second != path) meant->second.clear();  // which one is asked for cannot be told
            if (list != std::string_view("buffers") || !file.contains("byteLength")) continue;
            if (!file["byteLength"].is_number_unsigned()) continue;
            const auto bytes = file["byteLength"].get<size_t>();
            if (const auto [known, fresh] = files.length.try_emplace(path, bytes); !fresh && known->second != bytes)
                known->second = std::numeric_limits<size_t>::max();
        }
    }
    return files;
}

// tinygltf looks for external files next to the level and then in the working directory. Only the first is meant:
// a level must not depend on where the cooker was started.
bool isBesideLevel(const std::string& path, void* files) {
    return path.starts_with(pathIn(static_cast<const ExternalFiles*>(files)->folder, ""));
}

std::string meantPath(const std::string& path, void* files) {
    const auto& meant = static_cast<const ExternalFiles*>(files)->meant;
    const auto found = meant.find(path);
    return found == meant.end() ? path : found->second;
}

bool readExternal(Bytes* out, std::string* message, const std::string& path, void* files) {
    Expected<Bytes> bytes = readFile(path);
    if (bytes) {
        *out = std::move(*bytes);
        const auto& length = static_cast<const ExternalFiles*>(files)->length;
        if (const auto known = length.find(path); known != length.end() && known->second < out->size())
            out->resize(known->second);
    } else if (message) {
        *message = bytes.error().message;
    }
    auto& [folder, meant, length, unread] = *static_cast<ExternalFiles*>(files);
    if (!bytes && unread.empty() && length.contains(path)) unread = bytes.error().message;
    return bytes.has_value();
}

// Decoding waits until it is known which images are used, and is done with checks of our own. An image in a buffer
// view is left there: the view has not been validated yet, so its bytes must not be touched.
bool keepEncoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes,
                 int size, void*) {
    image->as_is = true;
    if (image->bufferView < 0 && size > 0) image->image.assign(bytes, bytes + size);
    return true;
}

// The parser takes a data URI of a media type that it does not know for the name of a file.
void decodeUnknownType(tinygltf::Image& image) {
    if (image.image.empty() && decodeDataUri(image.uri, image.image)) image.uri.clear();
}

// The parser's messages may hold a whole data URI and line breaks.
std::string oneLine(std::string text) {
    constexpr size_t length_max = 300;
    if (text.size() > length_max) text = text.substr(0, length_max) + "...";
    std::ranges::replace(text, '\n', ' ');
    while (text.ends_with(' ') || text.ends_with('.')) text.pop_back();
    return text;
}

Expected<tinygltf::Model> parse(const Bytes& bytes, bool glb, ExternalFiles files, const std::string& file) {
    tinygltf::TinyGLTF parser;
    parser.SetImageLoader(keepEncoded, nullptr);
    parser.SetFsCallbacks({isBesideLevel, meantPath, readExternal, nullptr, &files});
    tinygltf::Model model;
    std::string message, ignored;
    const auto size = static_cast<unsigned>(bytes.size());
    const bool parsed =
        glb ? parser.LoadBinaryFromMemory(&model, &message, &ignored, bytes.data(), size, files.folder)
            : parser.LoadASCIIFromString(&model, &message, &ignored, reinterpret_cast<const char*>(bytes.data()), size,
                                         files.folder);
    // Some errors are reported by message alone, with the offending part left out.
    if (parsed && message.empty()) {
        for (tinygltf::Image& image : model.images) decodeUnknownType(image);
        return model;
    }
    if (!files.unread.empty())
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: a buffer's file cannot be read: {} Put it where the level says, "
                                "or export the level as .glb.",
                                file, files.unread));
    return fail(ErrorCode::BadInput, fmt::format("{}: is not a usable glTF file: {}. Export it again, or have a glTF "
                                                 "validator point out the place.",
                                                 file, message.empty() ? "unknown reason" : oneLine(message)));
}

// Neither glTF's text nor .glb: said before anything is made of its bytes.
Expected<void> checkKind(const Bytes& bytes, const std::string& file) {
    const auto begin = std::ranges::find_if_not(bytes, [](unsigned char c) { return std::isspace(c); });
    const bool marked = bytes.size() >= 3 && bytes[0] == 0xef && bytes[1] == 0xbb && bytes[2] == 0xbf;  // as UTF-8
    if (isGlb(bytes) || marked || (begin != bytes.end() && *begin == '{')) return {};
    const bool is_pack = bytes.size() >= format::magic.size() &&
                         std::memcmp(bytes.data(), format::magic.data(), format::magic.size()) == 0;
    return fail(
        ErrorCode::BadInput,
        fmt::format("{}: is not a usable glTF file: {}", file,
                    is_pack ? "it is a Dimmer pack. Give the level that it was cooked from; are arguments swapped?"
                            : "it is neither JSON nor .glb. Export the level as glTF 2.0."));
}

}  // namespace

std::vector<bool> animatedNodes(std::string_view gltf_json, size_t nodes) {
    std::vector<bool> animated(nodes);
    const auto json = nlohmann::json::parse(gltf_json, nullptr, false);
    const auto listIn = [](const nlohmann::json& object, const char* name) {
        const bool there = object.is_object() && object.contains(name) && object[name].is_array();
        return there ? object[name] : nlohmann::json::array();
    };
    for (const auto& animation : listIn(json, "animations"))
        for (const auto& channel : listIn(animation, "channels")) {
            if (!channel.is_object() || !channel.contains("target") || !channel["target"].is_object()) continue;
            const auto& target = channel["target"];
            if (!target.contains("node") || !target["node"].is_number_unsigned()) continue;
            if (target.contains("path") && target["path"] == "weights") continue;
            if (const auto node = target["node"].get<size_t>(); node < nodes) animated[node] = true;
        }
    return animated;
}

Expected<Bytes> readFile(const std::filesystem::path& path) {
    std::error_code problem;
    const auto status = std::filesystem::status(path, problem);
    if (status.type() == std::filesystem::file_type::none)
        return fail(ErrorCode::Io, fmt::format("{}: {}.", path.string(), problem.message()));
    if (!std::filesystem::is_regular_file(status))
        return fail(ErrorCode::Io,
                    fmt::format("{}: {}. Check the path.", path.string(),
                                std::filesystem::exists(status) ? "is a folder, a pipe or a device, and no file"
                                                                : "there is no such file"));
    const uintmax_t size = std::filesystem::file_size(path, problem);
    if (problem) return fail(ErrorCode::Io, fmt::format("{}: {}.", path.string(), problem.message()));
    if (size > file_bytes_max)
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: is larger than 2 GiB. Split it, or make it smaller.", path.string()));
    Bytes bytes(static_cast<size_t>(size));
    std::ifstream stream(path, std::ios::binary);
    stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!stream) return fail(ErrorCode::Io, fmt::format("{}: cannot be read. Check its permissions.", path.string()));
    return bytes;
}

Expected<GltfSource> readGltfSource(const std::filesystem::path& path) {
    const std::string file = path.string();
    Expected<Bytes> bytes = readFile(path);
    if (!bytes) return std::unexpected(bytes.error());
    if (bytes->empty()) return fail(ErrorCode::BadInput, fmt::format("{}: is empty. Export the level again.", file));

    if (auto ok = checkKind(*bytes, file); !ok) return std::unexpected(ok.error());
    const bool glb = isGlb(*bytes);
    std::string json(bytes->begin(), bytes->end());
    if (glb) {
        const Expected<GlbParts> parts = glbParts(*bytes, file);
        if (!parts) return std::unexpected(parts.error());
        json = parts->json;
        if (!parts->only) *bytes = withoutOtherChunks(*bytes, *parts);
    }
    const std::span json_in_file = std::span(*bytes).subspan(glb ? header_bytes + chunk_header_bytes : 0, json.size());
    if (scanJson(json_in_file, [](size_t, size_t, size_t) {}) > nesting_max)
        return fail(ErrorCode::BadInput, fmt::format("{}: its JSON nests more than {} levels deep. Remove such custom "
                                                     "properties.",
                                                     file, nesting_max));
    const std::string folder = std::filesystem::absolute(path).parent_path().string();
    try {
        if (auto ok = checkTypes(json, file); !ok) return std::unexpected(ok.error());
        hideFromParser(json_in_file);
        Expected<tinygltf::Model> model = parse(*bytes, glb, externalFiles(json, folder), file);
        if (model && !model->asset.version.starts_with("2"))
            return fail(ErrorCode::BadInput,
                        fmt::format("{}: is glTF {}. Export it as glTF 2.0.", file, oneLine(model->asset.version)));
        if (!model) return std::unexpected(model.error());
        return GltfSource{std::move(json), std::move(*model)};
    } catch (const std::bad_alloc&) {
        throw;                                 // importLevel says what that means
    } catch (const std::exception& problem) {  // the parser's JSON library throws on some malformed values
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: is not a usable glTF file: {}. Export it again.", file, oneLine(problem.what())));
    }
}

}  // namespace dimmer::cook
