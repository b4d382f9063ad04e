#include <fmt/format.h>
#include <scene/accessor.h>

#include <algorithm>
#include <cstring>
#include <limits>

namespace dimmer::cook {
namespace {

// `count` elements of equal size, `stride_bytes` apart, all inside their buffer.
struct StridedElements {
    const unsigned char* data = nullptr;
    size_t count = 0;
    size_t stride_bytes = 0;

    const unsigned char* operator[](size_t i) const { return data + i * stride_bytes; }
};

Expected<StridedElements> locate(const ImportContext& context, int view_index, size_t offset, size_t count, size_t size,
                                 const std::string& owner) {
    const auto& views = context.model.bufferViews;
    if (view_index < 0 || static_cast<size_t>(view_index) >= views.size())
        return context.error(
            owner, fmt::format("refers to buffer view {}, but the file has {}. Export the level again.", view_index,
                               views.size()));
    const tinygltf::BufferView& view = views[static_cast<size_t>(view_index)];
    const size_t stride = view.byteStride == 0 ? size : view.byteStride;
    if (stride < size)
        return context.error(owner, fmt::format("its stride of {} bytes is smaller than an element of {}. Export the "
                                                "level again.",
                                                stride, size));
    const size_t last_start_max = view.byteLength - size;  // used only when it does not wrap
    const bool fits = size <= view.byteLength && offset <= last_start_max && count > 0 &&
                      count - 1 <= (last_start_max - offset) / stride;
    if (!fits)
        return context.error(owner, fmt::format("{} elements of {} bytes from byte {} do not fit its buffer view of {} "
                                                "bytes. Export the level again.",
                                                count, size, offset, view.byteLength));
    const auto& bytes = context.model.buffers[static_cast<size_t>(view.buffer)].data;
    return StridedElements{bytes.data() + view.byteOffset + offset, count, stride};
}

template <class T>
T load(const unsigned char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
}

// Normalised integers: glTF 2.0 specification, "Animations" / KHR_mesh_quantization: c / max, signed ones at least -1.
template <class T>
float loadInteger(const unsigned char* bytes, bool normalized) {
    const auto value = static_cast<float>(load<T>(bytes));
    if (!normalized) return value;
    return std::max(value / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
}

float loadComponent(const unsigned char* bytes, int type, bool normalized) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return loadInteger<int8_t>(bytes, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return loadInteger<uint8_t>(bytes, normalized);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return loadInteger<int16_t>(bytes, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return loadInteger<uint16_t>(bytes, normalized);
        default:
            return load<float>(bytes);
    }
}

uint32_t loadIndex(const unsigned char* bytes, int type) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return load<uint8_t>(bytes);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return load<uint16_t>(bytes);
        default:
            return load<uint32_t>(bytes);
    }
}

bool isIndexType(int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

size_t componentBytes(int type) {
    return static_cast<size_t>(tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(type)));
}

const char* attributeName(Attribute attribute) {
    switch (attribute) {
        case Attribute::Position:
            return "POSITION";
        case Attribute::Normal:
            return "NORMAL";
        case Attribute::TexCoord:
            break;
    }
    return "TEXCOORD";
}

// Core glTF: floats, and normalised unsigned integers for texture coordinates. KHR_mesh_quantization adds the other
// 8- and 16-bit integers; normals must then be normalised and signed.
bool isAllowed(const tinygltf::Accessor& accessor, Attribute attribute, bool quantization) {
    const int type = accessor.componentType;
    if (type == TINYGLTF_COMPONENT_TYPE_FLOAT) return true;
    const bool is_signed = type == TINYGLTF_COMPONENT_TYPE_BYTE || type == TINYGLTF_COMPONENT_TYPE_SHORT;
    const bool is_unsigned =
        type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
    if (!is_signed && !is_unsigned) return false;
    if (attribute == Attribute::TexCoord && is_unsigned && accessor.normalized) return true;
    if (attribute == Attribute::Normal) return quantization && is_signed && accessor.normalized;
    return quantization;
}

Expected<void> checkType(const ImportContext& context, const tinygltf::Accessor& accessor, Attribute attribute,
                         const std::string& owner) {
    const int wanted = attribute == Attribute::TexCoord ? TINYGLTF_TYPE_VEC2 : TINYGLTF_TYPE_VEC3;
    if (accessor.type != wanted)
        return context.error(owner, fmt::format("{} is not a {}. Export the level again.", attributeName(attribute),
                                                wanted == TINYGLTF_TYPE_VEC2 ? "VEC2" : "VEC3"));
    if (!isAllowed(accessor, attribute, context.uses("KHR_mesh_quantization")))
        return context.error(owner, fmt::format("{} has component type {}, which glTF allows not at all or only with "
                                                "KHR_mesh_quantization. Export it as floats.",
                                                attributeName(attribute), accessor.componentType));
    return {};
}

// Where there is no buffer view, a sparse accessor starts from zeros; the values it then sets are in the file, so the
// file's size bounds what a sane count can be.
Expected<void> checkZeros(const ImportContext& context, const tinygltf::Accessor& accessor, const std::string& owner) {
    if (!accessor.sparse.isSparse)
        return context.error(owner, "its data are missing: the accessor has no buffer view. Export the level again.");
    size_t bytes = 0;
    for (const tinygltf::Buffer& buffer : context.model.buffers) bytes += buffer.data.size();
    if (accessor.count > bytes)
        return context.error(owner, fmt::format("a sparse accessor claims {} elements in a file with {} bytes of data. "
                                                "Export the level without sparse accessors.",
                                                accessor.count, bytes));
    return {};
}

struct Layout {
    size_t components = 0, component_bytes = 0;
    size_t bytes() const { return components * component_bytes; }
};

void copyElement(const unsigned char* from, const tinygltf::Accessor& accessor, Layout layout, float* to) {
    for (size_t c = 0; c < layout.components; ++c)
        to[c] = loadComponent(from + c * layout.component_bytes, accessor.componentType, accessor.normalized);
}

Expected<void> applySparse(const ImportContext& context, const tinygltf::Accessor& accessor, Layout layout,
                           const UsedVertices& used, const std::string& owner, std::vector<float>& values) {
    const auto& sparse = accessor.sparse;
    if (sparse.count < 1 || static_cast<size_t>(sparse.count) > accessor.count || sparse.indices.byteOffset < 0 ||
        sparse.values.byteOffset < 0 || !isIndexType(sparse.indices.componentType))
        return context.error(owner, "its sparse accessor is malformed. Export the level without sparse accessors.");
    const auto count = static_cast<size_t>(sparse.count);
    const auto targets = locate(context, sparse.indices.bufferView, static_cast<size_t>(sparse.indices.byteOffset),
                                count, componentBytes(sparse.indices.componentType), owner);
    if (!targets) return std::unexpected(targets.error());
    const auto elements = locate(context, sparse.values.bufferView, static_cast<size_t>(sparse.values.byteOffset),
                                 count, layout.bytes(), owner);
    if (!elements) return std::unexpected(elements.error());
    for (size_t i = 0; i < count; ++i) {
        const size_t target = loadIndex((*targets)[i], sparse.indices.componentType);
        if (target >= accessor.count)
            return context.error(owner,
                                 fmt::format("its sparse accessor sets element {} of {}. Export the level without "
                                             "sparse accessors.",
                                             target, accessor.count));
        if (const size_t at = used.number_of[target]; at != UsedVertices::unused)
            copyElement((*elements)[i], accessor, layout, &values[at * layout.components]);
    }
    return {};
}

// Where its elements lie; no data: a sparse accessor's zeros.
Expected<StridedElements> denseElements(const ImportContext& context, const tinygltf::Accessor& accessor, Layout layout,
                                        const std::string& owner) {
    if (accessor.bufferView >= 0)
        return locate(context, accessor.bufferView, accessor.byteOffset, accessor.count, layout.bytes(), owner);
    if (const auto ok = checkZeros(context, accessor, owner); !ok) return std::unexpected(ok.error());
    return StridedElements{nullptr, accessor.count, 0};
}

Layout layoutOf(const tinygltf::Accessor& accessor, Attribute attribute) {
    return {attribute == Attribute::TexCoord ? 2u : 3u, componentBytes(accessor.componentType)};
}

std::string labelOf(const std::string& owner, Attribute attribute) {
    return fmt::format("{}, {}", owner, attributeName(attribute));
}

}  // namespace

