#include <pack/pack_reader.h>

#include <format/byte_stream.h>
#include <format/hash.h>
#include <format/layout.h>

#include <pack/decompress.h>
#include <pack/mesh_codec.h>
#include <pack/stored_tables.h>
#include <pack/unshuffle.h>

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace dimmer {
namespace {

using format::ByteReader;
using format::Chunk;
using format::ChunkType;

// An empty page is one repeated byte: zstd stores each block of 128 KiB of it in 4 bytes, and can do no better.
constexpr uint64_t expansion_max = 128 * 1024 / 3;

template <class... Args>
std::unexpected<Error> bad(fmt::format_string<Args...> text, Args&&... args) {
    return fail(ErrorCode::BadInput, fmt::format(text, std::forward<Args>(args)...) + "; copy or cook the pack again");
}

std::string name(ChunkType type) {
    std::string text(4, '?');
    for (size_t i = 0; i < 4; ++i) {
        const char c = static_cast<char>(static_cast<uint32_t>(type) >> (8 * i));
        if (c >= ' ' && c <= '~') text[i] = c;
    }
    return text;
}

// "BASE", "PAYL 3".
std::string name(ChunkType type, uint32_t subject) {
    return type == ChunkType::Payload ? fmt::format("{} {}", name(type), subject) : name(type);
}

std::string name(const Chunk& chunk) {
    return name(static_cast<ChunkType>(chunk.type), chunk.subject);
}

class Reader {
   public:
    explicit Reader(PackSource& file) : file_(file) {}

    Expected<PackData> read() {
        if (auto ok = readHeader(); !ok) return std::unexpected(ok.error());
        if (auto ok = readTable(); !ok) return std::unexpected(ok.error());
        PackData d;
        d.exposure = header_.exposure;
        d.color_format = static_cast<ColorFormat>(header_.color_format);
        d.direction_model = static_cast<DirectionModel>(header_.direction_model);
        d.page_width = header_.page_width;
        d.page_height = header_.page_height;
        d.page_count = header_.page_count;
        Expected<void> ok{};
        auto then = [&](auto&& step) {
            if (ok) ok = step();
        };
        then([&] { return validatePageSizes(d); });
        then([&] { return table(ChunkType::Elements, [&](ByteReader& in) { readElements(in, d); }); });
        then([&] { return table(ChunkType::Contributions, [&](ByteReader& in) { readContributions(in, d); }); });
        then([&] { return readBasePages(d); });
        then([&] { return readTexelTables(d); });
        then([&] { return array(ChunkType::Addresses, d.addresses); });
        then([&] { return readPayload(d); });
        then([&] { return readProbes(d); });
        then([&] { return table(ChunkType::Meshes, [&](ByteReader& in) { readMeshes(in, d); }); });
        then([&] { return table(ChunkType::Viewpoints, [&](ByteReader& in) { readViewpoints(in, d); }); });
        then([&] {
            const uint64_t decoded_max = decodedMax(ChunkType::ModelMeshes);
            return table(ChunkType::ModelMeshes, [&](ByteReader& in) { readModelMeshes(in, decoded_max, d); });
        });
        then([&] { return table(ChunkType::Models, [&](ByteReader& in) { readModels(in, d); }); });
        then([&] { return table(ChunkType::Settings, [&](ByteReader& in) { d.settings_json = in.getString(); }); });
        then([&] { return checkNothingLeft(); });
        if (!ok) return std::unexpected(ok.error());
        return d;
    }

   private:
    Expected<void> readHeader() {
        if (file_.size() < sizeof(header_))
            return bad("the file has {} bytes, less than a pack's header", file_.size());
        const auto raw = file_.read(0, sizeof(header_));
        if (!raw) return std::unexpected(raw.error());
        std::memcpy(&header_, raw->data(), sizeof(header_));
        if (header_.magic != format::magic) return bad("this is not a Dimmer pack");
        if (header_.endian_tag != format::endian_tag) return bad("the pack's byte order is not little-endian");
        if (header_.version != format::version)
            return fail(ErrorCode::BadInput,
                        fmt::format("the pack is of format version {}, this build reads version {}; cook the level "
                                    "again with this build, or use the one that wrote the pack",
                                    header_.version, format::version));
        if (header_.file_bytes != file_.size())
            return bad("the file has {} bytes, its header says {}", file_.size(), header_.file_bytes);
        return {};
    }

    Expected<void> readTable() {
        if (header_.chunk_count > (file_.size() - sizeof(header_)) / sizeof(Chunk))
            return bad("the table of {} chunks does not fit the file", header_.chunk_count);
        const auto raw = file_.read(sizeof(header_), header_.chunk_count * sizeof(Chunk));
        if (!raw) return std::unexpected(raw.error());
        if (format::headerHash(header_, *raw) != header_.xxh64) return bad("the header or the chunk table is damaged");
        chunks_.resize(header_.chunk_count);
        if (!raw->empty()) std::memcpy(chunks_.data(), raw->data(), raw->size());
        const uint64_t table_end = sizeof(header_) + raw->size();
        for (const Chunk& c : chunks_) {
            if (c.offset < table_end || c.offset % format::chunk_alignment_bytes != 0)
                return bad("chunk {} is misplaced", name(c));
            if (c.offset > file_.size() || c.stored_bytes > file_.size() - c.offset)
                return bad("chunk {} reaches past the end of the file", name(c));
            if (c.real_bytes / expansion_max > c.stored_bytes || c.shuffle == 0)
                return bad("chunk {} has an impossible size", name(c));
            if (known(c.type) && c.real_bytes % c.shuffle != 0) return bad("chunk {} ends within a record", name(c));
            if (known(c.type) && (c.flags & ~(format::chunk_optional | format::chunk_delta)) != 0)
                return bad("chunk {} is stored in a way that this build does not know", name(c));
            if (!known(c.type) && !(c.flags & format::chunk_optional))
                return bad("chunk {} is of a type that this build does not know", name(c));
            if (known(c.type) && !by_name_.emplace(std::pair(c.type, c.subject), &c).second)
                return bad("chunk {} stands there twice", name(c));
        }
        return checkNoneOverlap();
    }

    // Of one frame that many chunks name, a small file could unfold without end.
    Expected<void> checkNoneOverlap() const {
        std::vector<const Chunk*> by_offset;
        for (const Chunk& c : chunks_) by_offset.push_back(&c);
        std::ranges::stable_sort(by_offset, {}, &Chunk::offset);
        for (size_t i = 1; i < by_offset.size(); ++i) {
            const Chunk &a = *by_offset[i - 1], &b = *by_offset[i];
            if (b.offset - a.offset < a.stored_bytes) return bad("chunk {} and chunk {} share bytes", name(a), name(b));
        }
        return {};
    }

    static bool known(uint32_t type) {
        switch (static_cast<ChunkType>(type)) {
            case ChunkType::Elements:
            case ChunkType::Contributions:
            case ChunkType::BasePages:
            case ChunkType::Clusters:
            case ChunkType::Terms:
            case ChunkType::Batches:
            case ChunkType::Addresses:
            case ChunkType::Payload:
            case ChunkType::ProbeBase:
            case ChunkType::ProbeClusters:
            case ChunkType::ProbeTerms:
            case ChunkType::ProbeBatches:
            case ChunkType::ProbeNumbers:
            case ChunkType::ProbeCounts:
            case ChunkType::ProbePayload:
            case ChunkType::GridPositions:
            case ChunkType::GridLevels:
            case ChunkType::GridTetrahedra:
            case ChunkType::GridVisibility:
            case ChunkType::GridStarts:
            case ChunkType::GridBox:
            case ChunkType::LocalGrids:
            case ChunkType::Meshes:
            case ChunkType::Viewpoints:
            case ChunkType::ModelMeshes:
            case ChunkType::Models:
            case ChunkType::Settings:
                return true;
        }
        return false;
    }

    // What the header and the tables know of a chunk's size, before it is decoded. One that is missing load() reports.
    Expected<void> expectBytes(ChunkType type, uint32_t subject, uint64_t bytes) const {
        const auto found = by_name_.find({static_cast<uint32_t>(type), subject});
        if (found == by_name_.end() || found->second->real_bytes == bytes) return {};
        return bad("chunk {} states {} bytes instead of {}", name(type, subject), found->second->real_bytes, bytes);
    }

    // A chunk as the file has it: whole records of `shuffle` bytes, in the shuffle's order.
    struct Shuffled {
        std::vector<std::byte> bytes;
        uint32_t shuffle;
        bool differences;

        void to(std::span<std::byte> out) const { unshuffle(bytes, shuffle, differences, out); }
    };

    Expected<Shuffled> load(ChunkType type, uint32_t subject) {
        const auto found = by_name_.find({static_cast<uint32_t>(type), subject});
        if (found == by_name_.end()) return bad("chunk {} is missing", name(type, subject));
        const Chunk& c = *found->second;
        by_name_.erase(found);
        const auto stored = file_.read(c.offset, c.stored_bytes);
        if (!stored) return std::unexpected(stored.error());
        if (format::chunkHash(*stored) != c.xxh64) return bad("chunk {} is damaged", name(c));
        auto shuffled = decompressor_.run(*stored, c.real_bytes);
        if (!shuffled) return bad("chunk {} does not hold the {} bytes that it states", name(c), c.real_bytes);
        return Shuffled{std::move(*shuffled), c.shuffle, (c.flags & format::chunk_delta) != 0};
    }

    Expected<void> checkNothingLeft() const {
        if (by_name_.empty()) return {};
        const Chunk& c = *by_name_.begin()->second;
        return bad("chunk {} belongs to nothing", name(c));
    }

    template <class T>
    Expected<void> array(ChunkType type, std::vector<T>& out, uint32_t subject = 0) {
        const auto chunk = load(type, subject);
        if (!chunk) return std::unexpected(chunk.error());
        if (chunk->bytes.size() % sizeof(T) != 0) return bad("chunk {} ends within a record", name(type, subject));
        const size_t old = out.size();
        out.resize(old + chunk->bytes.size() / sizeof(T));
        chunk->to(std::as_writable_bytes(std::span(out).subspan(old)));
        return {};
    }

    Expected<void> table(ChunkType type, auto&& parse) {
        const auto chunk = load(type, 0);
        if (!chunk) return std::unexpected(chunk.error());
        std::vector<std::byte> bytes(chunk->bytes.size());
        chunk->to(bytes);
        ByteReader in(bytes);
        parse(in);
        if (!in.atEnd()) return bad("chunk {} is malformed", name(type));
        return {};
    }

    Expected<ReceiverTables> receiverTables(const std::array<ChunkType, 3>& types,
                                            std::span<const uint32_t> record_counts) {
        StoredTables stored;
        Expected<void> ok = array(types[0], stored.clusters);
        if (ok) ok = array(types[1], stored.terms);
        if (ok) ok = array(types[2], stored.batches);
        if (!ok) return std::unexpected(ok.error());
        return restored(stored, record_counts);
    }

    Expected<void> readTexelTables(PackData& d) {
        std::vector<uint32_t> record_counts;
        for (const Contribution& c : d.contributions) record_counts.push_back(c.receivers);
        auto tables = receiverTables({ChunkType::Clusters, ChunkType::Terms, ChunkType::Batches}, record_counts);
        if (!tables) return std::unexpected(tables.error());
        d.clusters = std::move(tables->clusters);
        d.terms = std::move(tables->terms);
        d.batches = std::move(tables->batches);
        return {};
    }

    Expected<void> readProbeTables(ProbeData& probes) {
        auto tables = receiverTables({ChunkType::ProbeClusters, ChunkType::ProbeTerms, ChunkType::ProbeBatches},
                                     probes.record_counts);
        if (!tables) return std::unexpected(tables.error());
        probes.clusters = std::move(tables->clusters);
        probes.terms = std::move(tables->terms);
        probes.batches = std::move(tables->batches);
        return {};
    }

    Expected<void> readBasePages(PackData& d) {
        const uint64_t texels = uint64_t{d.page_count} * d.page_height * d.page_width;
        if (auto ok = expectBytes(ChunkType::BasePages, 0, texels * sizeof(TexelRecord)); !ok) return ok;
        return array(ChunkType::BasePages, d.base_pages);
    }

    Expected<void> readPayload(PackData& d) {
        d.payload.reserve(payloadLikely(d.contributions));
        for (uint32_t k = 0; k < d.contributions.size(); ++k) {
            const uint64_t receivers = d.contributions[k].receivers;
            if (receivers > d.addresses.size())
                return bad("contribution {} lists {} receivers of {}", k, receivers, d.addresses.size());
            Expected<void> ok = expectBytes(ChunkType::Payload, k, receivers * sizeof(TexelRecord));
            if (ok) ok = array(ChunkType::Payload, d.payload, k);
            if (!ok) return ok;
        }
        return {};
    }

    // Records that contributions state, but no more than what is stored could reasonably unfold to: without it the
    // array would grow by halves and stand in memory twice while it does.
    size_t payloadLikely(std::span<const Contribution> contributions) const {
        constexpr uint64_t expansion_likely = 8;
        uint64_t records = 0, stored_bytes = 0;
        for (const Contribution& c : contributions) records += c.receivers;
        for (const Chunk& c : chunks_)
            if (c.type == static_cast<uint32_t>(ChunkType::Payload)) stored_bytes += c.stored_bytes;
        return std::min(records, expansion_likely * stored_bytes / sizeof(TexelRecord));
    }

    Expected<void> readProbes(PackData& d) {
        if (!by_name_.contains({static_cast<uint32_t>(ChunkType::ProbeBase), 0})) return {};
        Expected<void> ok = array(ChunkType::ProbeBase, d.probes.base);
        if (ok) ok = array(ChunkType::ProbeCounts, d.probes.record_counts);
        if (ok) ok = readProbeTables(d.probes);
        if (ok) ok = array(ChunkType::ProbeNumbers, d.probes.numbers);
        if (ok) ok = array(ChunkType::ProbePayload, d.probes.payload);
        if (ok) ok = readGlobalGrid(d.probes.global);
        if (ok) ok = table(ChunkType::LocalGrids, [&](ByteReader& in) { readLocalGrids(in, d); });
        return ok;
    }

    Expected<void> readGlobalGrid(GlobalGrid& grid) {
        Expected<void> ok = array(ChunkType::GridPositions, grid.positions);
        if (ok) ok = array(ChunkType::GridLevels, grid.levels);
        if (ok) ok = readTetrahedra(grid);
        if (ok) ok = array(ChunkType::GridVisibility, grid.visibility);
        if (ok) ok = array(ChunkType::GridStarts, grid.starts);
        if (ok) ok = table(ChunkType::GridBox, [&](ByteReader& in) { grid.start = in.get<StartGrid>(); });
        return ok;
    }

    Expected<void> readTetrahedra(GlobalGrid& grid) {
        std::vector<StoredTetrahedron> stored;
        if (auto ok = array(ChunkType::GridTetrahedra, stored); !ok) return ok;
        auto tetrahedra = restoredTetrahedra(stored, grid.positions.size());
        if (!tetrahedra)
            return bad("chunk {} tells of no tetrahedra, names probes that are not there, or has three share a face",
                       name(ChunkType::GridTetrahedra));
        grid.tetrahedra = std::move(*tetrahedra);
        return {};
    }

    static void readLocalGrids(ByteReader& in, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 68)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            LocalGrid grid;
            grid.node = in.getString();
            grid.first_probe = in.get<uint32_t>();
            grid.counts = in.get<std::array<uint32_t, 3>>();
            grid.origin_m = in.get<std::array<float, 3>>();
            grid.step_m = in.get<std::array<std::array<float, 3>, 3>>();
            d.probes.local.push_back(std::move(grid));
        }
    }

    static void readElements(ByteReader& in, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 12)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            Element e;
            e.name = in.getString();
            e.kind = static_cast<ElementKind>(in.get<uint32_t>());
            e.max_weight = in.get<float>();
            d.elements.push_back(std::move(e));
        }
    }

    static std::optional<uint32_t> optionalIndex(ByteReader& in) {
        const uint32_t value = in.get<uint32_t>();
        return value == UINT32_MAX ? std::nullopt : std::optional(value);
    }

    static void readContributions(ByteReader& in, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 20)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            Contribution c;
            c.light_set = optionalIndex(in);
            c.doors_open = in.getArray<uint32_t>();
            c.doors_closed = in.getArray<uint32_t>();
            c.receivers = in.get<uint32_t>();
            c.energy_dropped = in.get<float>();
            d.contributions.push_back(std::move(c));
        }
    }

    static void readMeshes(ByteReader& in, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 48)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            Mesh m;
            m.node = in.getString();
            m.page = in.get<uint32_t>();
            m.door = optionalIndex(in);
            m.reflectance = in.get<std::array<float, 3>>();
            m.emission_cd_m2 = in.get<std::array<float, 3>>();
            m.emission_set = optionalIndex(in);
            m.vertices = in.getArray<MeshVertex>();
            m.indices = in.getArray<uint32_t>();
            d.meshes.push_back(std::move(m));
        }
    }

    static void readViewpoints(ByteReader& in, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 32)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            Viewpoint v;
            v.name = in.getString();
            v.position_m = in.get<std::array<float, 3>>();
            v.forward = in.get<std::array<float, 3>>();
            v.vertical_fov_rad = in.get<float>();
            d.viewpoints.push_back(std::move(v));
        }
    }

    // A chunk's bytes unfold no further because they are encoded twice.
    uint64_t decodedMax(ChunkType type) const {
        const auto found = by_name_.find({static_cast<uint32_t>(type), 0});
        return found == by_name_.end() ? 0 : expansion_max * found->second->stored_bytes;
    }

    static void readModelMeshes(ByteReader& in, uint64_t decoded_max, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 72)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            ModelMesh m;
            m.name = in.getString();
            m.min_m = in.get<std::array<float, 3>>();
            m.max_m = in.get<std::array<float, 3>>();
            m.reflectance = in.get<std::array<float, 3>>();
            m.emission_cd_m2 = in.get<std::array<float, 3>>();
            m.emission_set = optionalIndex(in);
            const uint32_t vertex_count = in.get<uint32_t>();
            const auto encoded_vertices = in.getArray<std::byte>();
            const uint32_t index_count = in.get<uint32_t>();
            const auto encoded_indices = in.getArray<std::byte>();
            const uint64_t decoded =
                uint64_t{vertex_count} * sizeof(ModelVertex) + uint64_t{index_count} * sizeof(uint32_t);
            if (decoded > decoded_max) return in.fail();
            decoded_max -= decoded;
            auto vertices = decodeVertices(vertex_count, encoded_vertices);
            auto indices = decodeIndices(index_count, encoded_indices);
            if (!vertices || !indices) return in.fail();
            m.vertices = std::move(*vertices);
            m.indices = std::move(*indices);
            d.model_meshes.push_back(std::move(m));
        }
    }

    static void readModels(ByteReader& in, PackData& d) {
        const uint32_t count = in.get<uint32_t>();
        if (!in.fits(count, 88)) return in.fail();
        for (uint32_t i = 0; i < count && in.ok(); ++i) {
            PlacedModel m;
            m.node = in.getString();
            m.first_mesh = in.get<uint32_t>();
            m.mesh_count = in.get<uint32_t>();
            m.local_grid = optionalIndex(in);
            m.world_from_model = in.get<Transform>();
            m.min_m = in.get<std::array<float, 3>>();
            m.max_m = in.get<std::array<float, 3>>();
            d.models.push_back(std::move(m));
        }
    }

    PackSource& file_;
    format::Header header_{};
    std::vector<Chunk> chunks_;
    std::map<std::pair<uint32_t, uint32_t>, const Chunk*> by_name_;  // type and subject; those not yet loaded
    Decompressor decompressor_;
};

}  // namespace

Expected<PackData> readPack(PackSource& source) {
    return Reader(source).read();
}

}  // namespace dimmer
