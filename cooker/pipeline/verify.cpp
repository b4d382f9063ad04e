#include <pipeline/verify.h>

#include <bake/sampling.h>
#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <format/texel.h>
#include <pipeline/dissect.h>
#include <pipeline/measured_light.h>
#include <pipeline/verify_doors.h>
#include <pipeline/verify_models.h>
#include <probes/free_space.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

constexpr uint32_t tries_per_point = 20;
const float tilt_cos_min = std::cos(tilt_max_deg * pi / 180);
// A set's light at a point is known well enough at this share of the light there and of the set's typical light, with
// the default limit of paths; more paths make it smaller, as they do the noise.
constexpr double set_relative = 0.04;
constexpr uint32_t set_paths_first = 256;
constexpr uint32_t set_paths_share = 4;  // of what a point of the whole light may take
// One set lights a part of the level: it takes more places to find it, most of which cost the first look alone.
constexpr uint32_t set_points_factor = 4;

glm::vec3 vec(const std::array<float, 3>& a) {
    return {a[0], a[1], a[2]};
}

struct PackTriangle {
    uint32_t mesh;
    std::array<uint32_t, 3> corner;
    double cumulative_m2;
};

std::vector<PackTriangle> litTriangles(const Pack& pack, const std::vector<bool>& door_open) {
    // Elements hold the light sets first, then the doors in the scene's order.
    const auto sets = static_cast<size_t>(std::ranges::count(pack.elements(), ElementKind::LightSet, &Element::kind));
    std::vector<PackTriangle> out;
    double sum = 0;
    for (uint32_t m = 0; m < pack.meshes().size(); ++m) {
        const Mesh& mesh = pack.meshes()[m];
        if (mesh.door && door_open[*mesh.door - sets]) continue;
        for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
            const std::array corner{mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]};
            const glm::vec3 a = vec(mesh.vertices[corner[0]].position_m);
            const glm::vec3 b = vec(mesh.vertices[corner[1]].position_m), c = vec(mesh.vertices[corner[2]].position_m);
            sum += 0.5 * static_cast<double>(glm::length(glm::cross(b - a, c - a)));
            out.push_back({m, corner, sum});
        }
    }
    return out;
}

VerifyPoint pointOn(const Pack& pack, const PackTriangle& t, glm::vec2 u) {
    const Mesh& mesh = pack.meshes()[t.mesh];
    const glm::vec2 on = uniformOnTriangle(u);
    const std::array weights{1 - on.x - on.y, on.x, on.y};
    std::array<glm::vec3, 3> positions;
    std::array<glm::vec2, 3> uv_texels;
    VerifyPoint p;
    p.mesh = t.mesh;
    for (size_t i = 0; i < 3; ++i) {
        const MeshVertex& v = mesh.vertices[t.corner[i]];
        positions[i] = vec(v.position_m);
        uv_texels[i] = glm::vec2(v.lightmap_uv[0], v.lightmap_uv[1]) * glm::vec2(pack.pageWidth(), pack.pageHeight());
        p.position_m += weights[i] * positions[i];
        p.uv[0] += weights[i] * v.lightmap_uv[0];
        p.uv[1] += weights[i] * v.lightmap_uv[1];
    }
    const glm::vec3 normal = glm::normalize(glm::cross(positions[1] - positions[0], positions[2] - positions[0]));
    float texel_area_m2 = 0;
    p.frame = tangentFrame(positions, uv_texels, normal, texel_area_m2);
    return p;
}

glm::vec3 fromTangent(const TangentFrame& f, glm::vec3 d) {
    return f.tangent * d.x + f.bitangent * d.y + f.normal * d.z;
}

bool reached(const ErrorFigures& f) {
    return f.reference_error_mean <= converged_share * f.measured_mean;
}

// What rounding to the nearest of the colour format's steps costs on average, by arithmetic: a quarter of a step.
// Channels are rounded on their own; in luminance their errors partly cancel, which this does not count on.
double formatError(std::span<const LightPair> pairs, const Pack& pack, double floor_lux) {
    const double exposure = static_cast<double>(pack.exposure());
    const int channel_bits = pack.colorFormat() == ColorFormat::R11G11B10F ? 6 : 8;
    double sum = 0;
    for (const LightPair& p : pairs) {
        const double stored = std::max(p.value_lux * exposure, 0x1p-14);
        const double step = std::exp2(std::floor(std::log2(stored)) - channel_bits);
        sum += 0.25 * step / exposure / (p.reference_lux + floor_lux);
    }
    return pairs.empty() ? 0 : sum / static_cast<double>(pairs.size());
}

