#include <pipeline/verify_doors.h>

#include <bake/sampling.h>
#include <pipeline/measured_light.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

constexpr uint32_t candidates_per_point = 64;
constexpr double even_share = 0.1;
constexpr uint32_t first_paths = 256;
// Places are drawn by the change, so that each counts by its own relative error: its noise is bounded relative to it.
constexpr double change_relative = 0.04, light_relative = 0.01;
constexpr double negligible = 0.001;  // of a light's sum over the surfaces

// Some of the light, of which a door changes something.
struct Light {
    std::string name;
    std::vector<glm::vec3> set_weights;
    bool always_on = true;
};

std::vector<Light> lightsOf(const Scene& scene, const ReferenceState& state) {
    const std::vector<glm::vec3> dark(scene.light_sets.size(), glm::vec3(0));
    std::vector<Light> out = {{"all", state.set_weights, true}, {"always on", dark, true}};
    for (size_t s = 0; s < scene.light_sets.size(); ++s) {
        out.push_back({scene.light_sets[s].name, dark, false});
        out.back().set_weights[s] = glm::vec3(std::min(1.0f, scene.light_sets[s].max_weight));
    }
    return out;
}

std::string stateText(const Scene& scene, std::span<const glm::vec3> set_weights, const std::vector<bool>& door_open) {
    std::string text = "all=0";
    for (size_t s = 0; s < set_weights.size(); ++s)
        if (const glm::vec3 w = set_weights[s]; w != glm::vec3(0))
            text += fmt::format(",{}={}/{}/{}", scene.light_sets[s].name, w.x, w.y, w.z);
    for (size_t d = 0; d < door_open.size(); ++d)
        if (door_open[d]) text += fmt::format(",door:{}=1", scene.doors[d].name);
    return text;
}

ReferenceState opened(ReferenceState state, size_t door) {
    state.door_open[door] = true;
    return state;
}

// The level with one door closed, and with it open.
struct Opening {
    Opening(const Scene& level, const ReferenceState& as_it_stands, size_t door)
        : scene(level),
          closed_doors(as_it_stands.door_open),
          open_doors(opened(as_it_stands, door).door_open),
          closed_scene(sceneInState(level, as_it_stands)),
          open_scene(sceneInState(level, opened(as_it_stands, door))),
          closed(closed_scene),
          open(open_scene) {}

    const Scene& scene;
    std::vector<bool> closed_doors, open_doors;
    Scene closed_scene, open_scene;
    RayScene closed, open;
};

// What the pack says of a light, lux at every point.
Expected<std::vector<double>> packed(const Opening& opening, const Pack& pack, std::span<const VerifyPoint> points,
                                     const Light& light, const std::vector<bool>& doors) {
    auto all = packLight(pack, points, false, stateText(opening.scene, light.set_weights, doors));
    if (!all || light.always_on) return all;
    const auto rest = packLight(pack, points, false, stateText(opening.scene, {}, doors));
    if (!rest) return std::unexpected(rest.error());
    std::ranges::transform(*all, *rest, all->begin(), std::minus{});
    return all;
}

// Indices, each once, and how many candidates it stands for.
struct Drawn {
    std::vector<size_t> index;
    std::vector<double> weight;
};

Drawn draw(std::span<const double> change, uint32_t count, uint32_t seed) {
    double mean = 0;
    for (double c : change) mean += std::abs(c) / static_cast<double>(change.size());
    const auto density = [&](size_t i) { return mean > 0 ? std::abs(change[i]) + even_share * mean : 1; };
    double sum = 0;
    for (size_t i = 0; i < change.size(); ++i) sum += density(i);
    const double step = sum / count;
    double target = step * static_cast<double>(unitFloat(hash(seed, 0xd00fu))), cumulative = 0;
    Drawn out;
    for (size_t i = 0; i < change.size(); ++i) {
        cumulative += density(i);
        double times = 0;
        for (; target < cumulative; target += step) ++times;
        if (times == 0) continue;
        out.index.push_back(i);
        out.weight.push_back(times * step / density(i));
    }
    return out;
}

// Pairs that count by the area they stand for: shares of sums are the same whatever their unit.
std::vector<LightPair> weighted(std::vector<LightPair> pairs, std::span<const double> weights) {
    for (size_t i = 0; i < pairs.size(); ++i)
        pairs[i] = {weights[i] * pairs[i].value_lux, weights[i] * pairs[i].reference_lux,
                    weights[i] * pairs[i].reference_error_lux};
    return pairs;
}

// Surely different from nothing, summed over the area.
double surelyChanged(std::span<const LightPair> pairs) {
    double sum = 0;
    for (const LightPair& p : pairs)
        sum += std::max(0.0, std::abs(p.reference_lux) - significant_errors * p.reference_error_lux);
    return sum;
}

