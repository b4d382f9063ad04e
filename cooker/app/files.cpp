#include <app/files.h>

#include <write/pack_writer.h>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace dimmer::cook {
namespace {

namespace fs = std::filesystem;

bool isFile(const NamedFile& file) {
    return !file.path.empty() && file.path != "-";
}

Expected<void> checkName(const NamedFile& output) {
    if (output.prints || output.path != "-") return {};
    return fail(ErrorCode::InvalidArgument, fmt::format("{}: '-' is not a {}; write to ./- if you mean that",
                                                        output.role, output.folder ? "folder" : "file"));
}

bool isStream(const fs::file_status& status) {
    return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

bool same(const fs::path& a, const fs::path& b) {
    std::error_code ignored;
    const auto status_a = fs::status(a, ignored), status_b = fs::status(b, ignored);
    if (isStream(status_a) || isStream(status_b)) return false;
    if (fs::exists(status_a) && fs::exists(status_b)) return fs::equivalent(a, b, ignored);
    // What is not there yet has no identity but its name.
    const auto name = [&](const fs::path& path) {
        const fs::path target = behindLinks(path.has_filename() ? path : path.parent_path()).value_or(path);
        const fs::path absolute = fs::absolute(target, ignored);
        const fs::path canonical = fs::weakly_canonical(absolute, ignored);
        return (ignored ? absolute : canonical).lexically_normal();
    };
    return name(a) == name(b);
}

Expected<void> checkApart(const NamedFile& output, const NamedFile& other) {
    if (!isFile(output) || !isFile(other) || !same(output.path, other.path)) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} and {} are the same {}, {}; nothing was done", output.role, other.role,
                            output.folder && other.folder ? "folder" : "file", output.path.string()));
}

// What is there of the path must be a folder that takes more.
Expected<void> checkFolder(const NamedFile& output) {
    const auto refused = [&](const fs::path& folder, int error) {
        return fail(ErrorCode::Io, fmt::format("{} {}: no file can be made in {}: {}", output.role,
                                               output.path.string(), folder.string(), strerror(error)));
    };
    std::error_code error;
    fs::path there = fs::absolute(output.path, error);
    while (fs::symlink_status(there, error).type() == fs::file_type::not_found && there.has_relative_path())
        there = there.parent_path();
    if (!fs::is_directory(there, error)) return refused(there, error ? error.value() : ENOTDIR);
    if (faccessat(AT_FDCWD, there.c_str(), W_OK | X_OK, AT_EACCESS) != 0) return refused(there, errno);
    return {};
}

}  // namespace

void addFilesOf(const std::string& role, const std::vector<fs::path>& paths, std::vector<NamedFile>& files) {
    for (const fs::path& path : paths) files.push_back({"a file of " + role, path});
}

std::vector<fs::path> filesIn(const fs::path& folder, bool (*isOne)(std::string_view name)) {
    std::vector<fs::path> files;
    std::error_code error, ignored;
    for (fs::directory_iterator entry(folder, error); !error && entry != fs::end(entry); entry.increment(error))
        if (isOne(entry->path().filename().native()) && entry->is_regular_file(ignored)) files.push_back(entry->path());
    return files;
}

Expected<void> checkFiles(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs) {
    for (size_t i = 0; i < outputs.size(); ++i) {
        if (auto ok = checkName(outputs[i]); !ok) return ok;
        if (!isFile(outputs[i])) continue;
        for (const NamedFile& input : inputs)
            if (auto ok = checkApart(outputs[i], input); !ok) return ok;
        for (size_t j = 0; j < i; ++j)
            if (auto ok = checkApart(outputs[i], outputs[j]); !ok) return ok;
        if (auto ok = outputs[i].folder ? checkFolder(outputs[i]) : checkWritable(outputs[i].path); !ok) return ok;
    }
    return {};
}

Expected<void> removeEarlierJson(const std::string& file, const std::vector<std::string>& keys) {
    std::error_code error;
    if (file == "-" || !std::filesystem::is_regular_file(file, error)) return {};
    std::ifstream in(file);
    const auto shallow = [](int depth, nlohmann::json::parse_event_t, const nlohmann::json&) { return depth < 2; };
    const auto json = nlohmann::json::parse(in, shallow, false);
    if (!json.is_object() || !std::ranges::all_of(keys, [&](const auto& key) { return json.contains(key); })) return {};
    const auto target = behindLinks(file);
    if (!target) return std::unexpected(target.error());
    if (std::filesystem::remove(*target, error) || !error) return {};
    return fail(ErrorCode::Io,
                fmt::format("--json {}: what an earlier run wrote there cannot be removed: {}", file, error.message()));
}

}  // namespace dimmer::cook
