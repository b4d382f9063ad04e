#include <app/command.h>
#include <app/files.h>
#include <pipeline/contribution_text.h>
#include <pipeline/explain.h>
#include <pipeline/human_bytes.h>
#include <pipeline/sample_points.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

namespace dimmer::cook {
namespace {

struct ExplainArguments {
    std::string pack, state, from, json;
    std::vector<float> point, normal;
};

// Of the receivers that light the place: texels or probes.
size_t recordBytes(const Explanation& e) {
    return e.surface ? sizeof(TexelRecord) : sizeof(ProbeRecord);
}
uint64_t receiversInAll(const PackData& d, const Explanation& e, uint32_t contribution) {
    if (e.surface) return d.contributions[contribution].receivers;
    return d.probes.record_counts.empty() ? 0 : d.probes.record_counts[contribution];
}

std::string weightText(const Weight& w) {
    return w.r == w.g && w.g == w.b ? fmt::format("{:.3g}", w.r) : fmt::format("{:.3g}/{:.3g}/{:.3g}", w.r, w.g, w.b);
}

std::string luxText(const std::array<float, 3>& lux) {
    return fmt::format("{:.4g} {:.4g} {:.4g}", lux[0], lux[1], lux[2]);
}

std::string receiverText(const ReceiverView& view, const ReceiverPlace& at) {
    if (!at.cluster) return "no contribution is stored there: it never changes";
    const Cluster& c = view.clusters[*at.cluster];
    return fmt::format("cluster {} of {} receivers with {} contributions, {} of records; batch {} of {} receivers",
                       *at.cluster, c.receiver_count, c.term_count,
                       humanBytes((uint64_t{c.term_count} + 1) * c.receiver_count * view.record_bytes), *at.batch,
                       view.batches[*at.batch].receiver_count);
}

// Metres from a point to the grid's box: outside of it the light is that of the box's nearest point.
double outsideOf(const StartGrid& box, const std::vector<float>& point) {
    std::array<double, 3> beyond;  // whose squares do not overflow
    for (size_t i = 0; i < 3; ++i)
        beyond[i] = std::max({double{box.min_m[i]} - double{point[i]}, double{point[i]} - double{box.max_m[i]}, 0.0});
    return std::hypot(beyond[0], beyond[1], beyond[2]);
}

void printPlace(const PackData& d, const Explanation& e, const ExplainArguments& a) {
    if (e.surface) {
        const SurfacePlace& place = e.surface->place;
        const Mesh& mesh = d.meshes[place.mesh];
        const glm::vec3 n = place.frame.normal;
        fmt::print("{}: page {}, texel {}, {}; {:.1f} cm from the point, facing {:.2f},{:.2f},{:.2f}\n{}\n", mesh.node,
                   mesh.page, e.surface->texel[0], e.surface->texel[1], 100 * static_cast<double>(place.distance_m),
                   n.x, n.y, n.z, receiverText(d.texelView(), e.surface->receiver));
        return;
    }
    fmt::print("in the air: {}\n", a.normal.empty() ? "the mean of the irradiance over all normals"
                                                    : fmt::format("irradiance on {}", fmt::join(a.normal, ",")));
    if (const double outside_m = outsideOf(d.probes.global.start, a.point); outside_m > 0)
        fmt::print("{:.4g} m outside of the level; it gets the light of the nearest place inside\n", outside_m);
    for (const ExplainedProbe& probe : e.probes) {
        const ProbePosition& p = d.probes.global.positions[probe.number];
        fmt::print("probe {} at {:.2f},{:.2f},{:.2f}: {:.1f} % of the light; {}\n", probe.number, p.x_m, p.y_m, p.z_m,
                   100 * static_cast<double>(probe.share), receiverText(d.probes.view(), probe.receiver));
    }
}

// Those that light the place, the brightest first.
std::vector<const ExplainedContribution*> byShare(const Explanation& e) {
    std::vector<const ExplainedContribution*> order;
    for (const ExplainedContribution& c : e.contributions)
        if (c.records > 0 || c.full_lux != std::array<float, 3>{}) order.push_back(&c);
    std::ranges::stable_sort(order, [](auto* a, auto* b) { return a->share > b->share; });
    return order;
}

uint64_t baseBytes(const Explanation& e) {
    return recordBytes(e) * (e.surface ? 1 : e.probes.size());
}

void printContributions(const PackData& d, const Explanation& e) {
    fmt::print("\n{:<40} {:>16} {:>26} {:>8} {:>6} {:>12} {:>10} {:>8}\n", "contribution", "weight", "lux (r g b)",
               "share", "bytes", "receivers", "in all", "dropped");
    fmt::print("{:<40} {:>16} {:>26} {:>6.2f} % {:>6}\n", "base", 1, luxText(e.base_lux), 100 * e.base_share,
               baseBytes(e));
    for (const ExplainedContribution* c : byShare(e)) {
        const Contribution& of = d.contributions[c->contribution];
        const uint64_t in_all = receiversInAll(d, e, c->contribution);
        fmt::print("{:<40} {:>16} {:>26} {:>6.2f} % {:>6} {:>12} {:>10} {:>6.2f} %\n", describe(d, of),
                   weightText(c->weight), luxText(c->lux), 100 * c->share, c->records * recordBytes(e), in_all,
                   humanBytes(in_all * recordBytes(e)), 100 * static_cast<double>(of.energy_dropped));
    }
    fmt::print("{:<40} {:>16} {:>26}\n", e.surface ? "the pages" : "the probes", "", luxText(e.lux));
}

// What is not stored at the place: it reaches it below the threshold, or not at all.
void printAbsent(const PackData& d, const Explanation& e) {
    std::vector<std::string> absent;
    for (const ExplainedContribution& c : e.contributions)
        if (c.records == 0)
            absent.push_back(fmt::format("{} ({:.2f} %)", describe(d, d.contributions[c.contribution]),
                                         100 * static_cast<double>(d.contributions[c.contribution].energy_dropped)));
    if (absent.empty()) return;
    fmt::print(
        "\nnot stored at the {}, being below the threshold there or no light at all (in brackets what the "
        "threshold dropped on all surfaces):\n  {}\n",
        e.surface ? "texel" : "probes", fmt::join(absent, "\n  "));
}

void putReceiver(nlohmann::ordered_json& j, const ReceiverView& view, const ReceiverPlace& at) {
    j["cluster"] = nullptr;
    j["batch"] = nullptr;
    if (!at.cluster) return;
    const Cluster& c = view.clusters[*at.cluster];
    j["cluster"] = {{"index", *at.cluster}, {"receivers", c.receiver_count}, {"contributions", c.term_count}};
    j["batch"] = {{"index", *at.batch}, {"receivers", view.batches[*at.batch].receiver_count}};
}

nlohmann::ordered_json toJson(const PackData& d, const Explanation& e, const ExplainArguments& a) {
    nlohmann::ordered_json j;
    j["point"] = a.point;
    j["state"] = a.state;
    j["from"] = e.surface ? "surface" : "grid";
    j["normal"] = a.normal.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(a.normal);
    if (e.surface) {
        const SurfacePlace& place = e.surface->place;
        const Mesh& mesh = d.meshes[place.mesh];
        const glm::vec3 n = place.frame.normal;
        j["place"] = {{"node", mesh.node}, {"page", mesh.page},         {"texel", e.surface->texel},
                      {"uv", place.uv},    {"normal", {n.x, n.y, n.z}}, {"distance_m", place.distance_m}};
        putReceiver(j, d.texelView(), e.surface->receiver);
    } else {
        j["outside_m"] = outsideOf(d.probes.global.start, a.point);
        j["probes"] = nlohmann::ordered_json::array();
        for (const ExplainedProbe& probe : e.probes) {
            const ProbePosition& p = d.probes.global.positions[probe.number];
            j["probes"].push_back(
                {{"number", probe.number}, {"position_m", {p.x_m, p.y_m, p.z_m}}, {"share", probe.share}});
            putReceiver(j["probes"].back(), d.probes.view(), probe.receiver);
        }
    }
    j["lux"] = e.lux;
    j["base"] = {{"lux", e.base_lux}, {"share", e.base_share}, {"bytes", baseBytes(e)}};
    j["contributions"] = nlohmann::ordered_json::array();
    for (const ExplainedContribution& c : e.contributions) {
        const Contribution& of = d.contributions[c.contribution];
        const uint64_t in_all = receiversInAll(d, e, c.contribution);
        j["contributions"].push_back({{"light", lightName(d, of)},
                                      {"doors_open", elementNames(d, of.doors_open)},
                                      {"doors_closed", elementNames(d, of.doors_closed)},
                                      {"weight", {c.weight.r, c.weight.g, c.weight.b}},
                                      {"lux", c.lux},
                                      {"lux_at_weight_1", c.full_lux},
                                      {"share", c.share},
                                      {"stored", c.records > 0},
                                      {"bytes", c.records * recordBytes(e)},
                                      {"receivers_in_all", in_all},
                                      {"bytes_in_all", in_all * recordBytes(e)},
                                      {"energy_dropped", of.energy_dropped}});
    }
    return j;
}

int run(const ExplainArguments& a) {
    if (auto ok = checkFiles({{"PACK", a.pack}}, {printed("--json", a.json)}); !ok) return reportError(ok.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    const auto finite = [](float v) { return std::isfinite(v); };
    if (!std::ranges::all_of(a.point, finite) || !std::ranges::all_of(a.normal, finite))
        return reportError({ErrorCode::InvalidArgument, "--point and --normal take three finite numbers each"});
    std::optional<glm::vec3> normal;
    if (!a.normal.empty()) {
        const glm::dvec3 n(a.normal[0], a.normal[1], a.normal[2]);  // whose squares do not overflow
        if (!(glm::length(n) > 0)) return reportError({ErrorCode::InvalidArgument, "--normal has no length"});
        normal = glm::vec3(glm::normalize(n));
    }
    const ExplainFrom from = a.from == "surface" ? ExplainFrom::Surface
                             : a.from == "grid"  ? ExplainFrom::Grid
                                                 : ExplainFrom::Nearest;
    const auto e = explain(*pack, {a.point[0], a.point[1], a.point[2]}, normal, a.state, from);
    if (!e) return reportError(e.error());
    if (!a.json.empty())
        if (auto ok = writeJson(toJson(pack->data(), *e, a), a.json); !ok) return reportError(ok.error());
    if (a.json == "-") return exit_done;
    printPlace(pack->data(), *e, a);
    printContributions(pack->data(), *e);
    printAbsent(pack->data(), *e);
    return exit_done;
}

}  // namespace

void addExplainCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<ExplainArguments>();
    auto* c = app.add_subcommand("explain", "What lights a place, and what that costs");
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("--point", a->point,
                  "x,y,z in metres, glTF axes; the nearest lightmapped surface within 10 cm counts, or, in the "
                  "air, the global grid's probes around")
        ->required()
        ->delimiter(',')
        ->expected(3);
    c->add_option("--normal", a->normal,
                  "x,y,z: light on this normal, from a surface that faces along it; default: the "
                  "surface's own; in the air the mean over all")
        ->delimiter(',')
        ->expected(3);
    c->add_option("--from", a->from,
                  "surface or grid, whatever is near; default: a surface within 10 cm, else the grid")
        ->check(CLI::IsMember({"surface", "grid"}));
    c->add_option("--state", a->state,
                  "weights, e.g. \"hall=0.5,alarm=1/0.2/0.2,door:front=1\"; what is not named: sets 1 (their "
                  "maximum where that is less), doors 0");
    c->add_option("--json", a->json, "write the same as JSON; - for stdout, in the table's place");
    c->footer(
        "Irradiance in lux of every contribution at its weight, its share of the luminance, the bytes of its record "
        "at\n"
        "the texel or the probes around, its receivers and bytes in the whole level, and the share of its energy that "
        "the threshold\n"
        "dropped on surfaces. Neighbouring texels take part by filtering, as in a shader.\n"
        "Example: dimmer explain house.dimmer --point 3,0,3 --state \"alarm=0.5,door:front=1\"");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
