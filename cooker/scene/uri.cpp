#include <scene/uri.h>

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

}  // namespace dimmer::cook
