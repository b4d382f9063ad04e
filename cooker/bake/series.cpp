#include <bake/series.h>

#include <bake/activity.h>
#include <bake/convergence.h>
#include <bake/direct.h>
#include <bake/door_pairs.h>
#include <bake/final_gather.h>
#include <bake/links.h>
#include <bake/receiver_blocks.h>
#include <bake/sampling.h>
#include <bake/sums.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <utility>

namespace dimmer::cook {
namespace {

// Bounced light of a set below this share of its activity threshold does not bounce on: with the usual threshold of
// 1 %, 0.01 % of the set's mean. What that loses over a series is far below the threshold's own loss. Larger thresholds
// let no more go: the series, and so what is cached of it, is the same for all of them.
constexpr float lingering_share = 0.01f;
constexpr float lingering_threshold_max = 0.01f;
// Terms with doors are many, and their thresholds a few thousandths of the light around the door.
constexpr float door_lingering_share = 0.1f;

// Few rays find their way through a door, and what they find there is spread over the whole room by the bounces that
// follow, where no later ray mends it. So many times as many look for doors alone.
constexpr uint32_t door_rays_per_ray = 1;

// What a texel sends back of an emitter is asked for once, of a few of its points: that many samples more than a round
// of the final gather takes, or a lamp of centimetres beside a wall lights a room by as much as chance finds of it.
constexpr uint32_t emitter_samples_more = 4;

uint32_t samplesOfEmitters(const BakeSettings& settings) {
    const uint32_t by_rays = emitter_samples_more * settings.emitter_samples * settings.series_rays / rays_per_round;
    return std::max(settings.emitter_samples, by_rays);
}

// Links are random, and each costs a trip to memory: asked for so many links ahead.
constexpr size_t links_ahead = 8;

class Expansion {
   public:
    Expansion(const Gatherer& gatherer, const LightGrid& lights, const BakeSettings& settings, Progress& progress,
              std::span<const uint8_t> groups, RayEnds* ends, std::string_view what_for = "")
        : gatherer_(gatherer),
          receivers_(gatherer.receiverCount()),
          settings_(settings),
          progress_(progress),
          lights_(lights.ofGroups(groups)),
          paths_(gatherer.paths()),
          terms_(paths_.termCount()),
          ends_(ends),
          what_for_(what_for),
          activity_(gatherer, settings, doors_seen_),
          running_(groups.begin(), groups.end()) {
        if (running_.empty()) running_.assign(paths_.groupCount(), 1);
        followed_in_group_.resize(paths_.groupCount());
        for (const Term& term : paths_.terms()) followed_in_group_[term.group] += running_[term.group];
    }

    Series run() {
        directPass(UINT32_MAX);
        out_.doors_near = doorsNear(links_, doors_seen_);
        bounce();
        activity_.measure(out_);
        // Two thirds of what rays would read in a level of many sets lies below its threshold.
        out_.radiance = leavingReceivers(out_.bounced, faint());
        activity_.decide(out_);
        out_.rays = rays_traced_;
        out_.doors_seen = std::move(doors_seen_);
        return std::move(out_);
    }

    std::vector<double> flux() {
        directPass(1);
        bounce();
        return activity_.flux(out_);
    }

   private:
    // Moves `sum` to a row.
    template <class Value>
    static void takeRow(TermAccumulator<Value>& sum, const Rounding& rounding, std::vector<TermLight>& row) {
        row.clear();
        for (uint32_t t : sum.touched())
            if (const glm::vec3 lux = irradianceOf(sum[t]); lux != glm::vec3(0)) row.emplace_back(t, lux, rounding);
        sum.clear();
    }
    static glm::vec3 irradianceOf(const Gathered& light) { return light.irradiance_lux; }
    static glm::vec3 irradianceOf(glm::vec3 lux) { return lux; }

