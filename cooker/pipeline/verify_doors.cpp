#include <pipeline/verify_doors.h>

#include <bake/sampling.h>
#include <pipeline/draw_places.h>
#include <pipeline/measured_light.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr uint32_t candidates_per_point = 64, candidates_max = 1u << 20;
constexpr double near_share = 0.1;
constexpr float near_m = 2;  // from the leaf, half of what is drawn there at the leaf
// The first look says which lights matter. Few paths lead through a door: where none of so few differs, that says
// little.
constexpr uint32_t first_paths = 256, least_paths = 2048;
// Places are drawn by the change, so that each counts by its own relative error: its noise is bounded relative to it.
constexpr double change_relative = 0.04, light_relative = 0.01;
constexpr double negligible = 0.01;  // of what the door does to all light

using Light = DoorReport::Light;

// What the pack says of a light at every candidate.
struct PackedLight {
    std::vector<double> open_lux, closed_lux;
    std::vector<double> changeLux() const {
        std::vector<double> out(open_lux.size());
        std::ranges::transform(open_lux, closed_lux, out.begin(), std::minus{});
        return out;
    }
};

// The level with one door closed, and with it open.
struct Opening {
    Opening(const Scene& level, const RayScene& as_it_stands, const ReferenceState& closed_state,
            const ReferenceState& open_state)
        : scene(level),
          closed(as_it_stands),
          closed_doors(closed_state.door_open),
          open_doors(open_state.door_open),
          open_scene(sceneInState(level, open_state)),
          open(open_scene) {}

    const Scene& scene;
    const RayScene& closed;
    std::vector<bool> closed_doors, open_doors;
    Scene open_scene;
    RayScene open;

    std::vector<VerifyPoint> candidates;
    std::vector<double> nearness;  // 1 on average
    double all_change_lux = 0;     // summed over candidates, by the reference
};

std::string stateText(const Scene& scene, std::span<const glm::vec3> set_weights, const std::vector<bool>& door_open) {
    std::string text = "all=0";
    for (size_t s = 0; s < set_weights.size(); ++s)
        if (const glm::vec3 w = set_weights[s]; w != glm::vec3(0))
            text += fmt::format(",{}={}/{}/{}", scene.light_sets[s].name, w.x, w.y, w.z);
    for (size_t d = 0; d < door_open.size(); ++d)
        if (door_open[d]) text += fmt::format(",door:{}=1", scene.doors[d].name);
    return text;
}

Expected<PackedLight> packed(const Opening& opening, const Pack& pack, std::span<const glm::vec3> set_weights) {
    const auto light = [&](const std::vector<bool>& doors) {
        return packLight(pack, opening.candidates, false, stateText(opening.scene, set_weights, doors));
    };
    auto open = light(opening.open_doors);
    if (!open) return std::unexpected(open.error());
    auto closed = light(opening.closed_doors);
    if (!closed) return std::unexpected(closed.error());
    return PackedLight{std::move(*open), std::move(*closed)};
}

std::vector<double> densityOf(std::span<const double> change_lux, std::span<const double> nearness) {
    double mean = 0;
    for (double c : change_lux) mean += std::abs(c) / static_cast<double>(change_lux.size());
    std::vector<double> out(nearness.begin(), nearness.end());
    for (size_t i = 0; mean > 0 && i < out.size(); ++i)
        out[i] = std::abs(change_lux[i]) + near_share * mean * nearness[i];
    return out;
}

// Pairs that count by the area they stand for: shares of sums are the same whatever their unit.
std::vector<LightPair> weighted(std::vector<LightPair> pairs, std::span<const double> weights) {
    for (size_t i = 0; i < pairs.size(); ++i)
        pairs[i] = {weights[i] * pairs[i].value_lux, weights[i] * pairs[i].reference_lux,
                    weights[i] * pairs[i].reference_error_lux};
    return pairs;
}

