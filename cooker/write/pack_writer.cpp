#include <write/pack_writer.h>

#include <format/byte_stream.h>
#include <format/hash.h>
#include <format/layout.h>
#include <pack/stored_tables.h>

#include <fcntl.h>
#include <fmt/format.h>
#include <meshoptimizer.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>
#include <unistd.h>
#include <zstd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>

namespace dimmer::cook {
namespace {

using format::ByteWriter;
using format::Chunk;
using format::ChunkType;

class Writer {
   public:
    Writer(const PackData& data, int zstd_level) : d_(data), zstd_level_(zstd_level) {}

    std::vector<std::byte> write() {
        addTable(ChunkType::Elements, [&](ByteWriter& out) { putElements(out); });
        addTable(ChunkType::Contributions, [&](ByteWriter& out) { putContributions(out); });
        addArray(ChunkType::BasePages, std::span(d_.base_pages));
        addTables({ChunkType::Clusters, ChunkType::Terms, ChunkType::Batches}, d_.texelView());
        addArray(ChunkType::Addresses, std::span(d_.addresses));
        size_t first = 0;
        for (uint32_t k = 0; k < d_.contributions.size(); ++k) {
            addArray(ChunkType::Payload, std::span(d_.payload).subspan(first, d_.contributions[k].receivers), k);
            first += d_.contributions[k].receivers;
        }
        if (!d_.probes.base.empty() || !d_.probes.local.empty()) addProbes(d_.probes);
        addTable(ChunkType::Meshes, [&](ByteWriter& out) { putMeshes(out); });
        addTable(ChunkType::Viewpoints, [&](ByteWriter& out) { putViewpoints(out); });
        addTable(ChunkType::ModelMeshes, [&](ByteWriter& out) { putModelMeshes(out); });
        addTable(ChunkType::Models, [&](ByteWriter& out) { putModels(out); });
        addTable(ChunkType::Settings, [&](ByteWriter& out) { out.putString(d_.settings_json); });
        compressAll();
        return assemble();
    }

   private:
    // Chunks are compressed together at the end, on all threads: the larger part of writing a pack.
    struct Content {
        std::vector<std::byte> own;  // of what is not in PackData as the file has it
        std::span<const std::byte> bytes;
    };

    // Neighbours in these are alike, byte by byte; of all others zstd makes less of the differences.
    static bool storesDifferences(ChunkType type) {
        return type == ChunkType::BasePages || type == ChunkType::Payload || type == ChunkType::Addresses ||
               type == ChunkType::ProbeBase || type == ChunkType::ProbeNumbers || type == ChunkType::GridPositions;
    }

    void add(ChunkType type, uint32_t subject, Content content, uint32_t record_bytes) {
        chunks_.push_back({.type = static_cast<uint32_t>(type),
                           .flags = storesDifferences(type) ? format::chunk_delta : 0u,
                           .subject = subject,
                           .shuffle = record_bytes,
                           .offset = 0,
                           .stored_bytes = 0,
                           .real_bytes = content.bytes.size(),
                           .xxh64 = 0});
        contents_.push_back(std::move(content));
    }

    void compressAll() {
        bodies_.resize(chunks_.size());
        tbb::parallel_for(size_t{0}, chunks_.size(), [&](size_t i) {
            bodies_[i] = compressed(contents_[i].bytes, chunks_[i].shuffle, chunks_[i].flags & format::chunk_delta);
            chunks_[i].stored_bytes = bodies_[i].size();
            chunks_[i].xxh64 = format::chunkHash(bodies_[i]);
        });
    }

    std::vector<std::byte> compressed(std::span<const std::byte> bytes, uint32_t record_bytes, bool differences) const {
        std::vector<std::byte> shuffled(bytes.size());
        const size_t count = bytes.size() / record_bytes;
        for (size_t b = 0; b < record_bytes; ++b) {
            const std::span plane = std::span(shuffled).subspan(b * count, count);
            for (size_t i = 0; i < count; ++i) plane[i] = bytes[i * record_bytes + b];
            for (size_t i = count; differences && i-- > 1;)
                plane[i] = std::byte(std::to_integer<uint8_t>(plane[i]) - std::to_integer<uint8_t>(plane[i - 1]));
        }
        std::vector<std::byte> stored(ZSTD_compressBound(shuffled.size()));
        const size_t size = ZSTD_compress(stored.data(), stored.size(), shuffled.data(), shuffled.size(), zstd_level_);
        if (ZSTD_isError(size)) throw std::bad_alloc();  // with room for the result, memory is all that it can lack
        stored.resize(size);
        return stored;
    }

