#include <bake/series.h>

#include <bake/direct.h>
#include <bake/door_surroundings.h>
#include <bake/links.h>
#include <bake/sampling.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

namespace dimmer::cook {
namespace {

// Bounced light of a set below this share of its activity threshold does not bounce on: with the usual threshold of
// 1 %, 0.01 % of the set's mean. What that loses over a series is far below the threshold's own loss. Larger thresholds
// let no more go: the series, and so what is cached of it, is the same for all of them.
constexpr float lingering_share = 0.01f;
// Texels to each side that tell whether light is active at one.
constexpr int activity_reach = 2;
constexpr float around_texel_sizes = 4;  // from corner to corner of so many texels, wherever in them samples lie
constexpr float lingering_threshold_max = 0.01f;
// Terms with doors are many, and their thresholds a few thousandths of the light around the door.
constexpr float door_lingering_share = 0.1f;

// A term with doors ends at the threshold's share of so many times the mean of what its group changes around the door.
// What lies below is then about as little of the change as what other terms lose is of their light: the mean counts
// many receivers that the door hardly changes, theirs only such as are lit straight.
constexpr float door_change_factor = 3;

// Few rays find their way through a door, and what they find there is spread over the whole room by the bounces that
// follow, where no later ray mends it. So many times as many look for doors alone.
constexpr uint32_t door_rays_per_ray = 1;

// After so many rounds each group's light leaps by what its last step announces; see bounce(). Earlier the steps do not
// shrink evenly yet, later there is less to gain.
constexpr uint32_t rounds_before_leap = 6;
// Links are random, and each costs a trip to memory: asked for so many links ahead.
constexpr size_t links_ahead = 8;

class Expansion {
   public:
    Expansion(const Gatherer& gatherer, const BakeSettings& settings, Progress& progress,
              std::span<const uint8_t> groups, RayEnds* ends)
        : gatherer_(gatherer),
          receivers_(gatherer.receiverCount()),
          settings_(settings),
          progress_(progress),
          grid_(gatherer.rays(), settings.light_grid, groups),
          paths_(gatherer.paths()),
          terms_(paths_.termCount()),
          ends_(ends),
          running_(groups.begin(), groups.end()) {
        if (running_.empty()) running_.assign(paths_.groupCount(), 1);
        followed_in_group_.resize(paths_.groupCount());
        for (const Term& term : paths_.terms()) followed_in_group_[term.group] += running_[term.group];
    }

    Series run() {
        directPass(UINT32_MAX);
        bounce();
        out_.radiance = outgoing(out_.bounced, true);
        decideActivity();
        out_.rays = rays_traced_;
        out_.doors_seen = std::move(doors_seen_);
        return std::move(out_);
    }

    std::vector<double> flux() {
        directPass(1);
        bounce();
        std::vector<double> sums(terms_);
        forEachPair([&](size_t i, uint32_t t, float, float, float stored) {
            sums[t] += static_cast<double>(gatherer_.areaM2(i) * stored);
        });
        return sums;
    }

   private:
    // Moves `sum` to a row.
    template <class Value>
    static void takeRow(TermAccumulator<Value>& sum, std::vector<TermLight>& row) {
        row.clear();
        for (uint32_t t : sum.touched()) row.push_back({t, irradianceOf(sum[t])});
        sum.clear();
    }
    static glm::vec3 irradianceOf(const Gathered& light) { return light.irradiance_lux; }
    static glm::vec3 irradianceOf(glm::vec3 lux) { return lux; }