    // What surfaces reflect at the first bounce: punctual light, emitters and the sky. The rays that look for emitters
    // and sky leave behind which receivers see one another: the links that the series follows.
    // `light_points`: each lamp is asked for from so many of a receiver's points at most.
    void directPass(uint32_t light_points) {
        progress_.stage("direct light and links" + what_for_, receivers_);
        const bool remembers = ends_ && ends_->rows() == 0;
        if (remembers) *ends_ = RayEnds(receivers_, static_cast<uint32_t>(receivers_), gatherer_.paths().pathCount());
        const RayEnds* known = remembers ? nullptr : ends_;
        GatherOptions options;
        options.rays = settings_.series_rays;
        options.door_rays = door_rays_per_ray * settings_.series_rays;
        options.emitter_samples = samplesOfEmitters(settings_);
        options.seed = settings_.seed;
        options.wanted_in_group = followed_in_group_;
        SparseLight::Builder direct(receivers_), left_to_renderer(receivers_);
        Sparse<ReceiverLight>::Builder stored(receivers_);
        Links::Builder all_links(receivers_);
        Sparse<uint32_t>::Builder doors_seen(receivers_);
        forEachBlock(receivers_, [&](size_t begin, size_t end) {
            TermAccumulator<Gathered> sum(terms_), full(terms_);
            for (uint32_t t = 0; t < terms_; ++t) sum.setWanted(t, runs(t));
            std::vector<TermLight> row, left_row;
            std::vector<ReceiverLight> stored_row;
            std::vector<uint32_t> hits(settings_.series_rays);
            std::vector<SamplePoint> points;
            GatherLinks links;
            std::vector<Link> followed;
            RowEnds ends;
            std::vector<RowEnds> all_ends;
            GatherOptions own_options = options;
            uint64_t traced = 0;
            for (size_t i = begin; i < end; ++i) {
                ends.ends.assign(ends_ ? options.rays : 0, RayEnd::unknown);
                if (known) known->get(i, ends);
                own_options.row = ends.ends.size() < options.rays ? nullptr : &ends;
                const Rounding rounding(i, Rounding::Of::Direct);
                const GatherFrom from = gatherer_.at(i, points);
                traced += directLight(gatherer_, lights_, from, sum, full, light_points) + options.rays;
                left_row.clear();
                for (uint32_t t : sum.touched()) {
                    const glm::vec3 left = sum[t].irradiance_lux - full[t].irradiance_lux;
                    if (luminance(left) > 0) left_row.emplace_back(t, left, rounding);
                }
                stored_row.clear();
                for (uint32_t t : full.touched())
                    if (luminance(full[t].irradiance_lux) > 0) stored_row.push_back({t, full[t]});
                full.clear();
                std::ranges::fill(hits, no_index);
                links = {hits, {}, {}};
                gatherer_.gather(from, own_options, nullptr, sum, &links);
                followed = links.through_doors;
                for (const uint32_t hit : hits)
                    if (hit != no_index) followed.push_back({hit, free_path});
                all_links.put(i, followed);
                if (remembers) all_ends.push_back(ends);
                std::ranges::sort(links.doors);
                links.doors.erase(std::unique(links.doors.begin(), links.doors.end()), links.doors.end());
                doors_seen.put(i, links.doors);
                takeRow(sum, rounding, row);
                direct.put(i, row);
                left_to_renderer.put(i, left_row);
                stored.put(i, stored_row);
            }
            // At once, or what blocks reserve while they are filled would add up.
            all_links.close(begin);
            doors_seen.close(begin);
            direct.close(begin);
            left_to_renderer.close(begin);
            stored.close(begin);
            if (remembers) ends_->putBlock(begin / rows_per_block, all_ends);
            rays_traced_ += traced;
            progress_.advance(end - begin);
        });
        links_ = all_links.finish();
        doors_seen_ = doors_seen.finish();
        out_.direct = direct.finish();
        out_.left_to_renderer = left_to_renderer.finish();
        out_.stored_direct = stored.finish();
    }

    bool runs(uint32_t term) const { return running_[paths_.terms()[term].group] != 0; }

    // As ReceiverBlocks has them.
    struct Receivers {
        const Gatherer& gatherer;
        size_t size() const { return gatherer.receiverCount(); }
        glm::vec3 reflectance(size_t i) const { return gatherer.reflectance(i); }
        uint32_t condition(size_t i) const { return gatherer.conditionOf(i); }
    };

