#include <pipeline/dissect.h>

#include <bake/door_pairs.h>
#include <bake/final_gather.h>
#include <bake/reference.h>
#include <bake/sampling.h>
#include <bake/series.h>
#include <charts/bilinear.h>
#include <encode/encode.h>
#include <pipeline/charted_level.h>
#include <pipeline/cook_settings.h>
#include <pipeline/lamps_apart.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

namespace dimmer::cook {
namespace {

constexpr uint32_t point_rays = 16384;  // at a point itself
constexpr uint32_t texel_rays = 4096;   // at each of the 16 texels or so that it shows
constexpr uint32_t tilted_count = 16;   // normals per point
constexpr uint32_t gather_seed = 0x5eed;
// Points whose surface the charts know by another normal are no help.
constexpr float same_normal_cos = 0.99f;

// The cook up to its last gather.
struct Rebake {
    LampGroups lamps;  // level, series and gatherer know the parts
    std::unique_ptr<ChartedLevel> level;
    Texels texels;
    std::optional<EmitterSampler> emitters;
    std::optional<DoorPaths> paths;
    std::optional<Gatherer> gatherer;
    std::optional<BilinearTaps> taps;
    BakeSettings settings;
    Series series;
};

Expected<std::unique_ptr<Rebake>> rebake(Scene scene, const Pack& pack, Progress& progress) {
    const auto settings = readSettings(pack.data().settings_json);
    if (!settings) return std::unexpected(settings.error());
    const Quality& quality = *settings->profile.quality(settings->quality);
    auto bake = std::make_unique<Rebake>();
    bake->settings = bakeSettings(settings->profile, quality, scene);
    bake->lamps = takeLampsApart(scene, quality.lamps_apart);
    bake->settings.group_thresholds = bake->lamps.ofParts(bake->settings.group_thresholds);
    auto charted = chartAgain(std::move(scene), pack.data());
    if (!charted) return std::unexpected(charted.error());
    bake->level = std::move(*charted);
    const ChartedLevel& level = *bake->level;
    bake->texels = sampleTexels(*level.rays, level.charts, quality.samples_per_texel);
    bake->emitters.emplace(*level.rays, meshGroups(level.scene));
    bake->paths.emplace(level.scene, doorsInSight(*level.rays));
    bake->gatherer.emplace(*level.rays, level.charts, bake->texels, *bake->emitters, *bake->paths);
    bake->taps.emplace(level.charts, bake->texels);
    const LightGrid lights(*level.rays, bake->settings.light_grid, {}, &progress);
    bake->series = expandSeries(*bake->gatherer, lights, bake->settings, progress);
    return bake;
}

// What a pack shows at a point.
struct Footprint {
    std::vector<Tap> stored;    // of the stored texels, which a bilinear filter mixes
    std::vector<Tap> gathered;  // of the light that was gathered at texels: what sharpening made the stored ones of
    std::optional<SamplePoint> centre;  // the point itself, with a face that lies in its surface
};

void addTap(std::vector<Tap>& taps, Tap tap) {
    const auto known = std::ranges::find(taps, tap.receiver, &Tap::receiver);
    if (known == taps.end())
        taps.push_back(tap);
    else
        known->weight += tap.weight;
}

// Black texels have no share.
void normalize(std::vector<Tap>& taps) {
    float sum = 0;
    for (const Tap& tap : taps) sum += tap.weight;
    for (Tap& tap : taps) tap.weight /= sum;
}

// As sharpen() makes texels of gathered light, noise and what it holds back aside: twice a texel's own, less what is
// shown around it.
std::vector<Tap> sharpened(const BilinearTaps& taps, std::span<const Tap> stored) {
    std::vector<Tap> out, around;
    for (const auto& [receiver, share] : stored) {
        addTap(out, {receiver, 2 * share});
        taps.around(receiver, around);
        for (const Tap& tap : around) addTap(out, {tap.receiver, -share * tap.weight});
    }
    return out;
}

Footprint footprintOf(const Rebake& bake, const Pack& pack, const VerifyPoint& p) {
    Footprint out;
    const glm::vec2 place(p.uv[0] * static_cast<float>(pack.pageWidth()) - 0.5f,
                          p.uv[1] * static_cast<float>(pack.pageHeight()) - 0.5f);
    const glm::ivec2 first(glm::floor(place)), last(pack.pageWidth() - 1, pack.pageHeight() - 1);
    const glm::vec2 along = place - glm::vec2(first);
    const uint32_t page = pack.meshes()[p.mesh].page;
    float nearest = INFINITY;
    for (int i = 0; i < 4; ++i) {
        const glm::ivec2 corner(i & 1, i >> 1), at = glm::clamp(first + corner, glm::ivec2(0), last);
        const float share = (corner.x ? along.x : 1 - along.x) * (corner.y ? along.y : 1 - along.y);
        const uint32_t receiver = bake.taps->shownAt(page, at);
        if (receiver == no_index || !(share > 0)) continue;
        out.stored.push_back({receiver, share});
        for (uint32_t s = 0; s < bake.texels.sampleCount(receiver); ++s) {
            const SamplePoint sample = samplePoint(*bake.level->rays, bake.level->charts, bake.texels, receiver, s);
            const float distance = glm::distance(sample.position_m, p.position_m);
            if (glm::dot(bake.level->charts.frames[sample.face].normal, p.frame.normal) < same_normal_cos) continue;
            if (!(distance < nearest)) continue;
            nearest = distance;
            out.centre = {{p.position_m + liftOff(p.position_m, path_offset_m) * p.frame.normal, sample.face}};
        }
    }
    normalize(out.stored);
    out.gathered = bake.settings.sharpen ? sharpened(*bake.taps, out.stored) : out.stored;
    return out;
}

// Luminance of terms' light in a state of the sets with every door closed, and the variance of what was gathered.
class Mixed {
   public:
    Mixed(const Rebake& bake, const ReferenceState& state) {
        for (const Term& t : bake.paths->terms()) {
            const uint32_t whole = bake.lamps.wholeOf(t.group);
            const glm::vec3 weight = whole == always_group ? glm::vec3(1) : state.set_weights[whole - 1];
            const glm::vec3 lit = weight * bake.level->scales.of_group[t.group];
            weights_.push_back(t.doors_open.empty() ? lit : glm::vec3(0));
        }
    }
    double lux(uint32_t term, const Gathered& light) const {
        return static_cast<double>(luminance(weights_[term] * light.irradiance_lux));
    }
    double variance(const ReceiverLight& l) const {
        const auto w = static_cast<double>(luminance(weights_[l.term]));
        return w * w * static_cast<double>(l.variance);
    }