Expected<size_t> countElements(const ImportContext& context, int index, Attribute attribute, const std::string& owner) {
    const tinygltf::Accessor& accessor = context.model.accessors[static_cast<size_t>(index)];
    if (const auto ok = checkType(context, accessor, attribute, owner); !ok) return std::unexpected(ok.error());
    const auto elements = denseElements(context, accessor, layoutOf(accessor, attribute), labelOf(owner, attribute));
    if (!elements) return std::unexpected(elements.error());
    return elements->count;
}

Expected<std::vector<float>> readAttribute(const ImportContext& context, int index, Attribute attribute,
                                           const UsedVertices& used, const std::string& owner) {
    const auto count = countElements(context, index, attribute, owner);
    if (!count) return std::unexpected(count.error());
    if (*count != used.number_of.size())
        return context.error(owner, fmt::format("{} has {} elements, POSITION {}. Export the level again.",
                                                attributeName(attribute), *count, used.number_of.size()));
    const tinygltf::Accessor& accessor = context.model.accessors[static_cast<size_t>(index)];
    const Layout layout = layoutOf(accessor, attribute);
    const std::string where = labelOf(owner, attribute);
    const auto elements = denseElements(context, accessor, layout, where);
    if (!elements) return std::unexpected(elements.error());
    std::vector<float> values(used.numbers.size() * layout.components, 0.0f);
    for (size_t i = 0; i < used.numbers.size() && elements->data; ++i)
        copyElement((*elements)[used.numbers[i]], accessor, layout, &values[i * layout.components]);
    if (accessor.sparse.isSparse)
        if (const auto ok = applySparse(context, accessor, layout, used, where, values); !ok)
            return std::unexpected(ok.error());

    const auto bad = std::ranges::find_if(values, [](float value) { return !std::isfinite(value); });
    if (bad != values.end())
        return context.error(where,
                             fmt::format("vertex {} is NaN or infinite. Repair the mesh in the editor that made it.",
                                         used.numbers[static_cast<size_t>(bad - values.begin()) / layout.components]));
    return values;
}

Expected<std::vector<uint32_t>> readIndices(const ImportContext& context, int index, const std::string& owner) {
    const tinygltf::Accessor& accessor = context.model.accessors[static_cast<size_t>(index)];
    const std::string where = owner + ", indices";
    if (accessor.type != TINYGLTF_TYPE_SCALAR || !isIndexType(accessor.componentType) || accessor.sparse.isSparse)
        return context.error(where, "are not unsigned 8, 16 or 32-bit integers in a buffer. Export the level again.");
    if (accessor.bufferView < 0) return context.error(where, "have no buffer view. Export the level again.");
    const auto elements = locate(context, accessor.bufferView, accessor.byteOffset, accessor.count,
                                 componentBytes(accessor.componentType), where);
    if (!elements) return std::unexpected(elements.error());
    std::vector<uint32_t> indices(elements->count);
    for (size_t i = 0; i < indices.size(); ++i) indices[i] = loadIndex((*elements)[i], accessor.componentType);
    return indices;
}

}  // namespace dimmer::cook