    // What leaves each place, a receiver or a block of them: rho / pi * (direct + bounced so far), of the groups that
    // still run or of all. `faint_lux`: as faint() has it, or empty: all stays as it is.
    SparseLight outgoing(const auto& places, const SparseLight& direct, const SparseLight& bounced, bool all,
                         Rounding::Of rounding, std::span<const float> faint_lux = {}) const {
        return SparseLight::build(places.size(), [&](size_t begin, size_t end, auto emit) {
            TermAccumulator<glm::vec3> sum(terms_);
            std::vector<TermLight> row;
            for (size_t i = begin; i < end; ++i) {
                const glm::vec3 reflect = places.reflectance(i) / pi;
                const uint32_t own = places.condition(i);
                for (const auto* part : {&direct, &bounced})
                    for (const TermLight& l : part->row(i)) {
                        const uint32_t term = all || runs(l.term) ? paths_.leaving(l.term, own) : no_term;
                        if (term != no_term) sum[term] += reflect * l.value();
                    }
                if (!faint_lux.empty()) thin(i, sum, faint_lux);
                takeRow(sum, Rounding(i, rounding), row);
                emit(std::span<const TermLight>(row));
            }
        });
    }
    SparseLight leavingReceivers(const SparseLight& bounced, std::span<const float> faint_lux = {}) const {
        return outgoing(Receivers{gatherer_}, out_.direct, bounced, true, Rounding::Of::Outgoing, faint_lux);
    }

    struct Sum {
        TermLight::Four light = {0, 0, 0, 0};

        void operator+=(const TermLight& l) { light += l.four(); }
        void add(const TermLight& l, float share) { light += l.four() * share; }
        glm::vec3 operator*(float s) const { return glm::vec3(light[0], light[1], light[2]) * s; }
    };

    // One more bounce between blocks, of the groups that still run: `weight` of the way to it from what was there
    // before `bounced`, see Acceleration; of the others, what `bounced` has. Empties `previous`, rows by rows.
    SparseLight follow(const ReceiverBlocks& blocks, const Links& links, const SparseLight& radiance,
                       const SparseLight& bounced, SparseLight& previous, glm::vec3 weight,
                       Convergence& convergence) const {
        const float lux_per_radiance = pi / static_cast<float>(settings_.series_rays);
        SparseLight::Builder next(blocks.size());
        convergence.begin(bounced);
        const auto followRows = [&](size_t first, size_t last, Sums& sums) {
            TermAccumulator<Sum> sum(terms_);
            std::vector<TermLight> row;
            std::vector<Link> own_links;
            std::vector<Convergence::Change> changes;
            Convergence::Part part(convergence, sums);
            for (size_t i = first * rows_per_block; i < std::min(last * rows_per_block, blocks.size()); ++i) {
                links.get(i, own_links);
                addArriving(radiance, own_links, blocks.condition(i), sum);
                row.clear();
                changes.clear();
                const Rounding rounding(i, Rounding::Of::BlockBounced);
                TermsInOrder before(previous.row(i)), now(bounced.row(i));
                for (const uint32_t t : sum.touched()) {
                    const glm::vec3 lux = sum[t] * lux_per_radiance;
                    if (isLetGo(t, lux)) continue;  // nor does it count as a change
                    const glm::vec3 had = before.of(t);
                    row.emplace_back(t, had + weight * (lux - had), rounding);
                    changes.push_back({t, now.of(t), lux});
                }
                sum.clear();
                part.addRow(i, changes);
                const size_t followed = row.size();
                for (const TermLight& l : bounced.row(i))
                    if (!runs(l.term)) row.push_back(l);
                if (row.size() > followed) std::ranges::sort(row, {}, term_of);
                next.put(i, row);
                const bool rows_end = (i + 1) % rows_per_block == 0 || i + 1 == blocks.size();
                if (!rows_end) continue;
                next.close(i / rows_per_block * rows_per_block);
                previous.dropBlock(i);
                part.closeBlock();
            }
        };
        convergence.end(sumOverRows(blockCount(blocks.size()), convergence.none(), followRows), running_);
        return next.finish();
    }

