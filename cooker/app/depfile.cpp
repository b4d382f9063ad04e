#include <app/depfile.h>

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace dimmer::cook {
namespace {

// Make takes 2N + 1 backslashes before a space or # for N of them and the character itself, others as they are.
std::string escaped(const std::string& name) {
    std::string text;
    size_t backslashes = 0;
    for (const char c : name) {
        if (c == ' ' || c == '\t' || c == '#') text.append(backslashes + 1, '\\');
        if (c == ':') text += '\\';
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
    std::string text = escaped(pack.string()) + ":";
    for (const auto& input : inputs) text += " " + escaped(input.string());
    if (text.contains('\n'))
        return fail(ErrorCode::InvalidArgument,
                    "--depfile: a file's name has a line break, which Make's syntax cannot write; rename that file");
    return text + "\n";
}

}  // namespace dimmer::cook