   private:
    std::vector<glm::vec3> weights_;
};

struct Steps {
    LightPair series, texel, threshold, noise;  // each against the step before it
    bool known = false;
};

Steps stepsAt(const Rebake& bake, const Pack& pack, const VerifyPoint& p, const LightPair& pair, const Mixed& mixed) {
    const uint32_t term_count = bake.paths->termCount();
    const std::vector<float> floors(term_count);
    FinalGatherOptions options = finalGatherOptions(bake.settings, floors);
    options.noise_max = 0;
    options.seed = gather_seed;
    std::vector<uint32_t> all(term_count), active;
    std::iota(all.begin(), all.end(), 0u);
    FinalGather<Gathered> gather(*bake.gatherer);
    std::vector<ReceiverLight> row;
    std::vector<SamplePoint> points;

    const Footprint footprint = footprintOf(bake, pack, p);
    if (footprint.stored.empty() || !footprint.centre) return {};
    double at_texels = 0, where_active = 0, texel_variance = 0;
    double direct = 0;  // stored direct light: no part of the gather, and the same in every step after the first
    options.rays_max = texel_rays;
    for (const auto& [receiver, share] : footprint.gathered) {
        row.clear();
        gather.gather(bake.gatherer->at(receiver, points), all, bake.series.radiance, options, row);
        bake.series.activeTerms(receiver, active);
        const auto weight = static_cast<double>(share);
        for (const ReceiverLight& l : row) {
            const double lux = weight * mixed.lux(l.term, l.light);
            at_texels += lux;
            if (std::ranges::binary_search(active, l.term)) where_active += lux;
            texel_variance += weight * weight * mixed.variance(l);
        }
    }
    for (const auto& [receiver, share] : footprint.stored)
        for (const ReceiverLight& d : bake.series.stored_direct.row(receiver))
            direct += static_cast<double>(share) * mixed.lux(d.term, d.light);
    row.clear();
    options.rays_max = point_rays;
    const GatherFrom centre{{&*footprint.centre, 1},
                            hash(gather_seed, footprint.stored[0].receiver),
                            bake.gatherer->conditionOf(footprint.stored[0].receiver)};
    gather.gather(centre, all, bake.series.radiance, options, row);
    double at_point = 0, point_variance = 0;
    for (const ReceiverLight& l : row) {
        at_point += mixed.lux(l.term, l.light);
        point_variance += mixed.variance(l);
    }
    const double point_error = std::sqrt(point_variance), texel_error = std::sqrt(texel_variance);
    Steps steps;
    steps.known = true;
    steps.series = {at_point + direct, pair.reference_lux, std::hypot(pair.reference_error_lux, point_error)};
    steps.texel = {at_texels, at_point, std::hypot(texel_error, point_error)};
    steps.threshold = {where_active, at_texels, 0};
    steps.noise = {pair.value_lux, where_active + direct, texel_error};
    return steps;
}

// lightError() divides by the reference of each pair; here every step is a share of the truth.
double meanStep(std::span<const Steps> steps, LightPair Steps::*step, std::span<const LightPair> pairs,
                double floor_lux) {
    double sum = 0, noise = 0, count = 0;
    for (size_t i = 0; i < steps.size(); ++i) {
        if (!steps[i].known) continue;
        const LightPair& p = steps[i].*step;
        const double scale = pairs[i].reference_lux + floor_lux;
        sum += std::abs(p.value_lux - p.reference_lux) / scale;
        noise += std::sqrt(2 / std::numbers::pi) * p.reference_error_lux / scale;
        ++count;
    }
    return count > 0 ? std::sqrt(std::max(0.0, sum * sum - noise * noise)) / count : 0;
}

// What arrives at a point, per light group with doors closed, with the irradiance on tilted normals beside.
struct Falloff {
    Gathered light;
    std::array<glm::vec3, tilted_count> tilted_lux{};