// The directional model alone: the pack's shape of E(n) / E_z on the reference's own E_z, against the reference.
double modelError(const Measured& surface, const Measured& tilted, double floor_lux) {
    std::vector<LightPair> pairs;
    for (size_t i = 0; i < surface.pairs.size(); ++i) {
        const LightPair &own = surface.pairs[i], &other = tilted.pairs[i];
        if (!(own.value_lux > 0)) continue;
        const double shape = other.value_lux / own.value_lux;
        pairs.push_back({shape * own.reference_lux, other.reference_lux,
                         std::hypot(shape * own.reference_error_lux, other.reference_error_lux)});
    }
    return lightError(pairs, floor_lux).mean;
}

// Drops the points that stay black with every set on, by the reference and by the pack alike (outsides of walls: exact
// by having nothing, they would thin out every mean). Returns the floor that goes with the points that stay.
Expected<double> keepLit(const RayScene& rays, const Pack& pack, uint32_t seed, std::vector<VerifyPoint>& points,
                         Progress& progress) {
    // The mean over all points has little noise even with few paths each.
    std::vector<ReferenceEstimate> all_on(points.size());
    refineAll(ReferenceTracer(rays, {.seed = seed, .set_weights = {}}), queries(points, false),
              {.paths_min = 64, .paths_max = 64}, all_on, progress);
    const auto packed = packLight(pack, points, false, "");
    if (!packed) return std::unexpected(packed.error());
    std::vector<VerifyPoint> lit;
    const size_t asked = points.size();
    double sum = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        const auto lux = static_cast<double>(luminance(all_on[i].value().irradiance_lux));
        sum += lux;
        if (lux > 0 || (*packed)[i] > 0) lit.push_back(points[i]);
    }
    points = std::move(lit);
    if (sum > 0) return floor_share * sum / static_cast<double>(points.size());
    return fail(ErrorCode::BadInput,
                fmt::format("With all light sets on, no light was found at {} points: there is nothing to measure an "
                            "error against. Is the level lit, and are those points enough (--points)?",
                            asked));
}

Expected<void> checkSameLevel(const Scene& scene, const Pack& pack) {
    const auto sets = static_cast<size_t>(std::ranges::count(pack.elements(), ElementKind::LightSet, &Element::kind));
    const bool same =
        sets == scene.light_sets.size() && pack.elements().size() == sets + scene.doors.size() &&
        std::ranges::equal(scene.light_sets, pack.elements().first(scene.light_sets.size()), {}, &SceneLightSet::name,
                           &Element::name) &&
        std::ranges::equal(scene.doors, pack.elements().last(scene.doors.size()), {}, &SceneDoor::name, &Element::name);
    if (same) return {};
    return fail(ErrorCode::BadInput, fmt::format("{}: the pack has other light sets or doors than this level; cook the "
                                                 "level again.",
                                                 scene.file));
}

// What dissect() would refuse, before anything is measured.
Expected<void> checkDissection(const Scene& scene, const Pack& pack, const VerifyOptions& options,
                               const ReferenceState& state) {
    if (options.causes && std::ranges::find(state.door_open, true) != state.door_open.end())
        return fail(ErrorCode::InvalidArgument, "Causes of error are told apart with closed doors only.");
    return options.causes || options.formats ? checkRebake(scene, pack) : Expected<void>();
}

Expected<void> dissect(const Scene& scene, const Pack& pack, const VerifyOptions& options, const ReferenceState& state,
                       Progress& progress, VerifyReport& report) {
    if (options.causes) {
        const auto causes =
            errorCauses(scene, pack, report.points, report.surface_pairs, state, report.floor_lux, progress);
        if (!causes) return std::unexpected(causes.error());
        report.causes.insert(causes->begin(), causes->end());
    }
    if (options.formats) {
        auto formats = formatErrors(scene, pack, report.points, progress);
        if (!formats) return std::unexpected(formats.error());
        report.formats = std::move(*formats);
    }
    return {};
}

// The global grid at random places in the open, with any normal. Places that stay black do not count.
Expected<void> verifyGrid(const ReferenceTracer& tracer, const RayScene& rays, const Pack& pack,
                          const VerifyOptions& options, Progress& progress, VerifyReport& report) {
    CpuRuntime runtime(pack);
    const GridSampler grid(pack, runtime.probes());
    if (grid.empty()) return {};
    if (auto ok = runtime.apply(options.state); !ok) return ok;
    runtime.update();
    std::vector<ReferencePoint> where;
    std::vector<double> values;
    for (const glm::vec3 p : openPlaces(rays, options.points, hash(options.seed, 0x611du))) {
        const glm::vec3 n = uniformSphereDirection(sequence2d(static_cast<uint32_t>(where.size()), options.seed));
        const auto e = grid.sample({p.x, p.y, p.z}, {n.x, n.y, n.z});
        where.push_back({p, n});
        values.push_back(static_cast<double>(luminance(glm::vec3(e[0], e[1], e[2]))));
    }
    const Measured m = measure(tracer, where, values, report.floor_lux, options.paths_max, progress);
    std::vector<LightPair> lit;
    for (size_t i = 0; i < where.size(); ++i) {
        const LightPair& p = m.pairs[i];
        if (!(p.value_lux > 0) && !(p.reference_lux > 0)) continue;
        lit.push_back(p);
        report.places.push_back({"grid", where[i].position_m, where[i].normal, p});
    }
    report.grid = lightError(lit, report.floor_lux);
    return {};
}