    // What surfaces reflect at the first bounce: punctual light, emitters and the sky. The rays that look for emitters
    // and sky leave behind which receivers see one another: the links that the series follows.
    // `light_points`: each lamp is asked for from so many of a receiver's points at most.
    void directPass(uint32_t light_points) {
        progress_.stage("direct light and links", receivers_);
        links_ = Links(receivers_, settings_.series_rays);
        const bool remembers = ends_ && ends_->rows() == 0;
        if (remembers) *ends_ = RayEnds(receivers_, static_cast<uint32_t>(receivers_), gatherer_.paths().pathCount());
        const RayEnds* known = remembers ? nullptr : ends_;
        GatherOptions options;
        options.rays = settings_.series_rays;
        options.door_rays = door_rays_per_ray * settings_.series_rays;
        options.emitter_samples = settings_.emitter_samples;
        options.seed = settings_.seed;
        options.wanted_in_group = followed_in_group_;
        SparseLight::Builder direct(receivers_), left_to_renderer(receivers_);
        Sparse<ReceiverLight>::Builder stored(receivers_);
        Sparse<GatherLinks::ThroughDoors>::Builder door_links(receivers_);
        Sparse<uint32_t>::Builder doors_seen(receivers_);
        forEachBlock(receivers_, [&](size_t begin, size_t end) {
            TermAccumulator<Gathered> sum(terms_), full(terms_);
            for (uint32_t t = 0; t < terms_; ++t) sum.setWanted(t, runs(t));
            std::vector<TermLight> row, left_row;
            std::vector<ReceiverLight> stored_row;
            std::vector<uint32_t> hits(settings_.series_rays);
            GatherLinks links;
            RowEnds ends;
            std::vector<RowEnds> all_ends;
            GatherOptions own_options = options;
            uint64_t traced = 0;
            for (size_t i = begin; i < end; ++i) {
                ends.ends.assign(ends_ ? options.rays : 0, RayEnd::unknown);
                if (known) known->get(i, ends);
                own_options.row = ends.ends.size() < options.rays ? nullptr : &ends;
                traced += directLight(gatherer_, grid_, gatherer_.at(i), sum, full, light_points) + options.rays;
                left_row.clear();
                for (uint32_t t : sum.touched()) {
                    const glm::vec3 left = sum[t].irradiance_lux - full[t].irradiance_lux;
                    if (luminance(left) > 0) left_row.push_back({t, left});
                }
                stored_row.clear();
                for (uint32_t t : full.touched())
                    if (luminance(full[t].irradiance_lux) > 0) stored_row.push_back({t, full[t]});
                full.clear();
                std::ranges::fill(hits, no_index);
                links = {hits, {}, {}};
                gatherer_.gather(gatherer_.at(i), own_options, nullptr, sum, &links);
                links_.put(i, hits);
                if (remembers) all_ends.push_back(ends);
                std::ranges::sort(links.doors);
                links.doors.erase(std::unique(links.doors.begin(), links.doors.end()), links.doors.end());
                door_links.put(i, links.through_doors);
                doors_seen.put(i, links.doors);
                takeRow(sum, row);
                direct.put(i, row);
                left_to_renderer.put(i, left_row);
                stored.put(i, stored_row);
            }
            if (remembers) ends_->putBlock(begin / rows_per_block, all_ends);
            rays_traced_ += traced;
            progress_.advance(end - begin);
        });
        door_links_ = door_links.finish();
        doors_seen_ = doors_seen.finish();
        out_.direct = direct.finish();
        out_.left_to_renderer = left_to_renderer.finish();
        out_.stored_direct = stored.finish();
    }

    bool runs(uint32_t term) const { return running_[paths_.terms()[term].group] != 0; }

    // What leaves each receiver: rho / pi * (direct + bounced so far), of the groups that still run or of all.
    SparseLight outgoing(const SparseLight& bounced, bool all) const {
        return SparseLight::build(receivers_, [&](size_t begin, size_t end, auto emit) {
            TermAccumulator<glm::vec3> sum(terms_);
            std::vector<TermLight> row;
            for (size_t i = begin; i < end; ++i) {
                const glm::vec3 reflect = gatherer_.reflectance(i) / pi;
                const uint32_t own = gatherer_.conditionOf(i);
                for (const auto* part : {&out_.direct, &bounced})
                    for (const TermLight& l : part->row(i)) {
                        const uint32_t term = all || runs(l.term) ? paths_.leaving(l.term, own) : no_term;
                        if (term != no_term) sum[term] += reflect * l.value;
                    }
                takeRow(sum, row);
                emit(std::span<const TermLight>(row));
            }
        });
    }

