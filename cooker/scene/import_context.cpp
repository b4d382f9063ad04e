#include <fmt/format.h>
#include <scene/import_context.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

template <class T>
std::string label(const char* kind, const std::vector<T>& all, int index) {
    const std::string& name = all[static_cast<size_t>(index)].name;
    return name.empty() ? fmt::format("{} {}", kind, index) : fmt::format("{} '{}'", kind, name);
}

}  // namespace

std::unexpected<Error> ImportContext::error(std::string_view owner, std::string_view text) const {
    return fail(ErrorCode::BadInput, fmt::format("{}: {}: {}", scene.file, owner, text));
}

void ImportContext::warn(std::string_view owner, std::string_view text) {
    constexpr size_t named_max = 4;
    const auto [of_text, is_new] = warned.try_emplace(std::string(text), Warned{scene.warnings.size()});
    if (is_new) scene.warnings.emplace_back();
    Warned& said = of_text->second;
    if (said.owners++ < named_max) said.names += fmt::format("{}{}", said.names.empty() ? "" : ", ", owner);
    const size_t unnamed = said.owners - std::min(said.owners, named_max);
    scene.warnings[said.line] = fmt::format("{}: {}{}: {}", scene.file, said.names,
                                            unnamed > 0 ? fmt::format(" and {} more", unnamed) : std::string(), text);
}

std::string ImportContext::nodeLabel(int index) const {
    return label("node", model.nodes, index);
}
std::string ImportContext::meshLabel(int index) const {
    return label("mesh", model.meshes, index);
}
std::string ImportContext::materialLabel(int index) const {
    return label("material", model.materials, index);
}
std::string ImportContext::lightLabel(int index) const {
    return label("light", model.lights, index);
}
std::string ImportContext::cameraLabel(int index) const {
    return label("camera", model.cameras, index);
}
std::string ImportContext::imageLabel(int index) const {
    return label("image", model.images, index);
}

bool ImportContext::uses(std::string_view extension) const {
    return std::ranges::count(model.extensionsUsed, extension) > 0 ||
           std::ranges::count(model.extensionsRequired, extension) > 0;
}

}  // namespace dimmer::cook