Expected<void> verifySets(const Scene& scene, const Pack& pack, const VerifyOptions& options, Progress& progress,
                          VerifyReport& report) {
    // Each set is one that shines alone with every door closed: what the pack stores for it.
    const RayScene closed(scene);
    const auto points = choosePoints(pack, closed, std::vector<bool>(scene.doors.size()),
                                     set_points_factor * options.points, options.seed + 1);
    progress.stage("light sets", scene.light_sets.size() * 2 * points.size());
    for (uint32_t s = 0; s < scene.light_sets.size(); ++s) {
        const auto effect = setEffect(closed, pack, points, s, options.seed, progress, options.paths_max);
        if (!effect) return std::unexpected(effect.error());
        SetReport set{scene.light_sets[s].name, *effect, 0};
        for (const Contribution& c : pack.contributions())
            if (c.light_set == s && c.doors_open.empty() && c.doors_closed.empty())
                set.energy_dropped = static_cast<double>(c.energy_dropped);
        report.sets.push_back(set);
    }
    return {};
}

}  // namespace

std::vector<VerifyPoint> choosePoints(const Pack& pack, const RayScene& rays, const std::vector<bool>& door_open,
                                      uint32_t count, uint32_t seed) {
    const auto triangles = litTriangles(pack, door_open);
    std::vector<VerifyPoint> points;
    if (triangles.empty() || !(triangles.back().cumulative_m2 > 0)) return points;
    for (uint32_t i = 0; points.size() < count && i < tries_per_point * count; ++i) {
        // Stratified over the area; retries for hidden places start another round over it.
        const float stratum = static_cast<float>(i % count) + unitFloat(hash(seed, 4 * i));
        const double target = static_cast<double>(stratum) / count * triangles.back().cumulative_m2;
        auto t = std::ranges::upper_bound(triangles, target, {}, &PackTriangle::cumulative_m2);
        if (t == triangles.end()) --t;
        VerifyPoint p = pointOn(pack, *t, {unitFloat(hash(seed, 4 * i + 1)), unitFloat(hash(seed, 4 * i + 2))});
        if (hidden(rays, p.position_m, p.frame, hash(seed, 4 * i + 3))) continue;
        p.tilted = fromTangent(p.frame, uniformCapDirection(sequence2d(i, hash(seed, 0x7117u)), tilt_cos_min));
        points.push_back(p);
    }
    return points;
}

std::vector<ReferencePoint> queries(std::span<const VerifyPoint> points, bool tilted) {
    std::vector<ReferencePoint> out;
    for (const VerifyPoint& p : points)
        out.push_back({p.position_m, tilted ? p.tilted : p.frame.normal, p.frame.normal});
    return out;
}

Expected<std::vector<double>> packLight(const Pack& pack, std::span<const VerifyPoint> points, bool tilted,
                                        std::string_view text) {
    CpuRuntime runtime(pack);
    if (auto ok = runtime.apply(text); !ok) return std::unexpected(ok.error());
    runtime.update();
    std::vector<double> out;
    for (const VerifyPoint& p : points) {
        const glm::vec3 n = tilted
                                ? glm::vec3(glm::dot(p.tilted, p.frame.tangent), glm::dot(p.tilted, p.frame.bitangent),
                                            glm::dot(p.tilted, p.frame.normal))
                                : glm::vec3(0, 0, 1);
        const auto e = sampleLightmap(pack, runtime.irradiancePages(), runtime.directionPages(),
                                      pack.meshes()[p.mesh].page, p.uv, {n.x, n.y, n.z});
        out.push_back(static_cast<double>(luminance(glm::vec3(e[0], e[1], e[2]))));
    }
    return out;
}

