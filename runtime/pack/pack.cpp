#include <dimmer/pack.h>

#include <pack/pack_data.h>
#include <pack/pack_reader.h>
#include <pack/pack_source.h>
#include <probes/model_slots.h>

#include <fmt/format.h>

#include <new>
#include <stdexcept>

namespace dimmer {

Expected<Pack> Pack::fromData(PackData data) {
    if (auto ok = validate(data); !ok) return std::unexpected(ok.error());
    return Pack(std::make_shared<const PackData>(std::move(data)));
}

namespace {

Error inFile(std::string_view name, const Error& error) {
    return {error.code, fmt::format("{}: {}", name, error.message)};
}

}  // namespace

Expected<Pack> Pack::fromSource(PackSource& source, std::string_view name) {
    try {
        auto data = readPack(source);
        if (!data) return std::unexpected(inFile(name, data.error()));
        auto pack = fromData(std::move(*data));
        if (!pack) return std::unexpected(inFile(name, pack.error()));
        return pack;
    } catch (const std::bad_alloc&) {
        return std::unexpected(inFile(name, {ErrorCode::OutOfMemory, "there is no memory for what the pack holds"}));
    } catch (const std::length_error&) {  // a sparse file may claim any size
        return std::unexpected(inFile(name, {ErrorCode::OutOfMemory, "there is no memory for what the pack holds"}));
    }
}

Expected<Pack> Pack::fromBytes(std::span<const std::byte> bytes, std::string_view name) {
    MemorySource source(bytes);
    return fromSource(source, name);
}

Expected<Pack> Pack::open(const std::filesystem::path& path) {
    auto source = FileSource::open(path);
    if (!source) return std::unexpected(inFile(path.string(), source.error()));
    return fromSource(*source, path.string());
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