    template <class T>
    void addArray(ChunkType type, std::span<const T> values, uint32_t subject = 0) {
        add(type, subject, {{}, std::as_bytes(values)}, sizeof(T));
    }

    template <class T>
    void addArray(ChunkType type, std::vector<T>&& values) {
        const auto bytes = std::as_bytes(std::span(values));
        Content content{{bytes.begin(), bytes.end()}, {}};
        content.bytes = content.own;
        add(type, 0, std::move(content), sizeof(T));
    }

    void addTables(const std::array<ChunkType, 3>& types, const ReceiverView& tables) {
        StoredTables stored = storedTables(tables);
        addArray(types[0], std::move(stored.clusters));
        addArray(types[1], std::move(stored.terms));
        addArray(types[2], std::move(stored.batches));
    }

    void addProbes(const ProbeData& probes) {
        addArray(ChunkType::ProbeBase, std::span(probes.base));
        addTables({ChunkType::ProbeClusters, ChunkType::ProbeTerms, ChunkType::ProbeBatches}, probes.view());
        addArray(ChunkType::ProbeNumbers, std::span(probes.numbers));
        addArray(ChunkType::ProbeCounts, std::span(probes.record_counts));
        addArray(ChunkType::ProbePayload, std::span(probes.payload));
        addArray(ChunkType::GridPositions, std::span(probes.global.positions));
        addArray(ChunkType::GridLevels, std::span(probes.global.levels));
        addArray(ChunkType::GridTetrahedra, storedTetrahedra(probes.global.tetrahedra, probes.global.positions.size()));
        addArray(ChunkType::GridVisibility, std::span(probes.global.visibility));
        addArray(ChunkType::GridStarts, std::span(probes.global.starts));
        addTable(ChunkType::GridBox, [&](ByteWriter& out) { out.put(probes.global.start); });
        addTable(ChunkType::LocalGrids, [&](ByteWriter& out) { putLocalGrids(out); });
    }

    void addTable(ChunkType type, auto&& fill) {
        ByteWriter out;
        fill(out);
        Content content{out.take(), {}};
        content.bytes = content.own;
        add(type, 0, std::move(content), 1);
    }

    static void putOptional(ByteWriter& out, std::optional<uint32_t> index) { out.put(index.value_or(UINT32_MAX)); }

    void putElements(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.elements.size()));
        for (const Element& e : d_.elements) {
            out.putString(e.name);
            out.put(static_cast<uint32_t>(e.kind));
            out.put(e.max_weight);
        }
    }

