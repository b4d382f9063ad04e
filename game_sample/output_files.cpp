#include "output_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>

namespace dimmer::sample {
namespace {

namespace fs = std::filesystem;

bool isOfARun(std::string_view name) {
    constexpr std::string_view before = "frame_", after = ".png";
    if (name == costFile({}).native()) return true;
    if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
        return false;
    name.remove_prefix(before.size());
    name.remove_suffix(after.size());
    return std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c) != 0; });
}

std::unexpected<Error> inputAt(const fs::path& output) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{}: is an input and would be written over; nothing was done.", output.string()));
}

}  // namespace

fs::path frameFile(const fs::path& folder, uint32_t frame) {
    return folder / fmt::format("frame_{:04}.png", frame);
}

fs::path costFile(const fs::path& folder) {
    return folder / "cost.json";
}

Expected<void> checkPicture(const fs::path& picture, const std::vector<fs::path>& inputs) {
    if (picture.empty()) return {};
    std::error_code ignored;
    for (const fs::path& input : inputs)
        if (fs::equivalent(picture, input, ignored)) return inputAt(picture);
    const fs::path folder = picture.has_parent_path() ? picture.parent_path() : fs::path(".");
    const bool other = fs::exists(picture, ignored) && !fs::is_regular_file(picture, ignored);  // a folder, a device
    if (other || !fs::is_directory(folder, ignored) || access(folder.c_str(), W_OK | X_OK) != 0)
        return fail(ErrorCode::Io, fmt::format("--picture {}: cannot be written.", picture.string()));
    return {};
}

Expected<void> prepareFolder(const fs::path& folder, const std::vector<fs::path>& inputs) {
    std::error_code failed, ignored;
    fs::create_directories(folder, failed);
    std::vector<fs::path> old;
    if (!failed)
        for (fs::directory_iterator entry(folder, failed); !failed && entry != fs::end(entry); entry.increment(failed))
            if (isOfARun(entry->path().filename().native()) && !entry->is_directory(ignored))
                old.push_back(entry->path());
    if (failed) return fail(ErrorCode::Io, fmt::format("{}: {}.", folder.string(), failed.message()));
    for (const fs::path& file : old)
        for (const fs::path& input : inputs)
            if (fs::equivalent(file, input, ignored)) return inputAt(file);
    for (const fs::path& file : old)
        if (!fs::remove(file, failed))
            return fail(ErrorCode::Io, fmt::format("{}: is of an earlier run and cannot be removed: {}.", file.string(),
                                                   failed.message()));
    return {};
}

Expected<void> writeFile(const fs::path& path, std::string_view bytes) {
    const fs::path part = path.string() + ".part";
    std::ofstream file(part, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    std::error_code failed;
    if (file) fs::rename(part, path, failed);
    if (file && !failed) return {};
    fs::remove(part, failed);
    return fail(ErrorCode::Io, fmt::format("{}: cannot be written.", path.string()));
}

}  // namespace dimmer::sample
