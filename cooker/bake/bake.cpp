#include <bake/bake.h>

#include <bake/denoise.h>
#include <bake/direct.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>

#include <atomic>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

// Bounced light of a set below this share of its activity threshold does not bounce on: with the usual threshold of
// 1 %, 0.01 % of the set's mean. What that loses over a series is far below the threshold's own loss.
constexpr float lingering_share = 0.01f;
// Light below this share of its group's mean need not be exact to a share of itself: the error metric's own floor.
constexpr float noise_floor = 0.01f;

class Baker {
   public:
    Baker(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
          Progress& progress)
        : rays_(rays),
          unwrap_(unwrap),
          texels_(texels),
          settings_(settings),
          progress_(progress),
          groups_(1 + static_cast<uint32_t>(rays.scene().light_sets.size())),
          emitters_(rays, meshGroups(rays.scene())),
          gatherer_(rays, unwrap, texels, emitters_),
          grid_(rays, settings.light_grid) {}

    Baked run() {
        directPass();
        series();
        decideActivity();
        finalPass();
        out_.rays = rays_traced_;
        return std::move(out_);
    }

   private:
    static std::vector<uint32_t> meshGroups(const Scene& scene) {
        std::vector<uint32_t> groups;
        for (const SceneMesh& mesh : scene.meshes) groups.push_back(groupOf(mesh.light_set));
        return groups;
    }

    // Moves `sum` to a row. `least`, when not empty, leaves out what is fainter than that, per group.
    static void takeRow(GroupAccumulator<Gathered>& sum, std::span<const float> least, std::vector<GroupLight>& row) {
        row.clear();
        for (uint32_t g : sum.touched())
            if (least.empty() || luminance(sum[g].irradiance_lux) >= least[g])
                row.push_back({g, sum[g].irradiance_lux});
        sum.clear();
    }

    // What surfaces reflect at the first bounce: punctual light, emitters and the sky. The rays that look for emitters
    // and sky leave behind which receivers see one another: the links that the series follows.
    void directPass() {
        progress_.stage("direct light and links", texels_.size());
        links_.assign(texels_.size() * settings_.series_rays, no_index);
        const GatherOptions options{
            .rays = settings_.series_rays, .emitter_samples = settings_.emitter_samples, .seed = settings_.seed};
        SparseLight::Builder direct(texels_.size()), left_to_renderer(texels_.size());
        Sparse<ReceiverLight>::Builder stored(texels_.size());
        forEachBlock(texels_.size(), [&](size_t begin, size_t end) {
            GroupAccumulator<Gathered> sum(groups_), full(groups_);
            std::vector<GroupLight> row, left_row;
            std::vector<ReceiverLight> stored_row;
            uint64_t traced = 0;
            for (size_t i = begin; i < end; ++i) {
                traced += directLight(rays_, grid_, unwrap_, texels_, i, sum, full) + options.rays;
                left_row.clear();
                for (uint32_t g : sum.touched()) {
                    const glm::vec3 left = sum[g].irradiance_lux - full[g].irradiance_lux;
                    if (luminance(left) > 0) left_row.push_back({g, left});
                }
                stored_row.clear();
                for (uint32_t g : full.touched())
                    if (luminance(full[g].irradiance_lux) > 0) stored_row.push_back({g, full[g]});
                full.clear();
                gatherer_.gather(i, options, nullptr, sum, &links_[i * settings_.series_rays]);
                takeRow(sum, {}, row);
                direct.put(i, row);
                left_to_renderer.put(i, left_row);
                stored.put(i, stored_row);
            }
            rays_traced_ += traced;
            progress_.advance(end - begin);
        });
        direct_ = direct.finish();
        left_to_renderer_ = left_to_renderer.finish();
        stored_direct_ = stored.finish();
    }

