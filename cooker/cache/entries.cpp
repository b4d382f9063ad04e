#include <cache/entries.h>

#include <format/byte_stream.h>
#include <pack/unshuffle.h>

namespace dimmer::cook {
namespace {

using format::ByteReader;
using format::ByteWriter;

template <class T>
void putAll(ByteWriter& out, const std::vector<T>& values) {
    out.putArray(std::span<const T>(values));
}

// The fields of both directions are listed once: `visit` is a ByteWriter's put or a ByteReader's get.
void visitMesh(auto& mesh, auto&& visit) {
    visit(mesh.positions_m);
    visit(mesh.normals);
    visit(mesh.uv0);
    visit(mesh.uv1);
    visit(mesh.triangles);
    visit(mesh.triangle_materials);
    visit(mesh.triangle_regions);
}

void visitUnwrap(auto& u, auto&& visit) {
    visit(u.faces);
    visit(u.uv_texels);
    visit(u.face_chart);
    visit(u.frames);
    visit(u.texel_area_m2);
    visit(u.front_face);
    visit(u.back_face);
    visit(u.charts);
}

void visitTexels(auto& t, auto&& visit) {
    visit(t.address);
    visit(t.area_m2);
    visit(t.reflectance);
    visit(t.first_sample);
    visit(t.samples);
    visit(t.fills);
    visit(t.receiver_at);
}

template <class T>
void getAll(ByteReader& in, std::vector<T>& values) {
    values = in.getArray<T>();
}

// Columns of bytes: the first bytes of all floats, then the second of all, and so on, which zstd packs better.
void putFloats(ByteWriter& out, const std::vector<float>& values) {
    const auto raw = std::as_bytes(std::span(values));
    std::vector<std::byte> columns(raw.size());
    for (size_t b = 0; b < sizeof(float); ++b)
        for (size_t i = 0; i < values.size(); ++i) columns[b * values.size() + i] = raw[i * sizeof(float) + b];
    putAll(out, columns);
}

std::vector<float> getFloats(ByteReader& in) {
    const auto columns = in.getArray<std::byte>();
    std::vector<float> values(columns.size() / sizeof(float));
    const auto raw = std::as_writable_bytes(std::span(values));
    unshuffle(std::span(columns).first(raw.size()), sizeof(float), false, raw);
    return values;
}

// What is kept of an entry besides its term: nothing but floats.
struct StoredLight {
    Gathered light;
    float keep;
};
StoredLight stored(const ReceiverLight& l) {
    return {l.light, l.keep};
}
struct StoredProbeLight {
    ProbeLight light;
    float variance;
};
StoredProbeLight stored(const ProbeTermLight& l) {
    return {l.light, l.variance};
}
glm::vec3 stored(const TermLight& l) {
    return l.value();
}
void restore(const StoredLight& from, ReceiverLight& l) {
    l.light = from.light;
    l.keep = from.keep;
}
void restore(const StoredProbeLight& from, ProbeTermLight& l) {
    l.light = from.light;
    l.variance = from.variance;
}
void restore(const glm::vec3& from, TermLight& l) {
    static const Rounding any(0, Rounding::Of::Outgoing);  // nothing is left to round
    l = TermLight(l.term, from, any);
}

template <class Entry>
using Stored = std::decay_t<decltype(stored(std::declval<Entry>()))>;
template <class Entry>
constexpr size_t stored_floats = sizeof(Stored<Entry>) / sizeof(float);

// Counts, terms, and the values in columns of floats.
template <class Entry>
void putRows(ByteWriter& out, const Sparse<Entry>& light) {
    std::vector<uint32_t> counts, terms;  // a level with many doors has more than 65,535
    const size_t count = light.entryCount();
    std::vector<float> columns(count * stored_floats<Entry>);
    size_t n = 0;
    for (size_t i = 0; i < light.rows(); ++i) {
        counts.push_back(static_cast<uint32_t>(light.row(i).size()));
        for (const Entry& l : light.row(i)) {
            terms.push_back(l.term);
            const auto values = std::bit_cast<std::array<float, stored_floats<Entry>>>(stored(l));
            for (size_t f = 0; f < values.size(); ++f) columns[f * count + n] = values[f];
            ++n;
        }
    }
    putAll(out, counts);
    putAll(out, terms);
    putFloats(out, columns);
}

template <class Entry>
std::optional<Sparse<Entry>> getRows(ByteReader& in) {
    const auto counts = in.getArray<uint32_t>();
    const auto terms = in.getArray<uint32_t>();
    const std::vector<float> columns = getFloats(in);
    if (!in.ok() || columns.size() != terms.size() * stored_floats<Entry>) return {};
    typename Sparse<Entry>::Builder rows(counts.size());
    std::vector<Entry> row;
    size_t n = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
        row.clear();
        if (counts[i] > terms.size() - n) return {};
        for (uint32_t k = 0; k < counts[i]; ++k, ++n) {
            std::array<float, stored_floats<Entry>> values;
            for (size_t f = 0; f < values.size(); ++f) values[f] = columns[f * terms.size() + n];
            Entry& entry = row.emplace_back();
            entry.term = terms[n];
            restore(std::bit_cast<Stored<Entry>>(values), entry);
        }
        rows.put(i, row);
    }
    if (n != terms.size()) return {};
    return rows.finish();
}

void visitGrid(auto& grid, auto&& visit) {
    visit(grid.positions);
    visit(grid.levels);
    visit(grid.tetrahedra);
    visit(grid.visibility);
    visit(grid.starts);
}

}  // namespace