    // A row's entry as it lies in memory, added up as it is: the term's number is added along, and never read.
    struct Sum {
        using Four [[gnu::vector_size(16)]] = float;
        Four entry = {0, 0, 0, 0};

        void operator+=(const TermLight& l) {
            static_assert(sizeof(TermLight) == sizeof(Four) && offsetof(TermLight, value) == sizeof(float));
            Four other;
            std::memcpy(&other, &l, sizeof other);
            entry += other;
        }
        void add(const TermLight& l, float share) { entry += Four{0, l.value.x, l.value.y, l.value.z} * share; }
        glm::vec3 operator*(float s) const { return glm::vec3(entry[1], entry[2], entry[3]) * s; }
    };

    // One more bounce along the links, of the groups that still run; of the others, what `bounced` has.
    SparseLight follow(const SparseLight& radiance, const SparseLight& bounced) const {
        const float lux_per_radiance = pi / static_cast<float>(settings_.series_rays);
        constexpr float share_through_doors = 1.0f / (1 + door_rays_per_ray);
        return SparseLight::build(receivers_, [&](size_t begin, size_t end, auto emit) {
            TermAccumulator<Sum> sum(terms_);
            std::vector<TermLight> row;
            std::vector<uint32_t> hits(settings_.series_rays);
            for (size_t i = begin; i < end; ++i) {
                const uint32_t own = gatherer_.conditionOf(i);
                links_.get(i, hits);
                for (size_t k = 0; k < hits.size(); ++k) {
                    if (k + links_ahead < hits.size() && hits[k + links_ahead] != no_index)
                        radiance.prefetch(hits[k + links_ahead]);
                    if (hits[k] == no_index) continue;
                    if (own == no_condition)
                        for (const TermLight& l : radiance.row(hits[k])) sum[l.term] += l;
                    else
                        addMoved(radiance.row(hits[k]), free_path, own, 1, sum);
                }
                for (const GatherLinks::ThroughDoors& link : door_links_.row(i))
                    addMoved(radiance.row(link.receiver), link.path, own, share_through_doors, sum);
                row.clear();
                for (const uint32_t t : sum.touched())
                    if (const glm::vec3 lux = sum[t] * lux_per_radiance; least_.empty() || luminance(lux) >= least_[t])
                        row.push_back({t, lux});
                sum.clear();
                const size_t followed = row.size();
                for (const TermLight& l : bounced.row(i))
                    if (!runs(l.term)) row.push_back(l);
                if (row.size() > followed) std::ranges::sort(row, {}, &TermLight::term);
                emit(std::span<const TermLight>(row));
            }
        });
    }

    void addMoved(std::span<const TermLight> light, uint32_t path, uint32_t own, float share,
                  TermAccumulator<Sum>& sum) const {
        for (const TermLight& l : light)
            if (const uint32_t term = paths_.moved(l.term, path, own); term != no_term) sum[term].add(l, share);
    }

    // visit(receiver, entry of `after`, what `before` has of it), in order.
    static void forEachStep(const SparseLight& before, const SparseLight& after, size_t begin, size_t end,
                            auto&& visit) {
        for (size_t i = begin; i < end; ++i) {
            const auto old = before.row(i);
            auto at = old.begin();
            for (const TermLight& l : after.row(i)) {
                while (at != old.end() && at->term < l.term) ++at;
                visit(i, l, at != old.end() && at->term == l.term ? at->value : glm::vec3(0));
            }
        }
    }

    // Of one light group, lm.
    struct Flux {
        double sum = 0, step = 0;  // bounced so far; what the last round changed, either way
        double ratio = 1;          // of the last two steps
        double ratio_at_leap = 0;
    };

    void measure(const SparseLight& before, std::vector<Flux>& groups) const {
        std::vector<Flux> now(groups.size());
        forEachStep(before, out_.bounced, 0, receivers_, [&](size_t i, const TermLight& l, glm::vec3 old) {
            Flux& group = now[paths_.terms()[l.term].group];
            const float area_m2 = gatherer_.areaM2(i);
            group.sum += static_cast<double>(area_m2 * luminance(l.value));
            group.step += static_cast<double>(area_m2 * std::abs(luminance(l.value - old)));
        });
        for (size_t g = 0; g < groups.size(); ++g) {
            if (!running_[g]) continue;
            groups[g].ratio = groups[g].step > 0 ? now[g].step / groups[g].step : 1;
            groups[g].sum = now[g].sum;
            groups[g].step = now[g].step;
        }
    }