    // What leaves each receiver: rho / pi * (direct + bounced so far).
    SparseLight outgoing(const SparseLight& bounced) const {
        return SparseLight::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            GroupAccumulator<Gathered> sum(groups_);
            std::vector<GroupLight> row;
            for (size_t i = begin; i < end; ++i) {
                const glm::vec3 reflect = texels_.reflectance[i] / pi;
                for (const auto* part : {&direct_, &bounced})
                    for (const GroupLight& l : part->row(i)) sum[l.group].irradiance_lux += reflect * l.value;
                takeRow(sum, {}, row);
                emit(std::span<const GroupLight>(row));
            }
        });
    }

    // One more bounce along the links.
    SparseLight follow(const SparseLight& radiance) const {
        const float lux_per_radiance = pi / static_cast<float>(settings_.series_rays);
        return SparseLight::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            GroupAccumulator<Gathered> sum(groups_);
            std::vector<GroupLight> row;
            for (size_t i = begin; i < end; ++i) {
                for (uint32_t r = 0; r < settings_.series_rays; ++r) {
                    const uint32_t from = links_[i * settings_.series_rays + r];
                    if (from == no_index) continue;
                    for (const GroupLight& l : radiance.row(from))
                        sum[l.group].irradiance_lux += lux_per_radiance * l.value;
                }
                takeRow(sum, least_, row);
                emit(std::span<const GroupLight>(row));
            }
        });
    }

    double flux(const SparseLight& light) const {
        double sum = 0;
        for (size_t i = 0; i < light.rows(); ++i)
            for (const GroupLight& l : light.row(i))
                sum += static_cast<double>(texels_.area_m2[i] * luminance(l.value));
        return sum;
    }

    // Running sum: each round follows the whole light once, so round n holds bounces 1 to n.
    void series() {
        progress_.stage("bounces", settings_.bounces_max);
        bounced_ = SparseLight::build(texels_.size(), [](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) emit(std::span<const GroupLight>{});
        });
        double sum = 0, last = 0;
        for (out_.bounces = 0; out_.bounces < settings_.bounces_max; ++out_.bounces) {
            bounced_ = follow(outgoing(bounced_));
            if (least_.empty()) decideLeast();
            progress_.advance(1);
            const double now = flux(bounced_), step = now - sum;
            const double q = last > 0 ? step / last : 1;
            sum = now;
            last = step;
            if (!(step > 0) || (q < 1 && step * q / (1 - q) < settings_.tail_max * sum)) break;
        }
        if (out_.bounces == settings_.bounces_max)
            out_.warnings.push_back("the bounces had not died down at bounces_max; some light is missing");
        links_ = {};
        radiance_ = outgoing(bounced_);
    }

    // From the second bounce on, a set's light that is far below its activity threshold is let go: without this, every
    // set would linger everywhere at a millionth of a lux.
    void decideLeast() {
        const std::vector<GroupReport> first_bounce = thresholds();
        least_.resize(groups_);
        for (uint32_t g = 0; g < groups_; ++g) least_[g] = lingering_share * first_bounce[g].threshold_lux;
    }

    std::vector<GroupReport> thresholds() const {
        std::vector<GroupReport> reports(groups_);
        std::vector<double> indirect(groups_);
        forEachPair([&](size_t, uint32_t group, float direct, float bounced, float) {
            if (direct <= 0) return;
            ++reports[group].lit_directly;
            indirect[group] += static_cast<double>(bounced);
        });
        for (uint32_t g = 0; g < groups_; ++g) {
            GroupReport& report = reports[g];
            if (report.lit_directly == 0) continue;
            report.mean_indirect_lux = static_cast<float>(indirect[g] / static_cast<double>(report.lit_directly));
            if (g != always_group) report.threshold_lux = settings_.threshold * report.mean_indirect_lux;
        }
        return reports;
    }

    void decideActivity() {
        out_.groups = thresholds();
        std::vector<double> dropped(groups_);
        forEachPair([&](size_t i, uint32_t group, float direct, float bounced, float stored) {
            const double energy = static_cast<double>(texels_.area_m2[i] * stored);
            out_.groups[group].energy += energy;
            if (!active(group, direct, bounced)) dropped[group] += energy;
        });
        for (uint32_t g = 0; g < groups_; ++g)
            if (out_.groups[g].energy > 0) out_.groups[g].energy_dropped = dropped[g] / out_.groups[g].energy;
    }

    // Lit directly counts once it matters as much as the threshold asks of indirect light: a lamp without range lights
    // everything in sight a little.
    bool active(uint32_t group, float direct, float bounced) const {
        const float threshold = out_.groups[group].threshold_lux;
        return group == always_group || (direct > 0 && direct >= threshold) || (bounced > 0 && bounced >= threshold);
    }

    // visit(receiver, group, direct, bounced, storable), luminances in lux, for every pair that has light. Storable is
    // all of it but the direct light of lamps that a renderer draws itself.
    void forEachPair(auto&& visit) const {
        std::vector<float> direct(groups_), bounced(groups_), left_out(groups_);
        std::vector<uint32_t> here;
        for (size_t i = 0; i < texels_.size(); ++i) {
            here.clear();
            for (const GroupLight& l : direct_.row(i)) {
                direct[l.group] = luminance(l.value);
                here.push_back(l.group);
            }
            for (const GroupLight& l : bounced_.row(i)) {
                bounced[l.group] = luminance(l.value);
                here.push_back(l.group);
            }
            for (const GroupLight& l : left_to_renderer_.row(i)) left_out[l.group] = luminance(l.value);
            std::ranges::sort(here);
            here.erase(std::unique(here.begin(), here.end()), here.end());
            for (uint32_t g : here) {
                visit(i, g, direct[g], bounced[g], std::max(0.0f, direct[g] - left_out[g]) + bounced[g]);
                direct[g] = bounced[g] = left_out[g] = 0;
            }
        }
    }

    // Ascending: always-on light, then the active sets.
    void activeGroups(size_t receiver, std::vector<uint32_t>& groups) const {
        groups.assign(1, always_group);
        for (const GroupLight& l : direct_.row(receiver))
            if (l.group != always_group && active(l.group, luminance(l.value), 0)) groups.push_back(l.group);
        for (const GroupLight& l : bounced_.row(receiver))
            if (l.group != always_group && active(l.group, 0, luminance(l.value))) groups.push_back(l.group);
        std::ranges::sort(groups);
        groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    }

    void finalPass() {
        progress_.stage("final gather", texels_.size());
        std::vector<float> floors;
        for (const GroupReport& g : out_.groups) floors.push_back(noise_floor * g.mean_indirect_lux);
        const FinalGatherOptions options{.rays_max = settings_.final_rays,
                                         .emitter_samples = settings_.emitter_samples,
                                         .noise_max = settings_.noise_max,
                                         .seed = settings_.seed + 1,
                                         .floor_lux = floors};
        out_.light = Sparse<ReceiverLight>::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            FinalGather gather(gatherer_, groups_);
            std::vector<ReceiverLight> row;
            std::vector<uint32_t> groups;
            uint64_t traced = 0;
            for (size_t i = begin; i < end; ++i) {
                activeGroups(i, groups);
                row.clear();
                if (!settings_.per_set_passes) traced += gather.gather(i, groups, radiance_, options, row);
                for (size_t g = 0; settings_.per_set_passes && g < groups.size(); ++g)
                    traced += gather.gather(i, {&groups[g], 1}, radiance_, options, row);
                emit(std::span<const ReceiverLight>(row));
            }
            rays_traced_ += traced;
            progress_.advance(end - begin);
        });
        radiance_ = {};
        if (settings_.denoise) out_.light = denoise(unwrap_, texels_, std::move(out_.light), progress_);
        addStoredDirect();
        for (size_t i = 0; i < texels_.size(); ++i)
            for (const ReceiverLight& l : out_.light.row(i)) ++out_.groups[l.group].receivers;
    }

    // Direct light of fully baked lamps joins after the filter: it has no noise, and shadows have edges.
    void addStoredDirect() {
        out_.light = Sparse<ReceiverLight>::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            std::vector<ReceiverLight> row;
            for (size_t i = begin; i < end; ++i) {
                const auto gathered = out_.light.row(i);
                row.assign(gathered.begin(), gathered.end());
                for (const ReceiverLight& d : stored_direct_.row(i))
                    for (ReceiverLight& l : row)
                        if (l.group == d.group) l.light += d.light;
                emit(std::span<const ReceiverLight>(row));
            }
        });
    }

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const Texels& texels_;
    const BakeSettings& settings_;
    Progress& progress_;
    uint32_t groups_;
    EmitterSampler emitters_;
    Gatherer gatherer_;
    LightGrid grid_;
    std::vector<uint32_t> links_;  // series_rays per receiver
    SparseLight direct_, bounced_, radiance_;
    std::vector<float> least_;  // lux per group, empty before the first bounce
    SparseLight left_to_renderer_;
    Sparse<ReceiverLight> stored_direct_;
    std::atomic<uint64_t> rays_traced_ = 0;
    Baked out_;
};

}  // namespace

Baked bake(const RayScene& rays, const Unwrap& unwrap, const Texels& texels, const BakeSettings& settings,
           Progress& progress) {
    return Baker(rays, unwrap, texels, settings, progress).run();
}

}  // namespace dimmer::cook
