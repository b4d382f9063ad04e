#include <pipeline/heat_map.h>

#include <dimmer/cpu_runtime.h>
#include <format/texel.h>
#include <write/pack_writer.h>
#include <write/png_writer.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <vector>

namespace dimmer::cook {
namespace {

// Grey, so that the discs stand out: darker than half, six powers of ten deep.
uint8_t grey(double luminance_lux) {
    const double decades = std::log10(std::max(luminance_lux, 1e-3)) + 3;
    return static_cast<uint8_t>(std::clamp(decades * 20, 0.0, 120.0));
}

std::array<uint8_t, 3> heat(double signed_error) {
    const double t = std::clamp(signed_error / heat_full_error, -1.0, 1.0);
    const auto faded = static_cast<uint8_t>(255 * (1 - std::abs(t)));
    return t < 0 ? std::array<uint8_t, 3>{faded, faded, 255} : std::array<uint8_t, 3>{255, faded, faded};
}

struct Picture {
    int width, height;
    std::vector<uint8_t> rgb;

    void disc(double x, double y, int radius, std::array<uint8_t, 3> colour) {
        const int cx = static_cast<int>(x), cy = static_cast<int>(y);
        for (int j = std::max(0, cy - radius); j <= std::min(height - 1, cy + radius); ++j)
            for (int i = std::max(0, cx - radius); i <= std::min(width - 1, cx + radius); ++i)
                if ((i - cx) * (i - cx) + (j - cy) * (j - cy) <= radius * radius)
                    std::ranges::copy(colour, rgb.begin() + (std::ptrdiff_t{j} * width + i) * 3);
    }
};

// Made when missing, and rid of an earlier run's pictures, the index first.
Expected<void> emptyFolder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error) std::filesystem::remove(folder / heat_map_index, error);
    std::vector<std::filesystem::path> old;
    for (std::filesystem::directory_iterator entry(folder, error); !error && entry != end(entry);
         entry.increment(error))
        if (isHeatMapName(entry->path().filename().native())) old.push_back(entry->path());
    for (const auto& file : old)
        if (!error) std::filesystem::remove(file, error);
    if (error) return fail(ErrorCode::Io, fmt::format("{}: {}", folder.string(), error.message()));
    return {};
}

}  // namespace

std::string heatMapName(uint32_t page) {
    return fmt::format("page_{}.png", page);
}

bool isHeatMapName(std::string_view name) {
    const std::string text(name);
    uint32_t page = 0;
    return name == heat_map_index || (std::sscanf(text.c_str(), "page_%u", &page) == 1 && text == heatMapName(page));
}

Expected<void> writeHeatMaps(const std::filesystem::path& folder, const Pack& pack, const std::string& pack_id,
                             const VerifyReport& report, std::string_view state) {
    if (auto ok = emptyFolder(folder); !ok) return ok;
    CpuRuntime runtime(pack);
    if (auto ok = runtime.apply(state); !ok) return ok;
    runtime.update();
    const size_t texels = size_t{pack.pageWidth()} * pack.pageHeight();
    for (uint32_t page = 0; page < pack.pageCount(); ++page) {
        Picture picture{static_cast<int>(pack.pageWidth()), static_cast<int>(pack.pageHeight()), {}};
        for (uint32_t texel : runtime.irradiancePages().subspan(page * texels, texels)) {
            const auto [r, g, b] = decodeColor(pack.colorFormat(), texel);
            picture.rgb.insert(picture.rgb.end(), 3,
                               grey(static_cast<double>(dimmer::luminance(r, g, b) / pack.exposure())));
        }
        const int radius = std::max(1, picture.width / 256);
        for (size_t i = 0; i < report.points.size(); ++i) {
            if (pack.meshes()[report.points[i].mesh].page != page) continue;
            const LightPair& p = report.surface_pairs[i];
            picture.disc(static_cast<double>(report.points[i].uv[0]) * picture.width,
                         static_cast<double>(report.points[i].uv[1]) * picture.height, radius,
                         heat((p.value_lux - p.reference_lux) / (p.reference_lux + report.floor_lux)));
        }
        const auto file = folder / heatMapName(page);
        const auto png = pngBytes(pack.pageWidth(), pack.pageHeight(), 3, picture.rgb);
        if (!png) return std::unexpected(png.error());
        if (auto ok = writeFileAtomically(file, *png); !ok) return ok;
    }
    const nlohmann::ordered_json index = {{"pack_id", pack_id}, {"state", state}, {"pages", pack.pageCount()}};
    const std::string text = index.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    return writeFileAtomically(folder / heat_map_index, std::as_bytes(std::span(text)));
}

}  // namespace dimmer::cook
