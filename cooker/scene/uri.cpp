#include <scene/uri.h>
#include <tiny_gltf.h>

#include <charconv>

namespace dimmer::cook {

std::string percentDecoded(const std::string& uri) {
    std::string path;
    for (size_t i = 0; i < uri.size(); ++i) {
        unsigned char byte = 0;
        const char* const digits = uri.data() + i + 1;
        if (uri[i] == '%' && i + 2 < uri.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
            path += static_cast<char>(byte);
            i += 2;
        } else {
            path += uri[i];
        }
    }
    return path;
}

std::string percentEncoded(const std::string& path) {
    constexpr std::string_view plain =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/!$&'()*+,;=:@";
    constexpr std::string_view digits = "0123456789ABCDEF";
    std::string uri;
    for (const char c : path) {
        const auto byte = static_cast<unsigned char>(c);
        if (plain.contains(c))
            uri += c;
        else
            uri += {'%', digits[byte >> 4], digits[byte & 15]};
    }
    return uri;
}

bool decodeDataUri(const std::string& uri, std::vector<unsigned char>& bytes) {
    constexpr std::string_view marker = ";base64,";
    const size_t at = uri.find(marker);
    if (!uri.starts_with("data:") || at == std::string::npos) return false;
    std::string media_type;
    const std::string known = "data:application/octet-stream;base64," + uri.substr(at + marker.size());
    return tinygltf::DecodeDataURI(&bytes, media_type, known, 0, false);
}

std::string pathIn(const std::string& folder, const std::string& name) {
    return folder + (folder.ends_with('/') ? "" : "/") + name;
}

}  // namespace dimmer::cook