    // What is still to come adds up to the last step times q / (1 - q), when every step is q times the one before:
    // adds that to the light of the groups that still run.
    SparseLight leap(const SparseLight& before, const std::vector<Flux>& groups) const {
        return SparseLight::build(receivers_, [&](size_t begin, size_t end, auto emit) {
            std::vector<TermLight> row;
            size_t current = begin;
            const auto emitUpTo = [&](size_t i) {
                for (; current < i; ++current, row.clear()) emit(std::span<const TermLight>(row));
            };
            forEachStep(before, out_.bounced, begin, end, [&](size_t i, const TermLight& l, glm::vec3 old) {
                emitUpTo(i);
                const double q = runs(l.term) ? groups[paths_.terms()[l.term].group].ratio_at_leap : 0;
                row.push_back({l.term, glm::max(l.value + static_cast<float>(q / (1 - q)) * (l.value - old), 0.0f)});
            });
            emitUpTo(end);
        });
    }

    // Running sum: each round follows the whole light once, so round n holds bounces 1 to n. Once the steps shrink
    // evenly, the light leaps to where they lead; the rounds after that mend what the leap got wrong from place to
    // place. Each group ends when what is still to come of its own light is little.
    void bounce() {
        progress_.stage("bounces", settings_.bounces_max);
        out_.bounced = SparseLight::build(receivers_, [](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) emit(std::span<const TermLight>{});
        });
        out_.bounces.assign(paths_.groupCount(), 0);
        std::vector<Flux> groups(paths_.groupCount());
        for (uint32_t n = 0; n < settings_.bounces_max && std::ranges::count(running_, 1) > 0; ++n) {
            const SparseLight before = std::move(out_.bounced);
            out_.bounced = follow(outgoing(before, false), before);
            decideLeast(n);
            progress_.advance(1);
            measure(before, groups);
            bool any_leaps = false;
            for (uint32_t g = 0; g < paths_.groupCount(); ++g) {
                if (!running_[g]) continue;
                Flux& group = groups[g];
                const double q = std::max(group.ratio, group.ratio_at_leap);
                if (!(group.step > 0) || (q < 1 && group.step * q / (1 - q) < settings_.tail_max * group.sum)) {
                    running_[g] = 0;
                    continue;
                }
                ++out_.bounces[g];
                if (n + 1 != rounds_before_leap || !(q < 1)) continue;
                group.ratio_at_leap = q;
                any_leaps = true;
            }
            if (any_leaps) out_.bounced = leap(before, groups);
        }
        links_ = {};
        door_links_ = {};
    }

    // From the second bounce on, a set's light that is far below its activity threshold is let go: without this, every
    // set would linger everywhere at a millionth of a lux. Light through several doors takes several bounces to appear.
    void decideLeast(uint32_t round) {
        const bool first = least_.empty();
        if (!first && (terms_ == paths_.groupCount() || !std::has_single_bit(round + 1))) return;
        const std::vector<TermReport> reports = thresholds(lingering_threshold_max);
        least_.resize(terms_);
        for (uint32_t t = first ? 0 : paths_.groupCount(); t < terms_; ++t)
            least_[t] = (t < paths_.groupCount() ? lingering_share : door_lingering_share) * reports[t].threshold_lux;
    }

