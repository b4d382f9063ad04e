#include <app/depfile.h>

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace dimmer::cook {
namespace {

// Make or Ninja takes these for the end of a name, for a wildcard or for an assignment, and no escape is read by both.
constexpr std::string_view special = "=;\"'*?[&|<>^`";

bool isControl(char c) {
    return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
}

// What of a name one of the two would read as something else, however it is written; empty where there is nothing.
std::string unwritable(const std::string& name, bool target) {
    for (size_t i = 0; i < name.size(); ++i) {
        const char c = name[i], next = i + 1 < name.size() ? name[i + 1] : '\0';
        if (c == '\n') return "a line break";
        if (isControl(c)) return "a control character";
        if (special.contains(c)) return fmt::format("a {}", c);
        if (target && c == '%') return "a %";  // a pattern for Make, which alone reads \%
        // Backslashes that end a name, or are before what is escaped, are doubled for Make alone.
        if (c == '\\' && std::string_view("\0:#$", 4).contains(next)) return "a \\ at its end or before : # $";
    }
    if (name.ends_with(')') && name.contains('(')) return "a ( and a ) at its end";  // a part of an archive
    return "";
}

Expected<void> checkWritten(const std::string& name, bool target) {
    const std::string what = unwritable(name, target);
    if (what.empty()) return {};
    std::string shown = name;
    std::ranges::replace_if(shown, isControl, '?');
    return fail(ErrorCode::InvalidArgument,
                fmt::format("--depfile: {}: the name has {}, which Make's syntax cannot write so that Make and Ninja "
                            "read it; rename that file or folder",
                            shown, what));
}

// 2N + 1 backslashes before a space are N of them and the space, others stand as they are.
std::string escaped(const std::string& name) {
    std::string text;
    size_t backslashes = 0;
    for (const char c : name) {
        if (c == ' ') text.append(backslashes + 1, '\\');
        if (c == ':' || c == '#') text += '\\';
        if (c == '$') text += '$';
        text += c;
        backslashes = c == '\\' ? backslashes + 1 : 0;
    }
    return text;
}

}  // namespace

std::vector<std::filesystem::path> filesThere(const std::vector<NamedFile>& inputs) {
    std::vector<std::filesystem::path> files;
    std::error_code ignored;
    for (const NamedFile& input : inputs)
        if (std::filesystem::is_regular_file(input.path, ignored) &&
            std::ranges::find(files, input.path) == files.end())
            files.push_back(input.path);
    return files;
}

Expected<std::string> depfileText(const std::filesystem::path& pack, const std::vector<std::filesystem::path>& inputs) {
    if (auto ok = checkWritten(pack.string(), true); !ok) return std::unexpected(ok.error());
    std::string text = escaped(pack.string()) + ":";
    for (const auto& input : inputs) {
        if (auto ok = checkWritten(input.string(), false); !ok) return std::unexpected(ok.error());
        text += " " + escaped(input.string());
    }
    return text + "\n";
}

}  // namespace dimmer::cook