// By the reference, surely: place by place, or all of them together.
double surelyChanged(std::span<const LightPair> pairs) {
    double each = 0, sum = 0, variance = 0;
    for (const LightPair& p : pairs) {
        each += std::max(0.0, std::abs(p.reference_lux) - significant_errors * p.reference_error_lux);
        sum += p.reference_lux;
        variance += p.reference_error_lux * p.reference_error_lux;
    }
    return std::max(each, std::abs(sum) - significant_errors * std::sqrt(variance));
}

double sumOfMagnitudes(std::span<const double> values) {
    double sum = 0;
    for (double v : values) sum += std::abs(v);
    return sum;
}

template <class T>
std::vector<T> picked(std::span<const T> from, std::span<const size_t> indices) {
    std::vector<T> out;
    for (size_t i : indices) out.push_back(from[i]);
    return out;
}

// Empty where the light is a negligible part of what the door does.
std::optional<DoorReport> reportOf(Opening& opening, const PackedLight& light, Light kind, const ReferenceOptions& of,
                                   const VerifyOptions& options, Progress& progress) {
    const std::vector<double> change = light.changeLux();
    const DrawnPlaces drawn = drawPlaces(densityOf(change, opening.nearness), options.points, options.seed);
    const auto points = picked(std::span<const VerifyPoint>(opening.candidates), drawn.index);
    const auto where = queries(points, false);
    const auto values = picked(std::span<const double>(change), drawn.index);
    const ReferenceTracer closed(opening.closed, of), open(opening.open, of);
    std::vector<ReferenceEstimate> estimates(where.size());
    const RefinePoint refine = [&](size_t i, ReferenceEstimate& estimate, uint32_t paths) {
        open.refineDifference(estimate, closed, where[i], paths);
    };
    const auto atMost = [&](uint32_t paths) { return std::min(paths, options.paths_max); };
    refineEach(refine, {.paths_min = atMost(first_paths), .paths_max = atMost(first_paths)}, estimates, progress);
    const auto first = weighted(pairsOf(values, estimates), drawn.weight);
    const double least_lux = negligible * opening.all_change_lux;
    if (kind != Light::All && surelyChanged(first) <= least_lux && sumOfMagnitudes(change) <= least_lux)
        return std::nullopt;
    double mean_lux = 0;
    for (const LightPair& p : first)
        mean_lux += std::abs(p.reference_lux) / static_cast<double>(opening.candidates.size());
    const double more = static_cast<double>(options.paths_max) / VerifyOptions{}.paths_max;
    refineEach(refine,
               {.paths_min = atMost(least_paths),
                .paths_max = options.paths_max,
                .relative = change_relative / std::sqrt(more),
                .floor_lux = near_share * mean_lux},
               estimates, progress);
    DoorReport report;
    report.light = kind;
    report.effect = effectError(weighted(pairsOf(values, estimates), drawn.weight));
    if (kind != Light::All) return report;
    opening.all_change_lux = report.effect.reference_sum_lux;
    std::vector<ReferenceEstimate> lit(where.size());
    refineAll(open, where,
              {.paths_min = atMost(first_paths),
               .paths_max = options.paths_max,
               .relative = light_relative / std::sqrt(more)},
              lit, progress);
    report.light_there = effectError(pairsOf(picked(std::span<const double>(light.open_lux), drawn.index), lit));
    return report;
}

// Where the door's leaves stand when closed; empty without any.
std::optional<glm::vec3> leafCentre(const RayScene& closed, size_t door) {
    glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
    for (uint32_t t = 0; t < closed.triangles().size(); ++t)
        if (closed.scene().meshes[closed.triangles()[t].mesh].door == door)
            for (uint32_t c = 0; c < 3; ++c) {
                low = glm::min(low, closed.corner(t, c));
                high = glm::max(high, closed.corner(t, c));
            }
    if (low.x > high.x) return std::nullopt;
    return (low + high) * 0.5f;
}

