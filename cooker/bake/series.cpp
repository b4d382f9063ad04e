#include <bake/series.h>

#include <bake/direct.h>
#include <bake/sampling.h>

#include <atomic>
#include <cmath>

namespace dimmer::cook {
namespace {

// Bounced light of a set below this share of its activity threshold does not bounce on: with the usual threshold of
// 1 %, 0.01 % of the set's mean. What that loses over a series is far below the threshold's own loss.
constexpr float lingering_share = 0.01f;

class Expansion {
   public:
    Expansion(const Gatherer& gatherer, const BakeSettings& settings, Progress& progress)
        : gatherer_(gatherer),
          texels_(gatherer.texels()),
          settings_(settings),
          progress_(progress),
          grid_(gatherer.rays(), settings.light_grid),
          groups_(1 + static_cast<uint32_t>(gatherer.rays().scene().light_sets.size())) {}

    Series run() {
        directPass();
        bounce();
        decideActivity();
        out_.rays = rays_traced_;
        return std::move(out_);
    }

   private:
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
                traced +=
                    directLight(gatherer_.rays(), grid_, gatherer_.unwrap(), texels_, i, sum, full) + options.rays;
                left_row.clear();
                for (uint32_t g : sum.touched()) {
                    const glm::vec3 left = sum[g].irradiance_lux - full[g].irradiance_lux;
                    if (luminance(left) > 0) left_row.push_back({g, left});
                }
                stored_row.clear();
                for (uint32_t g : full.touched())
                    if (luminance(full[g].irradiance_lux) > 0) stored_row.push_back({g, full[g]});
                full.clear();
                gatherer_.gather(gatherer_.at(i), options, nullptr, sum, &links_[i * settings_.series_rays]);
                takeRow(sum, {}, row);
                direct.put(i, row);
                left_to_renderer.put(i, left_row);
                stored.put(i, stored_row);
            }
            rays_traced_ += traced;
            progress_.advance(end - begin);
        });
        out_.direct = direct.finish();
        out_.left_to_renderer = left_to_renderer.finish();
        out_.stored_direct = stored.finish();
    }

    // What leaves each receiver: rho / pi * (direct + bounced so far).
    SparseLight outgoing(const SparseLight& bounced) const {
        return SparseLight::build(texels_.size(), [&](size_t begin, size_t end, auto emit) {
            GroupAccumulator<Gathered> sum(groups_);
            std::vector<GroupLight> row;
            for (size_t i = begin; i < end; ++i) {
                const glm::vec3 reflect = texels_.reflectance[i] / pi;
                for (const auto* part : {&out_.direct, &bounced})
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
    void bounce() {
        progress_.stage("bounces", settings_.bounces_max);
        out_.bounced = SparseLight::build(texels_.size(), [](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) emit(std::span<const GroupLight>{});
        });
        double sum = 0, last = 0;
        for (out_.bounces = 0; out_.bounces < settings_.bounces_max; ++out_.bounces) {
            out_.bounced = follow(outgoing(out_.bounced));
            if (least_.empty()) decideLeast();
            progress_.advance(1);
            const double now = flux(out_.bounced), step = now - sum;
            const double q = last > 0 ? step / last : 1;
            sum = now;
            last = step;
            if (!(step > 0) || (q < 1 && step * q / (1 - q) < settings_.tail_max * sum)) break;
        }
        if (out_.bounces == settings_.bounces_max)
            out_.warnings.push_back("the bounces had not died down at bounces_max; some light is missing");
        links_ = {};
        out_.radiance = outgoing(out_.bounced);
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
            if (!out_.active(group, direct, bounced)) dropped[group] += energy;
        });
        for (uint32_t g = 0; g < groups_; ++g)
            if (out_.groups[g].energy > 0) out_.groups[g].energy_dropped = dropped[g] / out_.groups[g].energy;
    }

    // visit(receiver, group, direct, bounced, storable), luminances in lux, for every pair that has light. Storable is
    // all of it but the direct light of lamps that a renderer draws itself.
    void forEachPair(auto&& visit) const {
        std::vector<float> direct(groups_), bounced(groups_), left_out(groups_);
        std::vector<uint32_t> here;
        for (size_t i = 0; i < texels_.size(); ++i) {
            here.clear();
            for (const GroupLight& l : out_.direct.row(i)) {
                direct[l.group] = luminance(l.value);
                here.push_back(l.group);
            }
            for (const GroupLight& l : out_.bounced.row(i)) {
                bounced[l.group] = luminance(l.value);
                here.push_back(l.group);
            }
            for (const GroupLight& l : out_.left_to_renderer.row(i)) left_out[l.group] = luminance(l.value);
            std::ranges::sort(here);
            here.erase(std::unique(here.begin(), here.end()), here.end());
            for (uint32_t g : here) {
                visit(i, g, direct[g], bounced[g], std::max(0.0f, direct[g] - left_out[g]) + bounced[g]);
                direct[g] = bounced[g] = left_out[g] = 0;
            }
        }
    }

    const Gatherer& gatherer_;
    const Texels& texels_;
    const BakeSettings& settings_;
    Progress& progress_;
    LightGrid grid_;
    uint32_t groups_;
    std::vector<uint32_t> links_;  // series_rays per receiver
    std::vector<float> least_;     // lux per group, empty before the first bounce
    std::atomic<uint64_t> rays_traced_ = 0;
    Series out_;
};

}  // namespace

bool Series::active(uint32_t group, float direct_lux, float bounced_lux) const {
    const float threshold = groups[group].threshold_lux;
    return group == always_group || (direct_lux > 0 && direct_lux >= threshold) ||
           (bounced_lux > 0 && bounced_lux >= threshold);
}

void Series::activeGroups(size_t receiver, std::vector<uint32_t>& active_groups) const {
    active_groups.assign(1, always_group);
    for (const GroupLight& l : direct.row(receiver))
        if (l.group != always_group && active(l.group, luminance(l.value), 0)) active_groups.push_back(l.group);
    for (const GroupLight& l : bounced.row(receiver))
        if (l.group != always_group && active(l.group, 0, luminance(l.value))) active_groups.push_back(l.group);
    std::ranges::sort(active_groups);
    active_groups.erase(std::unique(active_groups.begin(), active_groups.end()), active_groups.end());
}

Series expandSeries(const Gatherer& gatherer, const BakeSettings& settings, Progress& progress) {
    return Expansion(gatherer, settings, progress).run();
}

}  // namespace dimmer::cook