    // `most`: no threshold is taken to be larger.
    std::vector<TermReport> thresholds(float most) const {
        std::vector<TermReport> reports(terms_);
        std::vector<double> sums(terms_);
        DoorSurroundings around(paths_, doors_seen_);
        forEachPair([&](size_t i, uint32_t t, float direct, float bounced, float stored) {
            around.add(i, t, stored);
            const bool counts = t < paths_.groupCount() ? direct > 0 : seesDoorOf(i, t);
            if (!counts) return;
            ++reports[t].measured_over;
            sums[t] += static_cast<double>(t < paths_.groupCount() ? bounced : stored);
        });
        for (uint32_t t = 0; t < terms_; ++t) {
            TermReport& report = reports[t];
            if (report.measured_over > 0)
                report.mean_lux = static_cast<float>(sums[t] / static_cast<double>(report.measured_over));
            if (t == always_group) continue;
            const Term& term = paths_.terms()[t];
            const float base = term.free() ? report.mean_lux : doorBase(term, reports[term.group].mean_lux, around);
            report.threshold_lux = std::min(settings_.thresholdOf(term.group), most) * base;
        }
        return reports;
    }

    // Beside the group's other light a door's may be faint, and yet all that there is behind the door.
    float doorBase(const Term& term, float group_mean_lux, const DoorSurroundings& around) const {
        const float of_others = std::max(group_mean_lux, around.light(term));
        return std::clamp(door_change_factor * around.changed(term), settings_.door_share * of_others, of_others);
    }

    bool seesDoorOf(size_t receiver, uint32_t term) const {
        return std::ranges::any_of(doors_seen_.row(receiver),
                                   [&](uint32_t door) { return paths_.terms()[term].isAbout(door); });
    }

    // By bounced light over neighbouring texels: by its own few rays a receiver that saw little would be cut and its
    // neighbour that saw much be kept, which leaves faint light too dark and terms' regions ragged.
    void decideActivity() {
        out_.reports = thresholds(1);
        for (uint32_t t = 0; t < terms_; ++t) {
            const float share = settings_.thresholdOf(paths_.terms()[t].group);
            out_.threshold_base.push_back(share > 0 ? out_.reports[t].threshold_lux / share : 0.0f);
        }
        SparseLight active = activeAround(out_.bounced);
        std::vector<double> dropped(terms_);
        forEachPair([&](size_t i, uint32_t t, float direct, float, float stored) {
            const double energy = static_cast<double>(gatherer_.areaM2(i) * stored);
            out_.reports[t].energy += energy;
            const auto row = active.row(i);
            bool kept = out_.active(t, direct, 0);
            for (uint32_t into = t; !kept && into != no_term; into = paths_.lessClosed(into))
                kept = std::ranges::find(row, into, &TermLight::term) != row.end();
            if (!kept) dropped[t] += energy;
        });
        for (uint32_t t = 0; t < terms_; ++t)
            if (out_.reports[t].energy > 0) out_.reports[t].energy_dropped = dropped[t] / out_.reports[t].energy;
        out_.bounced = std::move(active);
    }

    // The mean of what the texels around in the same chart have (models' receivers: their own), where it is active.
    SparseLight activeAround(const SparseLight& bounced) const {
        const size_t texels = gatherer_.texels().size();
        return SparseLight::build(receivers_, [&](size_t begin, size_t end, auto emit) {
            TermAccumulator<glm::vec3> sum(terms_);
            std::vector<TermLight> row;
            for (size_t i = begin; i < end; ++i) {
                float count = 0;
                const auto add = [&](size_t receiver) {
                    ++count;
                    for (const TermLight& l : bounced.row(receiver)) sum[l.term] += l.value;
                };
                if (i < texels)
                    forEachAround(i, add);
                else
                    add(i);
                takeRow(sum, row);
                for (TermLight& l : row) l.value /= count;
                std::erase_if(row, [&](const TermLight& l) { return !out_.active(l.term, 0, luminance(l.value)); });
                emit(std::span<const TermLight>(row));
            }
        });
    }

    // Charts that came with the level may hold islands that only the page has side by side.
    bool nearInSpace(size_t a, size_t b) const {
        const Texels& texels = gatherer_.texels();
        const float size_m = std::sqrt(std::max(texels.area_m2[a], texels.area_m2[b]));
        return glm::distance(texels.sample(a, 0).position_m, texels.sample(b, 0).position_m) <=
               around_texel_sizes * size_m;
    }

