#include <pipeline/sample_points.h>

#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <trace/nearest_surface.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>

namespace dimmer::cook {
namespace {

std::unexpected<Error> bad(const std::string& file, size_t line, std::string_view text) {
    return fail(ErrorCode::BadInput, fmt::format("{}:{}: {}", file == "-" ? "stdin" : file, line, text));
}

// The first six comma-separated numbers of a line.
bool parseLine(std::string_view line, std::array<float, 6>& out) {
    for (size_t i = 0; i < 6; ++i) {
        while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
        const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), out[i]);
        if (error != std::errc() || !std::isfinite(out[i])) return false;
        line.remove_prefix(static_cast<size_t>(end - line.data()));
        while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
        if (i < 5 && (line.empty() || line.front() != ',')) return false;
        if (!line.empty() && line.front() != ',') return false;
        if (!line.empty()) line.remove_prefix(1);
    }
    return true;
}

Expected<std::vector<QueryPoint>> parsePoints(std::istream& in, const std::string& file) {
    std::vector<QueryPoint> points;
    std::string line;
    for (size_t number = 1; std::getline(in, line); ++number) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (number == 1) {
            if (line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // a byte order mark, as spreadsheets write it
            if (!line.starts_with("x,y,z,nx,ny,nz")) return bad(file, 1, "the header must begin x,y,z,nx,ny,nz");
            continue;
        }
        if (line.empty()) continue;
        std::array<float, 6> v{};
        if (!parseLine(line, v)) return bad(file, number, "six finite numbers x,y,z,nx,ny,nz were expected");
        const glm::dvec3 normal(v[3], v[4], v[5]);  // whose squares fit, however long a normal somebody writes
        const double length = glm::length(normal);
        if (!(length > 1e-6)) return bad(file, number, "the normal has no length");
        points.push_back({{v[0], v[1], v[2]}, glm::vec3(normal / length)});
    }
    if (in.bad()) return fail(ErrorCode::Io, fmt::format("{}: the points cannot be read", file));
    if (points.empty())
        return bad(file, 1, "there are no points: a header x,y,z,nx,ny,nz and a line per point were expected");
    return points;
}

}  // namespace

Expected<std::vector<QueryPoint>> readPoints(const std::string& file) {
    if (file == "-") return parsePoints(std::cin, file);
    std::ifstream in(file);
    if (!in) return fail(ErrorCode::Io, fmt::format("{}: the points cannot be opened", file));
    return parsePoints(in, file);
}

std::vector<std::optional<std::array<float, 3>>> sampleSurface(const Pack& pack, const LightPages& pages,
                                                               std::span<const QueryPoint> points) {
    const NearestSurface surface(pack.meshes(), pack.pageWidth(), pack.pageHeight());
    std::vector<std::optional<std::array<float, 3>>> out;
    for (const QueryPoint& q : points) {
        const auto place = surface.find(q.position_m, q.normal, surface_reach_m);
        if (!place) {
            out.emplace_back();
            continue;
        }
        const std::array<float, 3> normal = {glm::dot(q.normal, place->frame.tangent),
                                             glm::dot(q.normal, place->frame.bitangent),
                                             glm::dot(q.normal, place->frame.normal)};
        out.push_back(sampleLightmap(pack, pages.irradiance, pages.direction, pack.meshes()[place->mesh].page,
                                     place->uv, normal));
    }
    return out;
}

std::vector<std::optional<std::array<float, 3>>> sampleGrid(const Pack& pack, const LightPages& pages,
                                                            std::span<const QueryPoint> points) {
    const GridSampler grid(pack, pages.probes);
    std::vector<std::optional<std::array<float, 3>>> out;
    for (const auto& [p, n] : points) out.emplace_back(grid.sample({p.x, p.y, p.z}, {n.x, n.y, n.z}));
    return out;
}

Expected<void> writeSamples(const std::string& file, std::span<const QueryPoint> points,
                            std::span<const std::optional<std::array<float, 3>>> samples) {
    std::string text = "x,y,z,nx,ny,nz,Er,Eg,Eb\n";
    for (size_t i = 0; i < points.size(); ++i) {
        const auto& [p, n] = points[i];
        text += fmt::format("{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z);
        text += samples[i] ? fmt::format(",{},{},{}\n", (*samples[i])[0], (*samples[i])[1], (*samples[i])[2])
                           : ",nan,nan,nan\n";
    }
    if (file != "-") return writeFileAtomically(file, std::as_bytes(std::span(text)));
    fmt::print("{}", text);
    return {};
}

}  // namespace dimmer::cook
