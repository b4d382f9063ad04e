#include <dimmer/pack.h>

#include <pack/pack_data.h>
#include <pack/pack_reader.h>
#include <probes/model_slots.h>

#include <fmt/format.h>

#include <cerrno>
#include <exception>
#include <fstream>
#include <new>
#include <system_error>

namespace dimmer {

Expected<Pack> Pack::fromData(PackData data) {
    if (auto ok = validate(data); !ok) return std::unexpected(ok.error());
    return Pack(std::make_shared<const PackData>(std::move(data)));
}

Expected<Pack> Pack::fromBytes(std::span<const std::byte> bytes, std::string_view name) {
    auto in_file = [&](const Error& error) { return Error{error.code, fmt::format("{}: {}", name, error.message)}; };
    try {
        auto data = readPack(bytes);
        if (!data) return std::unexpected(in_file(data.error()));
        auto pack = fromData(std::move(*data));
        if (!pack) return std::unexpected(in_file(pack.error()));
        return pack;
    } catch (const std::bad_alloc&) {
        return std::unexpected(in_file({ErrorCode::OutOfMemory, "there is no memory for what the pack holds"}));
    }
}

Expected<Pack> Pack::open(const std::filesystem::path& path) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    std::ifstream file;
    errno = 0;
    if (!error) file.open(path, std::ios::binary);  // a pipe, which has no size, would block
    if (!file.is_open()) {
        if (!error) error.assign(errno, std::generic_category());
        return fail(ErrorCode::Io, fmt::format("{}: the pack cannot be opened: {}", path.string(), error.message()));
    }
    std::vector<std::byte> bytes;
    try {
        bytes.resize(size);
    } catch (const std::exception&) {  // a sparse file may claim any size
        return fail(ErrorCode::OutOfMemory,
                    fmt::format("{}: there is no memory for its {} bytes", path.string(), size));
    }
    if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
        return fail(ErrorCode::Io, fmt::format("{}: reading stopped before its end", path.string()));
    return fromBytes(bytes, path.string());
}

std::span<const Element> Pack::elements() const {
    return data_->elements;
}
std::span<const Contribution> Pack::contributions() const {
    return data_->contributions;
}
std::span<const Mesh> Pack::meshes() const {
    return data_->meshes;
}
std::span<const Viewpoint> Pack::viewpoints() const {
    return data_->viewpoints;
}
std::span<const PlacedModel> Pack::models() const {
    return data_->models;
}
std::span<const ModelMesh> Pack::modelMeshes() const {
    return data_->model_meshes;
}
ModelSlot Pack::localGridSlot(uint32_t local_grid) const {
    return local_grid < data_->probes.local.size() ? slotOf(data_->probes.local[local_grid]) : ModelSlot{};
}
uint32_t Pack::pageCount() const {
    return data_->page_count;
}
uint32_t Pack::pageWidth() const {
    return data_->page_width;
}
uint32_t Pack::pageHeight() const {
    return data_->page_height;
}
ColorFormat Pack::colorFormat() const {
    return data_->color_format;
}

DirectionModel Pack::directionModel() const {
    return data_->direction_model;
}

float Pack::exposure() const {
    return data_->exposure;
}

}  // namespace dimmer
