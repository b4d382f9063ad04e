#include <pipeline/export_pack.h>

#include <format/texel.h>
#include <pipeline/contribution_text.h>
#include <pipeline/profile.h>
#include <write/exr_writer.h>
#include <write/pack_writer.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <set>

namespace dimmer::cook {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* index_name = "index.json";

std::string pictureName(std::string_view layer, uint32_t page) {
    return fmt::format("{}_page_{}.exr", layer, page);
}

std::string contributionName(uint32_t contribution) {
    return fmt::format("contribution_{:03}", contribution);
}

Expected<void> removeFile(const std::filesystem::path& file) {
    std::error_code problem;
    std::filesystem::remove(file, problem);
    if (!problem) return {};
    return fail(ErrorCode::Io, fmt::format("{}: it cannot be removed: {}", file.string(), problem.message()));
}

// The index first: without it the rest is no export. What an interrupted one left goes, too, and has none.
Expected<void> removeExport(const std::filesystem::path& folder) {
    if (auto ok = removeFile(folder / index_name); !ok) return ok;
    std::vector<std::filesystem::path> pictures;
    std::error_code problem;
    for (std::filesystem::directory_iterator entry(folder, problem); !problem && entry != end(entry);
         entry.increment(problem))
        if (isExportedName(entry->path().filename().native())) pictures.push_back(entry->path());
    if (problem)
        return fail(ErrorCode::Io, fmt::format("{}: it cannot be listed: {}", folder.string(), problem.message()));
    for (const std::filesystem::path& picture : pictures)
        if (auto ok = removeFile(picture); !ok) return ok;
    return {};
}

// Records of one page, where they lie.
struct Layer {
    uint32_t x0 = UINT32_MAX, y0 = UINT32_MAX, x1 = 0, y1 = 0;  // inclusive
    std::vector<std::pair<uint32_t, TexelRecord>> records;      // TexelAddress

    void add(uint32_t address, TexelRecord record) {
        const uint32_t x = TexelAddress::x(address), y = TexelAddress::y(address);
        x0 = std::min(x0, x), x1 = std::max(x1, x);
        y0 = std::min(y0, y), y1 = std::max(y1, y);
        records.emplace_back(address, record);
    }
};

std::vector<Layer> baseLayers(const PackData& d) {
    std::vector<Layer> layers(d.page_count);
    size_t texel = 0;
    for (uint32_t page = 0; page < d.page_count; ++page)
        for (uint32_t y = 0; y < d.page_height; ++y)
            for (uint32_t x = 0; x < d.page_width; ++x)
                layers[page].add(TexelAddress::pack(page, x, y), d.base_pages[texel++]);
    return layers;
}

std::vector<Layer> layersOf(const PackData& d, uint32_t contribution) {
    std::vector<Layer> layers(d.page_count);
    for (const Cluster& cluster : d.clusters)
        for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
            if (d.terms[t].contribution != contribution) continue;
            for (uint32_t i = 0; i < cluster.receiver_count; ++i) {
                const uint32_t address = d.addresses[cluster.first_receiver + i];
                layers[TexelAddress::page(address)].add(address, d.payload[d.terms[t].first_record + i]);
            }
        }
    return layers;
}

ExrPicture pictureOf(const PackData& d, const Layer& layer) {
    ExrPicture picture{.width = d.page_width,
                       .height = d.page_height,
                       .x = layer.x0,
                       .y = layer.y0,
                       .window_width = layer.x1 - layer.x0 + 1,
                       .window_height = layer.y1 - layer.y0 + 1,
                       .channels = {}};
    const size_t texels = size_t{picture.window_width} * picture.window_height;
    for (const char* name : {"R", "G", "B", "direction.r", "direction.x", "direction.y"})
        picture.channels.push_back({name, std::vector<float>(texels, 0.0f)});
    std::ranges::fill(picture.channels[3].values, 1.0f);  // no light comes from nowhere in particular
    for (const auto& [address, stored] : layer.records) {
        const TexelRecord record = canonical(d.color_format, stored);
        const auto [r, g, b] = decodeColor(d.color_format, record.irradiance);
        const Highlight highlight = decodeDirection(record.direction);
        const size_t texel =
            size_t{TexelAddress::y(address) - layer.y0} * picture.window_width + (TexelAddress::x(address) - layer.x0);
        // The exposure is a power of two: these are the stored values exactly.
        const std::array values = {r / d.exposure,    g / d.exposure, b / d.exposure,
                                   highlight.ambient, highlight.bx,   highlight.by};
        for (size_t c = 0; c < values.size(); ++c) picture.channels[c].values[texel] = values[c];
    }
    return picture;
}