    void add(glm::vec3 lux, glm::vec3 direction, std::span<const glm::vec3> normals) {
        light.add(lux, Gathered::weightsOf(direction));
        for (size_t i = 0; i < normals.size(); ++i)
            tilted_lux[i] += lux * (std::max(0.0f, glm::dot(normals[i], direction)) / direction.z);
    }
    void addScaled(const Falloff& other, glm::vec3 scale) {
        light += multiplied(other.light, scale);
        for (size_t i = 0; i < tilted_lux.size(); ++i) tilted_lux[i] += scale * other.tilted_lux[i];
    }
};

// Spread over the cap of 60 degrees, the same everywhere but for a turn about the surface's normal.
std::vector<glm::vec3> tiltedNormals(uint32_t point) {
    std::vector<glm::vec3> out;
    const float cos_max = std::cos(tilt_max_deg * pi / 180), turn = unitFloat(hash(point, gather_seed));
    for (uint32_t i = 0; i < tilted_count; ++i) {
        const float z = 1 - (static_cast<float>(i) + 0.5f) / tilted_count * (1 - cos_max);
        const float phi = 2 * pi * (turn + radicalInverse(2, i)), radius = std::sqrt(1 - z * z);
        out.push_back({radius * std::cos(phi), radius * std::sin(phi), z});
    }
    return out;
}

// With every door closed.
std::optional<Hit> nearestClosed(const RayScene& rays, glm::vec3 origin, glm::vec3 direction, uint32_t seed) {
    LeafHits leaves;
    const auto hit = rays.nearest(origin, direction, far_away_m, seed, Surfaces::Walls, no_model,
                                  rays.anyLeaf() ? &leaves : nullptr);
    for (const Hit& leaf : leaves) {
        const bool there = rays.triangles()[leaf.triangle].condition % 2 == 0;
        if (there && unitFloat(hash(seed, leaf.triangle)) < rays.alphaAt(leaf.triangle, leaf.u, leaf.v)) return leaf;
    }
    return hit;
}

// A plain gather: emitters by hit alone.
void gatherFalloff(const Rebake& bake, const SamplePoint& from, uint32_t id, std::span<const glm::vec3> normals,
                   TermAccumulator<Falloff>& sum) {
    const TangentFrame& frame = bake.level->charts.frames[from.face];
    const float lux_per_radiance = pi / point_rays;
    for (uint32_t i = 0; i < point_rays; ++i) {
        const glm::vec3 d = cosineDirection(sequence2d(i, hash(id, gather_seed)));
        if (!(d.z > 1e-3f)) continue;
        const glm::vec3 world = frame.tangent * d.x + frame.bitangent * d.y + frame.normal * d.z;
        const auto hit = nearestClosed(*bake.level->rays, from.position_m, world, i);
        if (!hit) {
            sum[always_group].add(lux_per_radiance * skyRadiance(bake.level->scene, world), d, normals);
            continue;
        }
        if (const Emitter* e = bake.emitters->emitterOf(hit->triangle); e && (!hit->back || e->double_sided))
            sum[e->group].add(lux_per_radiance * e->radiance_cd_m2, d, normals);
        uint32_t found = receiverOf(bake.level->charts, bake.texels, *hit);
        if (found == no_index && !bake.gatherer->models().empty())
            found = bake.gatherer->modelReceiverAt(*hit, hash(id, i));
        if (found == no_index) continue;
        for (const TermLight& l : bake.series.radiance.row(found))
            if (const Term& term = bake.paths->terms()[l.term]; term.doors_open.empty())
                sum[term.group].add(lux_per_radiance * l.value(), d, normals);
    }
}

template <ColorFormat format>
TexelRecord blended(std::span<const TexelRecord> records) {
    TexelBlend<format> sum;
    for (const TexelRecord& r : records) {
        const TexelRecord usable = canonical(format, r);
        sum.add(usable, weightScale(format), weightScale(format), weightScale(format));
    }
    return sum.encode();
}

double decodedLux(const TexelRecord& record, const TexelEncoding& encoding, glm::vec3 n) {
    const auto stored = decodeColor(encoding.color_format, record.irradiance);
    const float shape = falloff(encoding.direction_model, decodeDirection(record.direction), {n.x, n.y, n.z});
    return static_cast<double>(luminance(glm::vec3(stored[0], stored[1], stored[2])) * shape / encoding.exposure);
}

// The base, then the sets that give most light, at most `sets` of them.
std::vector<uint32_t> strongest(TermAccumulator<Falloff>& sum, uint32_t sets) {
    std::vector<uint32_t> groups;
    for (uint32_t g : sum.touched())
        if (g != always_group) groups.push_back(g);
    std::ranges::stable_sort(groups, std::greater{},
                             [&](uint32_t g) { return luminance(sum[g].light.irradiance_lux); });
    groups.resize(std::min<size_t>(groups.size(), sets));
    groups.insert(groups.begin(), always_group);
    return groups;
}

struct Storage {
    TexelEncoding encoding;
    uint32_t sets;
    std::vector<LightPair> pairs;
};

std::vector<Storage> storages(float exposure) {
    std::vector<Storage> out;
    for (const auto format : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9})
        for (const auto model : {DirectionModel::Ahd, DirectionModel::Linear})
            for (const uint32_t sets : {1u, 3u, 8u}) out.push_back({{exposure, format, model}, sets, {}});
    return out;
}

void measureStorage(Storage& s, TermAccumulator<Falloff>& sum, std::span<const glm::vec3> normals) {
    std::vector<TexelRecord> records;
    std::array<glm::vec3, tilted_count> exact{};
    for (uint32_t g : strongest(sum, s.sets)) {
        records.push_back(encodeTexel(sum[g].light, s.encoding));
        for (size_t i = 0; i < normals.size(); ++i) exact[i] += sum[g].tilted_lux[i];
    }
    const TexelRecord record = s.encoding.color_format == ColorFormat::R11G11B10F
                                   ? blended<ColorFormat::R11G11B10F>(records)
                                   : blended<ColorFormat::E5B9G9R9>(records);
    for (size_t i = 0; i < normals.size(); ++i)
        s.pairs.push_back({decodedLux(record, s.encoding, normals[i]), static_cast<double>(luminance(exact[i])), 0});
}

}  // namespace