    void putContributions(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.contributions.size()));
        for (const Contribution& c : d_.contributions) {
            putOptional(out, c.light_set);
            out.putArray(std::span<const uint32_t>(c.doors_open));
            out.putArray(std::span<const uint32_t>(c.doors_closed));
            out.put(c.receivers);
            out.put(c.energy_dropped);
        }
    }

    void putLocalGrids(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.probes.local.size()));
        for (const LocalGrid& grid : d_.probes.local) {
            out.putString(grid.node);
            out.put(grid.first_probe);
            out.put(grid.counts);
            out.put(grid.origin_m);
            out.put(grid.step_m);
        }
    }

    void putMeshes(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.meshes.size()));
        for (const Mesh& m : d_.meshes) {
            out.putString(m.node);
            out.put(m.page);
            putOptional(out, m.door);
            out.put(m.reflectance);
            out.put(m.emission_cd_m2);
            putOptional(out, m.emission_set);
            out.putArray(std::span<const MeshVertex>(m.vertices));
            out.putArray(std::span<const uint32_t>(m.indices));
        }
    }

    void putViewpoints(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.viewpoints.size()));
        for (const Viewpoint& v : d_.viewpoints) {
            out.putString(v.name);
            out.put(v.position_m);
            out.put(v.forward);
            out.put(v.vertical_fov_rad);
        }
    }

    static std::vector<std::byte> encoded(const std::vector<ModelVertex>& vertices) {
        std::vector<std::byte> bytes(meshopt_encodeVertexBufferBound(vertices.size(), sizeof(ModelVertex)));
        meshopt_encodeVertexVersion(0);
        bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                                vertices.data(), vertices.size(), sizeof(ModelVertex)));
        return bytes;
    }
    static std::vector<std::byte> encoded(const std::vector<uint32_t>& indices, size_t vertices) {
        std::vector<std::byte> bytes(meshopt_encodeIndexBufferBound(indices.size(), vertices));
        meshopt_encodeIndexVersion(1);
        bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                               indices.data(), indices.size()));
        return bytes;
    }

    void putModelMeshes(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.model_meshes.size()));
        for (const ModelMesh& m : d_.model_meshes) {
            out.putString(m.name);
            out.put(m.min_m);
            out.put(m.max_m);
            out.put(m.reflectance);
            out.put(m.emission_cd_m2);
            putOptional(out, m.emission_set);
            out.put(static_cast<uint32_t>(m.vertices.size()));
            out.putArray(std::span<const std::byte>(encoded(m.vertices)));
            out.put(static_cast<uint32_t>(m.indices.size()));
            out.putArray(std::span<const std::byte>(encoded(m.indices, m.vertices.size())));
        }
    }

    void putModels(ByteWriter& out) const {
        out.put(static_cast<uint32_t>(d_.models.size()));
        for (const PlacedModel& m : d_.models) {
            out.putString(m.node);
            out.put(m.first_mesh);
            out.put(m.mesh_count);
            putOptional(out, m.local_grid);
            out.put(m.world_from_model);
            out.put(m.min_m);
            out.put(m.max_m);
        }
    }

    std::vector<std::byte> assemble() {
        auto align = [](uint64_t v) {
            return (v + format::chunk_alignment_bytes - 1) / format::chunk_alignment_bytes *
                   format::chunk_alignment_bytes;
        };
        uint64_t end = sizeof(format::Header) + chunks_.size() * sizeof(Chunk);
        for (Chunk& c : chunks_) {
            c.offset = align(end);
            end = c.offset + c.stored_bytes;
        }
        format::Header header{.magic = format::magic,
                              .version = format::version,
                              .endian_tag = format::endian_tag,
                              .file_bytes = end,
                              .xxh64 = 0,
                              .exposure = d_.exposure,
                              .page_width = d_.page_width,
                              .page_height = d_.page_height,
                              .page_count = d_.page_count,
                              .chunk_count = static_cast<uint32_t>(chunks_.size()),
                              .color_format = static_cast<uint32_t>(d_.color_format),
                              .direction_model = static_cast<uint32_t>(d_.direction_model),
                              .reserved = 0};
        header.xxh64 = format::headerHash(header, std::as_bytes(std::span(chunks_)));
        std::vector<std::byte> file(end);
        std::memcpy(file.data(), &header, sizeof(header));
        std::memcpy(file.data() + sizeof(header), chunks_.data(), chunks_.size() * sizeof(Chunk));
        for (size_t i = 0; i < chunks_.size(); ++i)
            std::memcpy(file.data() + chunks_[i].offset, bodies_[i].data(), bodies_[i].size());
        return file;
    }

    const PackData& d_;
    const int zstd_level_;
    std::vector<Chunk> chunks_;
    std::vector<Content> contents_;  // moving one leaves its bytes where they are
    std::vector<std::vector<std::byte>> bodies_;
};

std::unexpected<Error> ioError(const std::filesystem::path& path, std::string_view what, int error) {
    return fail(ErrorCode::Io, fmt::format("{}: {}: {}", path.string(), what, strerror(error)));
}

bool writeAll(int file, std::span<const std::byte> bytes) {
    for (size_t done = 0; done < bytes.size();) {
        const ssize_t n = ::write(file, bytes.data() + done, bytes.size() - done);
        if (n < 0 && errno != EINTR) return false;
        if (n > 0) done += static_cast<size_t>(n);
    }
    return true;
}

// A device, pipe or terminal has no content to keep, and must not be replaced by a file.
Expected<void> writeToSpecialFile(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    const int file = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) return ioError(path, "cannot be opened", errno);
    const int error = writeAll(file, bytes) ? 0 : errno;
    close(file);
    if (error != 0) return ioError(path, "cannot be written", error);
    return {};
}

// A file that is there; nothing of what is none.
std::optional<struct stat> fileAt(const std::filesystem::path& path) {
    struct stat status {};
    if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
    return status;
}

// mkstemp's files are private: this one gets owner, group and rights of the one that it replaces. Where the owner
// cannot be kept, the usual rights of a new file, as those of before were for another; where the group cannot, none for
// it.
bool giveRights(int file, const std::optional<struct stat>& replaced) {
    const mode_t mask = umask(0);
    umask(mask);
    mode_t rights = 0666 & ~mask;
    if (replaced && fchown(file, replaced->st_uid, replaced->st_gid) == 0)
        rights = replaced->st_mode & 0777;
    else if (replaced && replaced->st_uid == geteuid())
        rights = replaced->st_mode & 0707;
    return fchmod(file, rights) == 0;
}

