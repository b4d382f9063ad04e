#include <fmt/format.h>
#include <scene/accessor.h>
#include <scene/primitive.h>

#include <algorithm>
#include <numeric>

namespace dimmer::cook {
namespace {

std::vector<glm::vec3> asVec3(const std::vector<float>& values) {
    std::vector<glm::vec3> result(values.size() / 3);
    for (size_t i = 0; i < result.size(); ++i) result[i] = {values[i * 3], values[i * 3 + 1], values[i * 3 + 2]};
    return result;
}

std::vector<glm::vec2> asVec2(const std::vector<float>& values) {
    std::vector<glm::vec2> result(values.size() / 2);
    for (size_t i = 0; i < result.size(); ++i) result[i] = {values[i * 2], values[i * 2 + 1]};
    return result;
}

class PrimitiveReader {
   public:
    PrimitiveReader(const ImportContext& context, const tinygltf::Primitive& primitive, const std::string& owner,
                    std::vector<uint32_t>& number_of)
        : context_(context), primitive_(primitive), owner_(owner), number_of_(number_of) {}
    // For the next primitive, at the cost of this one.
    ~PrimitiveReader() {
        for (const uint32_t vertex : used_) number_of_[vertex] = UsedVertices::unused;
    }
    PrimitiveReader(const PrimitiveReader&) = delete;
    PrimitiveReader& operator=(const PrimitiveReader&) = delete;

    Expected<PrimitiveGeometry> read(const TextureMapping& mapping) {
        if (primitive_.mode < TINYGLTF_MODE_TRIANGLES || primitive_.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
            geometry_.warnings.push_back("holds points or lines; they were skipped.");
            return geometry_;
        }
        for (const auto step : {&PrimitiveReader::triangles, &PrimitiveReader::vertices})
            if (const auto ok = (this->*step)(); !ok) return std::unexpected(ok.error());
        if (const auto ok = textureCoordinates(mapping); !ok) return std::unexpected(ok.error());
        return std::move(geometry_);
    }

   private:
    // The attribute's numbers; empty when the primitive has none.
    Expected<std::vector<float>> attribute(const std::string& name, Attribute kind) const {
        const auto found = primitive_.attributes.find(name);
        if (found == primitive_.attributes.end()) return std::vector<float>();
        return readAttribute(context_, found->second, kind, {used_, std::span(number_of_).first(vertex_count_)},
                             owner_);
    }

    Expected<void> vertices() {
        const auto positions = attribute("POSITION", Attribute::Position);
        if (!positions) return std::unexpected(positions.error());
        geometry_.positions = asVec3(*positions);
        const auto normals = attribute("NORMAL", Attribute::Normal);
        if (!normals) return std::unexpected(normals.error());
        geometry_.normals = asVec3(*normals);
        if (primitive_.attributes.contains("COLOR_0"))
            geometry_.warnings.push_back(
                "has vertex colours (COLOR_0), which are not baked: its materials' colours are.");
        return {};
    }

    Expected<void> textureCoordinates(const TextureMapping& mapping) {
        const auto texture = attribute(fmt::format("TEXCOORD_{}", mapping.tex_coord), Attribute::TexCoord);
        if (!texture) return std::unexpected(texture.error());
        geometry_.uv0 = asVec2(*texture);
        for (glm::vec2& uv : geometry_.uv0) uv = mapping.apply(uv);
        if (std::ranges::any_of(geometry_.uv0,
                                [](glm::vec2 uv) { return !std::isfinite(uv.x) || !std::isfinite(uv.y); }))
            return context_.error(owner_,
                                  "its texture coordinates become infinite by KHR_texture_transform. Correct the "
                                  "material.");
        const auto lightmap = attribute("TEXCOORD_1", Attribute::TexCoord);
        if (!lightmap) return std::unexpected(lightmap.error());
        geometry_.uv1 = asVec2(*lightmap);
        return {};
    }

    // As the file numbers the vertices, then as they are first used.
    Expected<void> triangles() {
        const auto positions = primitive_.attributes.find("POSITION");
        if (positions == primitive_.attributes.end())
            return context_.error(owner_, "has a primitive without POSITION. Export the level again.");
        const auto count = countElements(context_, positions->second, Attribute::Position, owner_);
        if (!count) return std::unexpected(count.error());
        vertex_count_ = *count;
        std::vector<uint32_t> indices;
        if (primitive_.indices >= 0) {
            auto read = readIndices(context_, primitive_.indices, owner_);
            if (!read) return std::unexpected(read.error());
            indices = std::move(*read);
            const auto largest = std::ranges::max(indices);
            if (largest >= vertex_count_)
                return context_.error(
                    owner_, fmt::format("has vertex index {}, but {} vertices. Export the level again.", largest,
                                        vertex_count_));
        } else {
            indices.resize(vertex_count_);
            std::iota(indices.begin(), indices.end(), 0u);
        }
        assemble(indices);
        if (number_of_.size() < vertex_count_) number_of_.resize(vertex_count_, UsedVertices::unused);
        for (glm::uvec3& triangle : geometry_.triangles)
            for (int corner = 0; corner < 3; ++corner) triangle[corner] = numberOf(triangle[corner]);
        return {};
    }

    uint32_t numberOf(uint32_t vertex) {
        if (number_of_[vertex] == UsedVertices::unused) {
            number_of_[vertex] = static_cast<uint32_t>(used_.size());
            used_.push_back(vertex);
        }
        return number_of_[vertex];
    }

    // glTF 2.0 specification, "Topology types".
    void assemble(const std::vector<uint32_t>& v) {
        auto& triangles = geometry_.triangles;
        const size_t n = v.size();
        if (primitive_.mode == TINYGLTF_MODE_TRIANGLES) {
            for (size_t i = 0; i + 2 < n; i += 3) triangles.emplace_back(v[i], v[i + 1], v[i + 2]);
            if (n % 3 != 0) geometry_.warnings.push_back("its last triangle is incomplete and was dropped.");
        } else if (primitive_.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
            for (size_t i = 0; i + 2 < n; ++i) triangles.emplace_back(v[i], v[i + 1 + i % 2], v[i + 2 - i % 2]);
        } else {
            for (size_t i = 0; i + 2 < n; ++i) triangles.emplace_back(v[i + 1], v[i + 2], v[0]);
        }
    }

    const ImportContext& context_;
    const tinygltf::Primitive& primitive_;
    const std::string& owner_;
    size_t vertex_count_ = 0;  // of the file
    std::vector<uint32_t> used_;
    std::vector<uint32_t>& number_of_;  // see UsedVertices; may be longer than it takes
    PrimitiveGeometry geometry_;
};

}  // namespace

Expected<PrimitiveGeometry> readPrimitive(const ImportContext& context, const tinygltf::Primitive& primitive,
                                          const TextureMapping& mapping, const std::string& owner,
                                          std::vector<uint32_t>& scratch) {
    return PrimitiveReader(context, primitive, owner, scratch).read(mapping);
}

}  // namespace dimmer::cook