Expected<EffectFigures> setEffect(const RayScene& rays, const Pack& pack, std::span<const VerifyPoint> points,
                                  uint32_t set, uint32_t seed, Progress& progress, uint32_t paths_max) {
    const Element& element = pack.elements()[set];
    const float weight = std::min(1.0f, element.max_weight);
    auto with = packLight(pack, points, false, fmt::format("all=0,{}={}", element.name, weight));
    if (!with) return std::unexpected(with.error());
    auto without = packLight(pack, points, false, "all=0");
    if (!without) return std::unexpected(without.error());
    std::ranges::transform(*with, *without, with->begin(), std::minus{});

    ReferenceOptions alone = onlySet(set, rays.scene().light_sets.size(), seed);
    alone.set_weights[set] *= weight;
    const ReferenceTracer tracer(rays, alone);
    const auto where = queries(points, false);
    std::vector<ReferenceEstimate> estimates(points.size());
    const uint32_t first = std::min(set_paths_first, paths_max);
    refineAll(tracer, where, {.paths_min = first, .paths_max = first}, estimates, progress);
    // How bright it is where the set shines: the mean weighted by the light itself.
    double sum = 0, squares = 0;
    for (const LightPair& p : pairsOf(*with, estimates)) {
        sum += p.reference_lux;
        squares += p.reference_lux * p.reference_lux;
    }
    const double typical_lux = sum > 0 ? squares / sum : 0;
    const double more = static_cast<double>(paths_max) / VerifyOptions{}.paths_max;
    refineAll(tracer, where,
              {.paths_min = first,
               .paths_max = std::max(first, paths_max / set_paths_share),
               .relative = set_relative / std::sqrt(more),
               .floor_lux = typical_lux},
              estimates, progress);
    return effectError(pairsOf(*with, estimates));
}

Expected<VerifyReport> verify(const Scene& scene, const Pack& pack, const VerifyOptions& options, Progress& progress) {
    if (auto ok = checkSameLevel(scene, pack); !ok) return std::unexpected(ok.error());
    const auto state = readReferenceState(scene, options.state);
    if (!state) return std::unexpected(state.error());
    if (auto ok = checkDissection(scene, pack, options, *state); !ok) return std::unexpected(ok.error());
    const Scene as_it_stands = sceneInState(scene, *state);
    const RayScene rays(as_it_stands);
    VerifyReport report;
    report.points = choosePoints(pack, rays, state->door_open, options.points, options.seed);
    if (report.points.empty()) return fail(ErrorCode::BadInput, "The pack has no lightmapped surface in sight.");

    progress.stage("reference", 7 * report.points.size());
    const auto floor_lux = keepLit(rays, pack, options.seed, report.points, progress);
    if (!floor_lux) return std::unexpected(floor_lux.error());
    const auto own_queries = queries(report.points, false), tilted_queries = queries(report.points, true);
    report.floor_lux = *floor_lux;
    const auto own = packLight(pack, report.points, false, options.state);
    if (!own) return std::unexpected(own.error());
    const auto tilted = packLight(pack, report.points, true, options.state);
    if (!tilted) return std::unexpected(tilted.error());

    const ReferenceTracer tracer(rays, state->options(options.seed));
    const Measured at_surface = measure(tracer, own_queries, *own, *floor_lux, options.paths_max, progress);
    const Measured at_tilted = measure(tracer, tilted_queries, *tilted, *floor_lux, options.paths_max, progress);
    report.surface = at_surface.figures;
    report.tilted = at_tilted.figures;
    report.surface_pairs = at_surface.pairs;
    for (size_t i = 0; i < own_queries.size(); ++i)
        report.places.push_back({"surface", own_queries[i].position_m, own_queries[i].normal, at_surface.pairs[i]});
    for (size_t i = 0; i < tilted_queries.size(); ++i)
        report.places.push_back({"tilted", tilted_queries[i].position_m, tilted_queries[i].normal, at_tilted.pairs[i]});
    report.converged = reached(report.surface) && reached(report.tilted);
    if (auto ok = verifyGrid(tracer, rays, pack, options, progress, report); !ok) return std::unexpected(ok.error());
    auto models = verifyModels(tracer, rays, pack, options, report.floor_lux, progress);
    if (!models) return std::unexpected(models.error());
    std::ranges::move(models->places, std::back_inserter(report.places));
    report.models = std::move(*models);
    for (const Measured* m : {&at_surface, &at_tilted})
        for (const ReferenceEstimate& e : m->estimates) report.paths += e.paths();
    report.causes["colour_format"] = formatError(at_surface.pairs, pack, *floor_lux);
    report.causes["directional_model"] = modelError(at_surface, at_tilted, *floor_lux);
    if (auto ok = dissect(scene, pack, options, *state, progress, report); !ok) return std::unexpected(ok.error());
    if (options.sets)
        if (auto ok = verifySets(scene, pack, options, progress, report); !ok) return std::unexpected(ok.error());
    if (options.doors) {
        auto doors = verifyDoors(scene, pack, options, *state, progress);
        if (!doors) return std::unexpected(doors.error());
        report.doors = std::move(*doors);
    }
    progress.finish();
    return report;
}

}  // namespace dimmer::cook