    // The last bounce, from receiver to receiver.
    SparseLight followOnce(const SparseLight& radiance) const {
        const float lux_per_radiance = pi / static_cast<float>(settings_.series_rays);
        return SparseLight::build(receivers_, [&](size_t begin, size_t end, auto emit) {
            TermAccumulator<Sum> sum(terms_);
            std::vector<TermLight> row;
            std::vector<Link> links;
            for (size_t i = begin; i < end; ++i) {
                links_.get(i, links);
                addArriving(radiance, links, gatherer_.conditionOf(i), sum);
                row.clear();
                const Rounding rounding(i, Rounding::Of::Bounced);
                for (const uint32_t t : sum.touched()) {
                    const glm::vec3 lux = sum[t] * lux_per_radiance;
                    if (!isLetGo(t, lux)) row.emplace_back(t, lux, rounding);
                }
                sum.clear();
                emit(std::span<const TermLight>(row));
            }
        });
    }

    // Per term, lm/m2: where less leaves a receiver, some receivers stand for all.
    std::vector<float> faint() const {
        std::vector<float> lux;
        for (uint32_t t = 0; t < terms_; ++t) {
            const float threshold = settings_.thresholdOf(paths_.terms()[t].group);
            lux.push_back(std::min(threshold, lingering_threshold_max) * out_.threshold_base[t]);
        }
        return lux;
    }
    // Leaves of what is faint that much at some receivers and nothing at the others, as often as makes it right in the
    // mean. Neighbours take turns, by the golden ratio; all terms by the same, so that more light is never less.
    static void thin(size_t receiver, TermAccumulator<glm::vec3>& radiance, std::span<const float> faint_lux) {
        constexpr uint32_t golden = 0x9e3779b9;
        constexpr float half_step = 0x1p-25f;  // of unitFloat(): never 0, or the least light would be made infinite
        const float chance = unitFloat(static_cast<uint32_t>(receiver) * golden) + half_step;
        for (const uint32_t t : radiance.touched()) {
            const float lux = pi * luminance(radiance[t]);
            if (lux >= faint_lux[t]) continue;
            radiance[t] *= lux > chance * faint_lux[t] ? faint_lux[t] / lux : 0.0f;
        }
    }

    bool isLetGo(uint32_t term, glm::vec3 lux) const { return !least_.empty() && luminance(lux) < least_[term]; }

    // Light of a row, asked for by ascending terms.
    class TermsInOrder {
       public:
        explicit TermsInOrder(std::span<const TermLight> row) : row_(row) {}
        glm::vec3 of(uint32_t term) {
            while (!row_.empty() && row_.front().term < term) row_ = row_.subspan(1);
            return !row_.empty() && row_.front().term == term ? row_.front().value() : glm::vec3(0);
        }

       private:
        std::span<const TermLight> row_;
    };

    // Along a receiver's links; `own`: its condition.
    void addArriving(const SparseLight& radiance, std::span<const Link> links, uint32_t own,
                     TermAccumulator<Sum>& sum) const {
        constexpr float share_through_doors = 1.0f / (1 + door_rays_per_ray);
        for (size_t k = 0; k < links.size(); ++k) {
            if (k + links_ahead < links.size()) radiance.prefetch(links[k + links_ahead].receiver);
            const auto there = radiance.row(links[k].receiver);
            const uint32_t path = links[k].path;
            if (path == free_path && own == no_condition)
                for (const TermLight& l : there) sum[l.term] += l;
            else
                addMoved(there, path, own, path == free_path ? 1 : share_through_doors, sum);
        }
    }

    void addMoved(std::span<const TermLight> light, uint32_t path, uint32_t own, float share,
                  TermAccumulator<Sum>& sum) const {
        for (const TermLight& l : light)
            if (const uint32_t term = paths_.moved(l.term, path, own); term != no_term) sum[term].add(l, share);
    }

