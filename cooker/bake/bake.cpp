#include <bake/bake.h>

#include <bake/direct.h>
#include <bake/sampling.h>

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <cmath>
#include <numeric>

namespace dimmer::cook {
namespace {

// Bounced light of a set below this share of its activity threshold does not bounce on: with the usual threshold of
// 1 %, 0.01 % of the set's mean. What that loses over a series is far below the threshold's own loss.
constexpr float lingering_share = 0.01f;

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
          gatherer_(rays, unwrap, texels, emitters_) {}

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

    // `least`, when not empty, leaves out what is fainter than that, per group.
    static void emitRow(GroupAccumulator<Gathered>& sum, std::span<const float> least, std::vector<GroupLight>& row,
                        auto& emit) {
        row.clear();
        for (uint32_t g : sum.touched())
            if (least.empty() || luminance(sum[g].irradiance_lux) >= least[g])
                row.push_back({g, sum[g].irradiance_lux});
        sum.clear();
        emit(std::span<const GroupLight>(row));
    }

    // What surfaces reflect at the first bounce: punctual light, emitters and the sky. The rays that look for emitters
    // and sky leave behind which receivers see one another: the links that the series follows.
    void directPass() {
        progress_.stage("direct light and links", texels_.size());
        links_.assign(texels_.size() * settings_.series_rays, no_index);
        std::vector<std::vector<ReceiverLight>> stored(texels_.size());
        std::vector<std::vector<GroupLight>> left_out(texels_.size());
        const GatherOptions options{settings_.series_rays, settings_.emitter_samples, settings_.seed};
        direct_ = SparseLight::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            GroupAccumulator<Gathered> sum(groups_), full(groups_);
            std::vector<GroupLight> row;
            uint64_t traced = 0;
            for (size_t i = begin; i < end; ++i) {
                traced += directLight(rays_, unwrap_, texels_, i, sum, full) + options.rays;
                for (uint32_t g : sum.touched())
                    left_out[i].push_back({g, sum[g].irradiance_lux - full[g].irradiance_lux});
                gatherer_.gather(i, options, nullptr, sum, &links_[i * settings_.series_rays]);
                for (uint32_t g : full.touched()) stored[i].push_back({g, full[g]});
                full.clear();
                emitRow(sum, {}, row, emit);
            }
            rays_traced_ += traced;
            progress_.advance(end - begin);
        });
        stored_direct_ = Sparse<ReceiverLight>::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) emit(std::span<const ReceiverLight>(stored[i]));
        });
        left_to_renderer_ = SparseLight::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) emit(std::span<const GroupLight>(left_out[i]));
        });
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
                emitRow(sum, {}, row, emit);
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
                emitRow(sum, least_, row, emit);
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
        for (uint32_t g = 1; g < groups_; ++g) {
            GroupReport& report = reports[g];
            if (report.lit_directly > 0)
                report.threshold_lux =
                    settings_.threshold * static_cast<float>(indirect[g] / static_cast<double>(report.lit_directly));
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

    void activeGroups(size_t receiver, std::vector<uint8_t>& flags) const {
        std::ranges::fill(flags, uint8_t{0});
        flags[always_group] = 1;
        for (const GroupLight& l : direct_.row(receiver))
            if (active(l.group, luminance(l.value), 0)) flags[l.group] = 1;
        for (const GroupLight& l : bounced_.row(receiver))
            if (active(l.group, 0, luminance(l.value))) flags[l.group] = 1;
    }

    void finalPass() {
        progress_.stage("final gather", texels_.size());
        const GatherOptions options{settings_.final_rays, settings_.emitter_samples, settings_.seed + 1};
        out_.light = Sparse<ReceiverLight>::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            GroupAccumulator<Gathered> sum(groups_);
            std::vector<ReceiverLight> row;
            std::vector<uint8_t> flags(groups_);
            for (size_t i = begin; i < end; ++i) {
                gatherer_.gather(i, options, &radiance_, sum, nullptr);
                for (const ReceiverLight& l : stored_direct_.row(i)) {
                    sum[l.group].irradiance_lux += l.light.irradiance_lux;
                    sum[l.group].moment_lux += l.light.moment_lux;
                }
                activeGroups(i, flags);
                row.clear();
                for (uint32_t g : sum.touched())
                    if (flags[g]) row.push_back({g, sum[g]});
                sum.clear();
                emit(std::span<const ReceiverLight>(row));
            }
            rays_traced_ += (end - begin) * options.rays;
            progress_.advance(end - begin);
        });
        for (size_t i = 0; i < texels_.size(); ++i)
            for (const ReceiverLight& l : out_.light.row(i)) ++out_.groups[l.group].receivers;
    }

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const Texels& texels_;
    const BakeSettings& settings_;
    Progress& progress_;
    uint32_t groups_;
    EmitterSampler emitters_;
    Gatherer gatherer_;
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