template <class T>
std::vector<T> picked(std::span<const T> from, std::span<const size_t> indices) {
    std::vector<T> out;
    for (size_t i : indices) out.push_back(from[i]);
    return out;
}

// Empty where the door hardly touches this light.
Expected<std::optional<DoorReport>> openingReport(const Opening& opening, const Pack& pack,
                                                  std::span<const VerifyPoint> candidates, const Light& light,
                                                  const VerifyOptions& options, Progress& progress) {
    const auto closed_lux = packed(opening, pack, candidates, light, opening.closed_doors);
    if (!closed_lux) return std::unexpected(closed_lux.error());
    const auto open_lux = packed(opening, pack, candidates, light, opening.open_doors);
    if (!open_lux) return std::unexpected(open_lux.error());
    std::vector<double> change(candidates.size());
    std::ranges::transform(*open_lux, *closed_lux, change.begin(), std::minus{});

    const Drawn drawn = draw(change, options.points, options.seed);
    const auto points = picked(candidates, drawn.index);
    const auto where = queries(points, false);
    const auto values = picked(std::span<const double>(change), drawn.index);
    const ReferenceOptions of{
        .seed = options.seed, .set_weights = light.set_weights, .always_weight = light.always_on ? 1.0f : 0.0f};
    const ReferenceTracer closed(opening.closed, of), open(opening.open, of);
    std::vector<ReferenceEstimate> estimates(where.size());
    const RefinePoint refine = [&](size_t i, ReferenceEstimate& estimate, uint32_t paths) {
        open.refineDifference(estimate, closed, where[i], paths);
    };
    refineEach(refine, {.paths_min = first_paths, .paths_max = first_paths}, estimates, progress);
    const auto first = weighted(pairsOf(values, estimates), drawn.weight);
    const double sum_lux = std::reduce(closed_lux->begin(), closed_lux->end());
    const bool all = light.name == "all";
    if (!all && surelyChanged(first) <= negligible * sum_lux) {
        progress.advance(where.size());
        return std::nullopt;
    }
    double mean_lux = 0;
    for (const LightPair& p : first) mean_lux += std::abs(p.reference_lux) / static_cast<double>(candidates.size());
    const double more = static_cast<double>(options.paths_max) / VerifyOptions{}.paths_max;
    refineEach(refine,
               {.paths_min = first_paths,
                .paths_max = std::max(first_paths, options.paths_max),
                .relative = change_relative / std::sqrt(more),
                .floor_lux = even_share * mean_lux},
               estimates, progress);
    DoorReport report;
    report.light = light.name;
    report.effect = effectError(weighted(pairsOf(values, estimates), drawn.weight));
    if (all) {
        std::vector<ReferenceEstimate> lit(where.size());
        refineAll(open, where,
                  {.paths_min = first_paths,
                   .paths_max = std::max(first_paths, options.paths_max),
                   .relative = light_relative},
                  lit, progress);
        report.light_error = effectError(pairsOf(picked(std::span<const double>(*open_lux), drawn.index), lit)).error;
    }
    return report;
}

// Places that somebody can see whether the door is closed or open; none on the leaf, which moves.
std::vector<VerifyPoint> placesAround(const Opening& opening, const Pack& pack, const VerifyOptions& options) {
    auto points = choosePoints(pack, opening.open, opening.open_doors, candidates_per_point * options.points,
                               hash(options.seed, 0xd00cu));
    std::erase_if(points, [&](const VerifyPoint& p) { return hidden(opening.closed, p.position_m, p.frame, 0); });
    return points;
}

}  // namespace

Expected<std::vector<DoorReport>> verifyDoors(const Scene& scene, const Pack& pack, const VerifyOptions& options,
                                              const ReferenceState& state, Progress& progress) {
    const std::vector<Light> lights = lightsOf(scene, state);
    const auto doors = static_cast<size_t>(std::ranges::count(state.door_open, false));
    progress.stage("doors", doors * (2 * lights.size() + 1) * options.points);
    std::vector<DoorReport> out;
    for (size_t d = 0; d < scene.doors.size(); ++d) {
        if (state.door_open[d]) continue;
        const Opening opening(scene, state, d);
        const auto candidates = placesAround(opening, pack, options);
        for (const Light& light : lights) {
            auto report = openingReport(opening, pack, candidates, light, options, progress);
            if (!report) return std::unexpected(report.error());
            if (!*report) continue;
            (*report)->door = scene.doors[d].name;
            out.push_back(std::move(**report));
        }
    }
    return out;
}

}  // namespace dimmer::cook