    // Running sum: each round follows the whole light once, between blocks of receivers, and the last bounce goes from
    // receiver to receiver. Each group ends when what is still to come of its own light is little.
    void bounce() {
        progress_.stage("bounces" + what_for_, settings_.bounces_max);
        const ReceiverBlocks blocks(gatherer_);
        const Links links = blocks.links(links_);
        const SparseLight direct = blocks.arriving(out_.direct, terms_);
        Acceleration acceleration = accelerationFor(longRunAlbedo(gatherer_, links_, settings_.series_rays));
        Convergence convergence(paths_, blocks.areasM2(), acceleration);
        SparseLight previous = SparseLight::Builder(blocks.size()).finish(), bounced = previous;
        out_.bounces.assign(paths_.groupCount(), 1);
        for (uint32_t n = 0; n + 1 < settings_.bounces_max && std::ranges::count(running_, 1) > 0; ++n) {
            const SparseLight radiance = outgoing(blocks, direct, bounced, false, Rounding::Of::BlockOutgoing);
            SparseLight next =
                follow(blocks, links, radiance, bounced, previous, acceleration.nextWeight(), convergence);
            previous = std::exchange(bounced, std::move(next));
            decideLeast(n, [&] { return atReceivers(blocks, bounced); });
            progress_.advance(1);
            for (uint32_t g = 0; g < paths_.groupCount(); ++g) {
                if (!running_[g]) continue;
                if (convergence.ends(g, settings_.tail_max))
                    running_[g] = 0;
                else
                    ++out_.bounces[g];
            }
        }
        previous = {};
        out_.bounced = followOnce(leavingReceivers(atReceivers(blocks, bounced)));
        links_ = {};
    }

    // Blocks' light at each of their receivers.
    SparseLight atReceivers(const ReceiverBlocks& blocks, const SparseLight& light) const {
        return SparseLight::build(receivers_, [&](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) emit(light.row(blocks.of(i)));
        });
    }

    // Of rounds too few for the tolerance each is plainly one bounce more, or the first ones would be too bright.
    Acceleration accelerationFor(glm::vec3 albedo) const {
        const Acceleration acceleration(albedo, settings_.series_rays);
        const uint32_t rounds_max = settings_.bounces_max - 1;  // the last bounce is a plain one
        // The factor is what T_n may differ by from its larger part.
        for (int c = 0; c < 3; ++c)
            if (2 * std::pow(acceleration.ratio()[c], static_cast<float>(rounds_max)) > settings_.tail_max)
                return Acceleration(albedo, 1);
        return acceleration;
    }

    // From the second bounce on, a set's light that is far below its activity threshold is let go: without this, every
    // set would linger everywhere at a millionth of a lux. Light through several doors takes several bounces to appear.
    void decideLeast(uint32_t round, auto&& bounced) {
        const bool first = least_.empty();
        if (!first && (terms_ == paths_.groupCount() || !std::has_single_bit(round + 1))) return;
        out_.bounced = bounced();
        const std::vector<TermReport> reports = activity_.thresholds(out_, lingering_threshold_max);
        out_.bounced = {};
        least_.resize(terms_);
        // Of a group that has ended nothing is decided again, however long others go on: alone it would be the same.
        for (uint32_t t = first ? 0 : paths_.groupCount(); t < terms_; ++t)
            if (runs(t))
                least_[t] =
                    (t < paths_.groupCount() ? lingering_share : door_lingering_share) * reports[t].threshold_lux;
    }

    const Gatherer& gatherer_;
    size_t receivers_;  // texels, then those of models
    const BakeSettings& settings_;
    Progress& progress_;
    LightGrid lights_;
    const DoorPaths& paths_;
    uint32_t terms_;
    RayEnds* ends_;  // may be null
    std::string what_for_;
    Activity activity_;
    std::vector<uint8_t> running_;             // per light group: its light is still followed
    std::vector<uint32_t> followed_in_group_;  // terms per light group, 0 for groups that are not asked for
    Links links_;                              // of series_rays of each receiver, and of rays for doors alone
    Sparse<uint32_t> doors_seen_;
    std::vector<float> least_;  // lux per term, empty before the first bounce
    std::atomic<uint64_t> rays_traced_ = 0;
    Series out_;
};

}  // namespace

Series expandSeries(const Gatherer& gatherer, const LightGrid& lights, const BakeSettings& settings, Progress& progress,
                    std::span<const uint8_t> groups, RayEnds* links) {
    return Expansion(gatherer, lights, settings, progress, groups, links).run();
}

std::vector<double> termFlux(const Gatherer& gatherer, const LightGrid& lights, const BakeSettings& settings,
                             Progress& progress, std::span<const uint8_t> groups, RayEnds* links) {
    return Expansion(gatherer, lights, settings, progress, groups, links, " for pairs of doors").flux();
}

}  // namespace dimmer::cook