    void forEachAround(size_t texel, auto&& visit) const {
        for (int dy = -activity_reach; dy <= activity_reach; ++dy)
            for (int dx = -activity_reach; dx <= activity_reach; ++dx) {
                const uint32_t other = neighbourInChart(gatherer_.unwrap(), gatherer_.texels(), texel, dx, dy);
                if (other != no_index && nearInSpace(texel, other)) visit(other);
            }
    }

    // visit(receiver, term, direct, bounced, storable), luminances in lux, for every pair that has light. Storable is
    // all of it but the direct light of lamps that a renderer draws itself.
    void forEachPair(auto&& visit) const {
        std::vector<float> direct(terms_), bounced(terms_), left_out(terms_);
        std::vector<uint32_t> here;
        for (size_t i = 0; i < receivers_; ++i) {
            here.clear();
            for (const TermLight& l : out_.direct.row(i)) {
                direct[l.term] = luminance(l.value);
                here.push_back(l.term);
            }
            for (const TermLight& l : out_.bounced.row(i)) {
                bounced[l.term] = luminance(l.value);
                here.push_back(l.term);
            }
            for (const TermLight& l : out_.left_to_renderer.row(i)) left_out[l.term] = luminance(l.value);
            std::ranges::sort(here);
            here.erase(std::unique(here.begin(), here.end()), here.end());
            for (uint32_t t : here) {
                visit(i, t, direct[t], bounced[t], std::max(0.0f, direct[t] - left_out[t]) + bounced[t]);
                direct[t] = bounced[t] = left_out[t] = 0;
            }
        }
    }

    const Gatherer& gatherer_;
    size_t receivers_;  // texels, then those of models
    const BakeSettings& settings_;
    Progress& progress_;
    LightGrid grid_;
    const DoorPaths& paths_;
    uint32_t terms_;
    RayEnds* ends_;                            // may be null
    std::vector<uint8_t> running_;             // per light group: its light is still followed
    std::vector<uint32_t> followed_in_group_;  // terms per light group, 0 for groups that are not asked for
    Links links_;                              // series_rays of each receiver
    Sparse<GatherLinks::ThroughDoors> door_links_;
    Sparse<uint32_t> doors_seen_;
    std::vector<float> least_;  // lux per term, empty before the first bounce
    std::atomic<uint64_t> rays_traced_ = 0;
    Series out_;
};

}  // namespace

bool isActive(const TermReport& report, uint32_t term, float direct_lux, float bounced_lux) {
    const float threshold = report.threshold_lux;
    return term == always_group || (direct_lux > 0 && direct_lux >= threshold) ||
           (bounced_lux > 0 && bounced_lux >= threshold);
}

float Series::keepUpTo(size_t receiver, uint32_t term) const {
    float brightest = 0;
    for (const auto* part : {&direct, &bounced})
        for (const TermLight& l : part->row(receiver))
            if (l.term == term) brightest = std::max(brightest, luminance(l.value));
    const float base = term == always_group ? 0 : threshold_base[term];
    return base > 0 ? brightest / base : std::numeric_limits<float>::infinity();
}

void Series::activeTerms(size_t receiver, std::vector<uint32_t>& terms) const {
    terms.assign(1, always_group);
    for (const TermLight& l : direct.row(receiver))
        if (l.term != always_group && active(l.term, luminance(l.value), 0)) terms.push_back(l.term);
    for (const TermLight& l : bounced.row(receiver))
        if (l.term != always_group && active(l.term, 0, luminance(l.value))) terms.push_back(l.term);
    std::ranges::sort(terms);
    terms.erase(std::unique(terms.begin(), terms.end()), terms.end());
}

Series expandSeries(const Gatherer& gatherer, const BakeSettings& settings, Progress& progress,
                    std::span<const uint8_t> groups, RayEnds* links) {
    return Expansion(gatherer, settings, progress, groups, links).run();
}

std::vector<double> termFlux(const Gatherer& gatherer, const BakeSettings& settings, Progress& progress,
                             std::span<const uint8_t> groups, RayEnds* links) {
    return Expansion(gatherer, settings, progress, groups, links).flux();
}

}  // namespace dimmer::cook
