#include <pipeline/json_lines.h>

#include <nlohmann/json.hpp>

#include <utility>
#include <vector>

namespace dimmer::cook {
namespace {

// The end of the string that begins at `begin` with its opening quote, behind the closing one.
size_t endOfString(std::string_view text, size_t begin) {
    size_t i = begin + 1;
    while (i < text.size() && text[i] != '"') i += text[i] == '\\' ? 2 : 1;
    return std::min(i + 1, text.size());
}

// As the parser reads it, escapes included.
std::string decoded(std::string_view quoted) {
    const auto value = nlohmann::json::parse(quoted, nullptr, false);
    return value.is_string() ? value.get<std::string>() : std::string();
}

}  // namespace

std::map<std::string, size_t> linesOfKeys(std::string_view text) {
    std::map<std::string, size_t> lines;
    std::vector<std::string> prefixes = {""};  // of the objects and arrays that are open
    std::string last;                          // the string read last: a key, if a colon follows
    bool fresh = false;                        // no colon yet since then
    size_t line = 1, last_line = 1;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '\n') ++line;
        if (c == '"') {
            const size_t end = endOfString(text, i);
            last = decoded(text.substr(i, end - i));
            last_line = line;
            fresh = true;
            i = end - 1;
        } else if (c == ':' && std::exchange(fresh, false)) {
            last = prefixes.back() + last;
            lines[last] = last_line;
        } else if (c == '{' || c == '[') {
            prefixes.push_back(prefixes.size() == 1 ? "" : last + ".");
        } else if ((c == '}' || c == ']') && prefixes.size() > 1) {
            prefixes.pop_back();
        }
    }
    return lines;
}

}  // namespace dimmer::cook