// What mkstemp makes random behind the name of a file that is replaced.
constexpr std::string_view temporary_suffix = ".XXXXXX";

// The name is the folder's: without it a power cut may leave the old file. What cannot be opened or flushed is as it
// is.
void flushFolder(const std::filesystem::path& file) {
    const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
    const int opened = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (opened < 0) return;
    fsync(opened);
    close(opened);
}

Expected<void> replaceFile(const std::filesystem::path& path, std::span<const std::byte> bytes, Flush flush) {
    const std::scoped_lock lock(fileReplacement());
    std::string temporary = path.string().append(temporary_suffix);
    const int file = mkstemp(temporary.data());
    if (file < 0) return ioError(path, "no file can be made in this folder", errno);
    const bool written =
        writeAll(file, bytes) && giveRights(file, fileAt(path)) && (flush == Flush::No || fsync(file) == 0);
    const int error = written ? 0 : errno;
    close(file);
    if (written && rename(temporary.c_str(), path.c_str()) == 0) {
        if (flush == Flush::Yes) flushFolder(path);
        return {};
    }
    const auto failed = ioError(path, "cannot be written, nothing was changed", written ? errno : error);
    unlink(temporary.c_str());
    return failed;
}

bool isFolder(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored);
}

bool isSpecialFile(const std::filesystem::path& path) {
    std::error_code ignored;
    const auto status = std::filesystem::status(path, ignored);
    return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
           !std::filesystem::is_directory(status);
}

// Whether replaceFile() has the rights and the room for the temporary's name.
Expected<void> checkReplaceable(const std::filesystem::path& path) {
    const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    std::error_code error;
    if (std::filesystem::status(folder, error).type() == std::filesystem::file_type::none)
        return ioError(path, "its folder cannot be looked at", error.value());
    if (!isFolder(folder))
        return fail(ErrorCode::Io, fmt::format("{}: there is no folder {}", path.string(), folder.string()));
    // faccessat() asks for the user that creates files: access() would ask for the one behind a setuid.
    if (faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0)
        return ioError(path, "no file can be made in this folder", errno);
    // The bits themselves, as root may write anything, and a rename asks nobody.
    if (const auto file = fileAt(path); file && (file->st_mode & 0222) == 0)
        return fail(ErrorCode::Io, fmt::format("{}: is read-only", path.string()));
    const auto tooLong = [&](size_t bytes, int limit) {
        const long most = pathconf(folder.c_str(), limit);  // of paths: with the 0 at their end
        return most > 0 && bytes + temporary_suffix.size() + (limit == _PC_PATH_MAX) > static_cast<size_t>(most);
    };
    if (tooLong(path.filename().native().size(), _PC_NAME_MAX) || tooLong(path.native().size(), _PC_PATH_MAX))
        return ioError(path, "cannot be written", ENAMETOOLONG);
    return {};
}

}  // namespace

std::vector<std::byte> packBytes(const PackData& data, int zstd_level) {
    return Writer(data, zstd_level).write();
}

std::mutex& fileReplacement() {
    static std::mutex mutex;
    return mutex;
}

Expected<std::filesystem::path> behindLinks(const std::filesystem::path& path) {
    constexpr int links_max = 40;  // as many as Linux follows
    std::filesystem::path file = path;
    for (int links = 0; links <= links_max; ++links) {
        std::error_code error;
        if (!std::filesystem::is_symlink(std::filesystem::symlink_status(file, error))) return file;
        const auto next = std::filesystem::read_symlink(file, error);
        if (error) return ioError(path, "the link cannot be followed", error.value());
        file = file.parent_path() / next;
    }
    return ioError(path, "the link cannot be followed", ELOOP);
}

Expected<void> checkWritable(const std::filesystem::path& path) {
    if (path.empty()) return fail(ErrorCode::InvalidArgument, "the name of the file to write is empty");
    if (isFolder(path)) return ioError(path, "cannot be written", EISDIR);
    if (isSpecialFile(path)) {
        if (faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) != 0) return ioError(path, "cannot be opened", errno);
        return {};
    }
    const auto file = behindLinks(path);
    if (!file) return std::unexpected(file.error());
    return checkReplaceable(*file);
}

Expected<void> writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes, Flush flush) {
    if (auto ok = checkWritable(path); !ok) return ok;
    if (isSpecialFile(path)) return writeToSpecialFile(path, bytes);
    // The file that a link stands for is what the user means to replace.
    const auto file = behindLinks(path);
    return file ? replaceFile(*file, bytes, flush) : std::unexpected(file.error());
}

}  // namespace dimmer::cook