void takeGeometry(SceneMesh& mesh, SceneMesh&& from) {
    mesh.positions_m = std::move(from.positions_m);
    mesh.normals = std::move(from.normals);
    mesh.uv0 = std::move(from.uv0);
    mesh.uv1 = std::move(from.uv1);
    mesh.triangles = std::move(from.triangles);
    mesh.triangle_materials = std::move(from.triangle_materials);
    mesh.triangle_regions = std::move(from.triangle_regions);
}

std::vector<std::byte> toBytes(const ChartsEntry& entry) {
    ByteWriter out;
    out.put(uint64_t{entry.meshes.size()});
    const auto put = [&](const auto& values) { putAll(out, values); };
    for (const SceneMesh& mesh : entry.meshes) visitMesh(mesh, put);
    out.put(std::array{entry.charts.page_width, entry.charts.page_height, entry.charts.page_count});
    visitUnwrap(entry.charts, put);
    out.put(uint64_t{entry.charts.warnings.size()});
    for (const ChartWarning& warning : entry.charts.warnings) {
        out.put(warning.mesh);
        out.putString(warning.text);
    }
    visitTexels(entry.texels, put);
    return out.take();
}

std::optional<ChartsEntry> chartsFromBytes(std::span<const std::byte> bytes) {
    ByteReader in(bytes);
    ChartsEntry entry;
    const auto get = [&](auto& values) { getAll(in, values); };
    for (auto n = in.get<uint64_t>(); in.fits(n, 1) && n > 0; --n) visitMesh(entry.meshes.emplace_back(), get);
    const auto size = in.get<std::array<uint32_t, 3>>();
    entry.charts.page_width = size[0];
    entry.charts.page_height = size[1];
    entry.charts.page_count = size[2];
    visitUnwrap(entry.charts, get);
    for (auto n = in.get<uint64_t>(); in.fits(n, 1) && n > 0; --n) {
        auto& [mesh, text] = entry.charts.warnings.emplace_back();
        mesh = in.get<uint32_t>();
        text = in.getString();
    }
    visitTexels(entry.texels, get);
    return in.atEnd() ? std::optional(std::move(entry)) : std::nullopt;
}

std::vector<std::byte> toBytes(const GroupLight& group) {
    ByteWriter out;
    out.put(group.bounces);
    putAll(out, group.reports);
    putAll(out, group.door_flux.alone);
    putAll(out, group.door_flux.pairs);
    putRows(out, group.light);
    putRows(out, group.local_light);
    return out.take();
}

std::optional<GroupLight> groupFromBytes(std::span<const std::byte> bytes) {
    ByteReader in(bytes);
    GroupLight group;
    group.bounces = in.get<uint32_t>();
    group.reports = in.getArray<TermReport>();
    group.door_flux.alone = in.getArray<double>();
    group.door_flux.pairs = in.getArray<DoorFlux::Pair>();
    auto light = getRows<ReceiverLight>(in);
    if (!light) return {};
    auto local = getRows<ProbeTermLight>(in);
    if (!local || !in.atEnd()) return {};
    group.light = std::move(*light);
    group.local_light = std::move(*local);
    return group;
}

std::vector<std::byte> toBytes(const BakedGrid& baked) {
    ByteWriter out;
    visitGrid(baked.grid, [&](const auto& values) { putAll(out, values); });
    out.put(baked.grid.start);
    out.put(baked.free_volume_m3);
    putAll(out, baked.errors);
    putRows(out, baked.light);
    return out.take();
}

std::optional<BakedGrid> gridFromBytes(std::span<const std::byte> bytes) {
    ByteReader in(bytes);
    BakedGrid baked;
    visitGrid(baked.grid, [&](auto& values) { getAll(in, values); });
    baked.grid.start = in.get<StartGrid>();
    baked.free_volume_m3 = in.get<double>();
    getAll(in, baked.errors);
    auto light = getRows<ProbeTermLight>(in);
    if (!light || !in.atEnd()) return {};
    baked.light = std::move(*light);
    return baked;
}

std::vector<std::byte> toBytes(std::span<const Sparse<ProbeTermLight>> light) {
    ByteWriter out;
    for (const auto& of_block : light) putRows(out, of_block);
    return out.take();
}

std::optional<std::vector<Sparse<ProbeTermLight>>> siteLightFromBytes(std::span<const std::byte> bytes, size_t blocks) {
    ByteReader in(bytes);
    std::vector<Sparse<ProbeTermLight>> light;
    while (light.size() < blocks) {
        auto of_block = getRows<ProbeTermLight>(in);
        if (!of_block) return {};
        light.push_back(std::move(*of_block));
    }
    return in.atEnd() ? std::optional(std::move(light)) : std::nullopt;
}

std::vector<std::byte> toBytes(const SparseLight& radiance) {
    ByteWriter out;
    putRows(out, radiance);
    return out.take();
}

std::optional<SparseLight> radianceFromBytes(std::span<const std::byte> bytes) {
    ByteReader in(bytes);
    auto light = getRows<TermLight>(in);
    return light && in.atEnd() ? std::move(light) : std::nullopt;
}

}  // namespace dimmer::cook