Expected<void> checkRebake(const Scene& scene, const Pack& pack) {
    const auto charted = chartAgain(scene, pack.data());
    if (!charted) return std::unexpected(charted.error());
    return {};
}

Expected<ErrorCauses> errorCauses(const Scene& scene, const Pack& pack, std::span<const VerifyPoint> points,
                                  std::span<const LightPair> pairs, const ReferenceState& state, double floor_lux,
                                  Progress& progress) {
    const auto bake = rebake(scene, pack, progress);
    if (!bake) return std::unexpected(bake.error());
    progress.stage("causes of error", points.size());
    const Mixed mixed(**bake, state);
    std::vector<Steps> steps(points.size());
    tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
        steps[i] = stepsAt(**bake, pack, points[i], pairs[i], mixed);
        progress.advance(1);
    });
    return ErrorCauses{{"series_expansion", meanStep(steps, &Steps::series, pairs, floor_lux)},
                       {"texel_size", meanStep(steps, &Steps::texel, pairs, floor_lux)},
                       {"activity_threshold", meanStep(steps, &Steps::threshold, pairs, floor_lux)},
                       {"noise", meanStep(steps, &Steps::noise, pairs, floor_lux)}};
}

Expected<std::vector<FormatError>> formatErrors(const Scene& scene, const Pack& pack,
                                                std::span<const VerifyPoint> points, Progress& progress) {
    const auto bake = rebake(scene, pack, progress);
    if (!bake) return std::unexpected(bake.error());
    progress.stage("formats", points.size());
    const uint32_t group_count = (*bake)->paths->groupCount();
    std::vector<std::vector<Storage>> at(points.size());
    tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
        progress.advance(1);
        const Footprint footprint = footprintOf(**bake, pack, points[i]);
        if (!footprint.centre) return;
        TermAccumulator<Falloff> sum(group_count);
        const auto normals = tiltedNormals(static_cast<uint32_t>(i));
        gatherFalloff(**bake, *footprint.centre, static_cast<uint32_t>(i), normals, sum);
        TermAccumulator<Falloff> whole(group_count);
        for (const uint32_t g : sum.touched())
            whole[(*bake)->lamps.wholeOf(g)].addScaled(sum[g], (*bake)->level->scales.of_group[g]);
        at[i] = storages(pack.exposure());
        for (Storage& s : at[i]) measureStorage(s, whole, normals);
    });
    std::vector<FormatError> out;
    for (const Storage& kind : storages(pack.exposure())) {
        std::vector<LightPair> pairs;
        double total = 0;
        for (const auto& storages_here : at)
            for (const Storage& s : storages_here)
                if (s.sets == kind.sets && s.encoding.color_format == kind.encoding.color_format &&
                    s.encoding.direction_model == kind.encoding.direction_model)
                    pairs.insert(pairs.end(), s.pairs.begin(), s.pairs.end());
        for (const LightPair& p : pairs) total += p.reference_lux;
        const ErrorFigures f =
            lightError(pairs, pairs.empty() ? 0 : floor_share * total / static_cast<double>(pairs.size()));
        out.push_back({kind.encoding.color_format, kind.encoding.direction_model, kind.sets, f.mean, f.p95, f.points});
    }
    return out;
}

}  // namespace dimmer::cook
