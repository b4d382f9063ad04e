#include <probes/local_bake.h>

#include <models/model_surface.h>
#include <probes/model_fit.h>
#include <probes/probe_gather.h>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace dimmer::cook {
namespace {

constexpr uint32_t local_probe_seed = 0x1f83d9abu, local_place_seed = 0x5be0cd19u;
// Of a model's surface: a probe has nine numbers for each channel.
constexpr uint32_t places_per_probe = 16;

// What was gathered for a model. A term that is not active at a place brings less than its threshold there: nothing.
struct ModelLight {
    std::span<const ModelPlace> places;
    std::span<const std::vector<ReceiverLight>> at_places;
    std::span<const std::vector<ProbeTermLight>> at_probes;  // those inside of something have their source's
    glm::uvec3 lattice;                                      // of the probes
};

template <class Light>
const Light* lightOf(std::span<const LightOfTerm<Light>> row, uint32_t term) {
    const auto found = std::ranges::lower_bound(row, term, {}, &LightOfTerm<Light>::term);
    return found != row.end() && found->term == term ? &found->light : nullptr;
}

std::vector<uint32_t> termsOf(const ModelLight& model) {
    std::vector<uint32_t> terms;
    const auto add = [&](const auto& rows) {
        for (const auto& row : rows)
            for (const auto& l : row) terms.push_back(l.term);
    };
    add(model.at_places);
    add(model.at_probes);
    std::ranges::sort(terms);
    terms.erase(std::unique(terms.begin(), terms.end()), terms.end());
    return terms;
}

std::vector<ProbeLight> fitted(const ModelLight& model, uint32_t term) {
    std::vector<ProbeLight> probes;
    for (const auto& row : model.at_probes) {
        const ProbeLight* light = lightOf<ProbeLight>(row, term);
        probes.push_back(light ? *light : ProbeLight{});
    }
    std::vector<glm::vec3> lux;
    for (const auto& row : model.at_places) {
        const Gathered* light = lightOf<Gathered>(row, term);
        lux.push_back(light ? light->irradiance_lux : glm::vec3(0));
    }
    fitModel(model.places, lux, probes, model.lattice);
    return probes;
}

// Per probe of the model, ascending by term: what the places and the probes together say, where it is worth storing.
std::vector<std::vector<ProbeTermLight>> fitTerms(const Series& series, const ModelLight& model) {
    const std::vector<uint32_t> terms = termsOf(model);
    std::vector<std::vector<ProbeLight>> light(terms.size());
    tbb::parallel_for(size_t{0}, terms.size(), [&](size_t t) { light[t] = fitted(model, terms[t]); });
    std::vector<std::vector<ProbeTermLight>> rows(model.at_probes.size());
    for (size_t i = 0; i < rows.size(); ++i) {
        const auto luxOf = [&](uint32_t term) {
            const auto at = std::ranges::lower_bound(terms, term);
            return at != terms.end() && *at == term
                       ? luminance(light[static_cast<size_t>(at - terms.begin())][i].irradiance())
                       : 0.0f;
        };
        for (size_t t = 0; t < terms.size(); ++t) {
            const float always_on_lux = luxOf(series.group_of[terms[t]]);
            if (terms[t] == always_group || series.active(terms[t], 0, luxOf(terms[t]), always_on_lux))
                rows[i].push_back({terms[t], light[t][i], 0, 0});
        }
    }
    return rows;
}

// All over the model's surface; none where its probes are not fitted to it.
std::vector<ModelPlace> placesOf(const RayScene& rays, uint32_t model, size_t probes) {
    if (probes > fitted_probes_max) return {};
    return modelPlaces(rays, model, places_per_probe * static_cast<uint32_t>(probes));
}

class LocalBake {
   public:
    LocalBake(const Gatherer& gatherer, const LightGrid& lights, const Series& series, const BakeSettings& settings,
              std::span<const uint8_t> groups, Progress& progress)
        : gatherer_(gatherer),
          series_(series),
          settings_(settings),
          groups_(groups),
          progress_(progress),
          lights_(lights.ofGroups(groups)) {
        const auto& models = gatherer.rays().scene().models;
        for (uint32_t m = 0; m < models.size(); ++m) {
            if (models[m].moves) continue;
            model_.push_back(m);
            first_probe_.push_back(probes_);
            probes_ += models[m].probes.x * models[m].probes.y * models[m].probes.z;
        }
        first_probe_.push_back(probes_);
    }