// Places that somebody can see whether the door is closed or open; none on the leaf, which moves.
void choosePlaces(Opening& opening, const Pack& pack, const VerifyOptions& options, size_t door) {
    const uint64_t count = std::min<uint64_t>(candidates_max, uint64_t{candidates_per_point} * options.points);
    opening.candidates =
        choosePoints(pack, opening.open, opening.open_doors, static_cast<uint32_t>(count), hash(options.seed, 0xd00cu));
    std::erase_if(opening.candidates,
                  [&](const VerifyPoint& p) { return hidden(opening.closed, p.position_m, p.frame, 0); });
    const auto leaf = leafCentre(opening.closed, door);
    double sum = 0;
    for (const VerifyPoint& p : opening.candidates) {
        const float distance_m = leaf ? glm::distance(p.position_m, *leaf) : 0;
        opening.nearness.push_back(1 / (1 + static_cast<double>(distance_m * distance_m / (near_m * near_m))));
        sum += opening.nearness.back();
    }
    for (double& n : opening.nearness) n *= static_cast<double>(opening.nearness.size()) / sum;
}

Expected<void> verifyDoor(Opening& opening, const Pack& pack, const VerifyOptions& options, const ReferenceState& state,
                          const std::string& name, Progress& progress, std::vector<DoorReport>& out) {
    const std::vector<glm::vec3> dark(state.set_weights.size(), glm::vec3(0));
    const auto add = [&](Light kind, const PackedLight& light, std::span<const glm::vec3> weights,
                         const std::string& light_set) {
        const ReferenceOptions of{.seed = options.seed,
                                  .set_weights = {weights.begin(), weights.end()},
                                  .always_weight = kind == Light::Set ? 0.0f : 1.0f};
        auto report = reportOf(opening, light, kind, of, options, progress);
        if (!report) return;
        report->door = name;
        report->light_set = light_set;
        out.push_back(std::move(*report));
    };
    const auto all = packed(opening, pack, state.set_weights);
    if (!all) return std::unexpected(all.error());
    add(Light::All, *all, state.set_weights, "");
    if (dark.empty()) return {};
    const auto always = packed(opening, pack, dark);
    if (!always) return std::unexpected(always.error());
    add(Light::AlwaysOn, *always, dark, "");
    for (size_t s = 0; s < dark.size(); ++s) {
        const SceneLightSet& set = opening.scene.light_sets[s];
        std::vector<glm::vec3> alone = dark;
        alone[s] = glm::vec3(std::min(1.0f, set.max_weight));
        auto light = packed(opening, pack, alone);
        if (!light) return std::unexpected(light.error());
        std::ranges::transform(light->open_lux, always->open_lux, light->open_lux.begin(), std::minus{});
        std::ranges::transform(light->closed_lux, always->closed_lux, light->closed_lux.begin(), std::minus{});
        add(Light::Set, *light, alone, set.name);
    }
    return {};
}

}  // namespace

Expected<std::vector<DoorReport>> verifyDoors(const Scene& scene, const Pack& pack, const VerifyOptions& options,
                                              const ReferenceState& state, Progress& progress) {
    const auto doors = static_cast<size_t>(std::ranges::count(state.door_open, false));
    progress.stage("doors", doors * (2 * (scene.light_sets.size() + 2) + 1) * options.points);
    const Scene closed_scene = sceneInState(scene, state);
    const RayScene closed(closed_scene);
    std::vector<DoorReport> out;
    for (size_t d = 0; d < scene.doors.size(); ++d) {
        if (state.door_open[d]) continue;
        ReferenceState open_state = state;
        open_state.door_open[d] = true;
        Opening opening(scene, closed, state, open_state);
        choosePlaces(opening, pack, options, d);
        if (auto ok = verifyDoor(opening, pack, options, state, scene.doors[d].name, progress, out); !ok)
            return std::unexpected(ok.error());
    }
    return out;
}

}  // namespace dimmer::cook