class Exporter {
   public:
    Exporter(const PackData& data, const std::filesystem::path& folder) : d_(data), folder_(folder) {}

    // The pictures of pages that are not empty, as the index lists them.
    Expected<Json> write(const std::string& name, const std::vector<Layer>& layers) {
        Json list = Json::array();
        for (uint32_t page = 0; page < layers.size(); ++page) {
            const Layer& layer = layers[page];
            if (layer.records.empty()) continue;
            const ExrPicture picture = pictureOf(d_, layer);
            const auto bytes = exrBytes(picture);
            if (!bytes) return std::unexpected(bytes.error());
            const std::string file = pictureName(name, page);
            if (auto ok = put(file, *bytes); !ok) return std::unexpected(ok.error());
            list.push_back({{"page", page},
                            {"file", file},
                            {"window", {picture.x, picture.y, picture.window_width, picture.window_height}}});
        }
        return list;
    }

    Expected<void> put(const std::string& file, std::span<const std::byte> bytes) {
        ++stats.files;
        stats.bytes += bytes.size();
        return writeFileAtomically(folder_ / file, bytes);
    }

    ExportStats stats;

   private:
    const PackData& d_;
    const std::filesystem::path& folder_;
};

Json elementsOf(const PackData& d) {
    Json list = Json::array();
    for (const Element& e : d.elements)
        list.push_back(
            {{"name", e.name}, {"kind", e.kind == ElementKind::Door ? "door" : "set"}, {"max_weight", e.max_weight}});
    return list;
}

// Which page a node's lightmap UVs mean; `cook --write-level` writes these UVs.
Json nodesOf(const PackData& d) {
    std::set<std::pair<std::string, uint32_t>> pages;
    for (const Mesh& m : d.meshes) pages.emplace(m.node, m.page);
    Json list = Json::array();
    for (const auto& [node, page] : pages) list.push_back({{"node", node}, {"page", page}});
    return list;
}

}  // namespace

bool isExportedName(std::string_view name) {
    const std::string text(name);
    uint32_t contribution = 0, page = 0;
    if (std::sscanf(text.c_str(), "base_page_%u", &page) == 1) return text == pictureName("base", page);
    if (std::sscanf(text.c_str(), "contribution_%u_page_%u", &contribution, &page) == 2)
        return text == pictureName(contributionName(contribution), page);
    return text == index_name;
}

Expected<ExportStats> exportPack(const Pack& pack, const std::filesystem::path& folder, Progress& progress) {
    const PackData& d = pack.data();
    std::error_code problem;
    std::filesystem::create_directories(folder, problem);
    if (problem)
        return fail(ErrorCode::Io,
                    fmt::format("{}: the folder cannot be made: {}", folder.string(), problem.message()));
    if (auto ok = removeExport(folder); !ok) return std::unexpected(ok.error());
    progress.stage("export", d.contributions.size() + 1);
    Exporter exporter(d, folder);
    Json index;
    index["version"] = export_version;
    index["unit"] = "lux";
    index["model"] = nameOf(d.direction_model);
    index["pages"] = {{"count", d.page_count}, {"width", d.page_width}, {"height", d.page_height}};
    index["elements"] = elementsOf(d);
    auto base = exporter.write("base", baseLayers(d));
    if (!base) return std::unexpected(base.error());
    index["base"] = std::move(*base);
    progress.advance(1);
    index["contributions"] = Json::array();
    for (uint32_t k = 0; k < d.contributions.size(); ++k) {
        const Contribution& c = d.contributions[k];
        auto pictures = exporter.write(contributionName(k), layersOf(d, k));
        if (!pictures) return std::unexpected(pictures.error());
        index["contributions"].push_back({{"light", lightName(d, c)},
                                          {"always_on", !c.light_set.has_value()},
                                          {"doors_open", elementNames(d, c.doors_open)},
                                          {"doors_closed", elementNames(d, c.doors_closed)},
                                          {"receivers", c.receivers},
                                          {"pictures", std::move(*pictures)}});
        progress.advance(1);
    }
    index["nodes"] = nodesOf(d);
    const std::string text = index.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    if (auto ok = exporter.put(index_name, std::as_bytes(std::span(text))); !ok) return std::unexpected(ok.error());
    progress.finish();
    return exporter.stats;
}

}  // namespace dimmer::cook