    std::vector<std::vector<ProbeTermLight>> run() {
        // Probes are gathered and fitted.
        progress_.stage("local grids", size_t{2 + places_per_probe} * probes_);
        findPlaces();
        const ProbePlaces& at = gatherer_.models().places();
        auto at_probes = gathered<ProbeLight>(probes_, [&](size_t i, auto& gather, auto& row) -> uint64_t {
            const auto number = static_cast<uint32_t>(i);
            if (at.source[i] != i) return 0;
            const SamplePoint point{at.position_m[i], no_face};
            return gather.gather(
                Gatherer::atProbe(point, local_probe_seed + number, gatherer_.models().modelOfProbe(number)), row);
        });
        for (size_t i = 0; i < probes_; ++i)
            if (at.source[i] != i && at.source[i] != no_index) at_probes[i] = at_probes[at.source[i]];
        const auto at_places = gathered<Gathered>(places_.size(), [&](size_t i, auto& gather, auto& row) {
            return gather.gather({.points = {&places_[i].point, 1}, .id = local_place_seed + static_cast<uint32_t>(i)},
                                 row);
        });
        progress_.advance(size_t{places_per_probe} * probes_ - places_.size());
        tbb::parallel_for(size_t{0}, model_.size(), [&](size_t m) {
            const size_t place = first_place_[m], places = first_place_[m + 1] - place;
            const size_t probe = first_probe_[m], probes = first_probe_[m + 1] - probe;
            if (places > 0) {
                auto rows = fitTerms(
                    series_,
                    {std::span(places_).subspan(place, places), std::span(at_places).subspan(place, places),
                     std::span(at_probes).subspan(probe, probes), gatherer_.rays().scene().models[model_[m]].probes});
                std::ranges::move(rows, at_probes.begin() + static_cast<std::ptrdiff_t>(probe));
            }
            progress_.advance(probes);
        });
        return at_probes;
    }
    uint64_t rays() const { return rays_; }

   private:
    void findPlaces() {
        std::vector<std::vector<ModelPlace>> of_model(model_.size());
        tbb::parallel_for(size_t{0}, model_.size(), [&](size_t m) {
            of_model[m] = placesOf(gatherer_.rays(), model_[m], first_probe_[m + 1] - first_probe_[m]);
        });
        for (const auto& places : of_model) {
            first_place_.push_back(places_.size());
            places_.insert(places_.end(), places.begin(), places.end());
        }
        first_place_.push_back(places_.size());
    }

    template <class Light>
    std::vector<std::vector<LightOfTerm<Light>>> gathered(size_t count, auto&& at) {
        std::vector<std::vector<LightOfTerm<Light>>> rows(count);
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 8), [&](const auto& range) {
            ReceiverGather<Light> gather(gatherer_, lights_, series_, settings_, groups_);
            uint64_t traced = 0;
            for (size_t i = range.begin(); i < range.end(); ++i) traced += at(i, gather, rows[i]);
            rays_ += traced;
            progress_.advance(range.size());
        });
        return rows;
    }

    const Gatherer& gatherer_;
    const Series& series_;
    const BakeSettings& settings_;
    std::span<const uint8_t> groups_;
    Progress& progress_;
    LightGrid lights_;
    std::vector<uint32_t> model_;  // those that stand
    std::vector<ModelPlace> places_;
    std::vector<size_t> first_place_, first_probe_;  // per model that stands, and the ends
    size_t probes_ = 0;
    std::atomic<uint64_t> rays_ = 0;
};

}  // namespace

Sparse<ProbeTermLight> bakeLocalGrids(const Gatherer& gatherer, const LightGrid& lights, const Series& series,
                                      const BakeSettings& settings, std::span<const uint8_t> groups, Progress& progress,
                                      uint64_t& rays) {
    std::vector<std::vector<ProbeTermLight>> rows;
    if (!gatherer.models().empty()) {
        LocalBake bake(gatherer, lights, series, settings, groups, progress);
        rows = bake.run();
        rays += bake.rays();
    }
    return Sparse<ProbeTermLight>::build(rows.size(), [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) emit(std::span<const ProbeTermLight>(rows[i]));
    });
}

std::vector<std::string> warningsOfLocalGrids(const RayScene& rays, const ProbePlaces& places) {
    std::vector<std::string> warnings;
    const Scene& scene = rays.scene();
    const auto& source = places.source;
    size_t first = 0;
    for (uint32_t m = 0; m < scene.models.size(); ++m) {
        const SceneModel& model = scene.models[m];
        if (model.moves) continue;
        const size_t probes = size_t{model.probes.x} * model.probes.y * model.probes.z;
        const bool all_inside =
            std::ranges::all_of(std::span(source).subspan(first, probes), [](uint32_t s) { return s == no_index; });
        first += probes;
        if (all_inside && placesOf(rays, m, probes).empty())
            warnings.push_back(
                fmt::format("node '{}': stands inside of other geometry; its light grid is black", model.node));
        if (probes > fitted_probes_max)
            warnings.push_back(
                fmt::format("node '{}': of its {} probes none is fitted to its surface, which is done for up to {}; "
                            "mend: a larger dimmer_grid_spacing, or parts",
                            model.node, probes, fitted_probes_max));
    }
    return warnings;
}

}  // namespace dimmer::cook
