#include <pipeline/settings.h>

#include <update/state_text.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace dimmer::cook {
namespace {

using nlohmann::json;

// The names of a choice's values, by value.
constexpr std::array color_formats = {"r11g11b10f", "e5b9g9r9"};
constexpr std::array direction_models = {"ahd", "linear"};
constexpr const auto& namesOf(ColorFormat) {
    return color_formats;
}
constexpr const auto& namesOf(DirectionModel) {
    return direction_models;
}

constexpr std::array grid_modes = {"auto", "on", "off"};
constexpr const auto& namesOf(GridMode) {
    return grid_modes;
}

std::unexpected<Error> bad(const std::string& source, const std::string& text) {
    return fail(ErrorCode::BadInput, fmt::format("{}: {}", source, text));
}

template <class Choice>
Expected<void> choose(const Setting& setting, Choice& target, const json& value, const std::string& source) {
    const auto& names = namesOf(Choice{});
    const auto name = value.is_string() ? std::ranges::find(names, value.get<std::string>()) : names.end();
    if (name == names.end())
        return bad(source, fmt::format("'{}' must be one of \"{}\"", setting.key, fmt::join(names, "\", \"")));
    target = static_cast<Choice>(name - names.begin());
    return {};
}

Expected<void> assignNumber(const Setting& setting, const json& value, const std::string& source) {
    if (!value.is_number()) return bad(source, fmt::format("'{}' must be a number", setting.key));
    const double number = value.get<double>();
    if (!(number >= setting.least && number <= setting.most))
        return bad(source,
                   fmt::format("'{}' is {}, outside {} .. {}", setting.key, number, setting.least, setting.most));
    const bool whole = !std::holds_alternative<float*>(setting.target);
    if (whole && number != std::floor(number))
        return bad(source, fmt::format("'{}' is {}, it must be a whole number", setting.key, number));
    std::visit(
        [&](auto* target) {
            if constexpr (std::is_arithmetic_v<std::remove_pointer_t<decltype(target)>>)
                *target = static_cast<std::remove_pointer_t<decltype(target)>>(number);
        },
        setting.target);
    return {};
}

Expected<void> assign(const Setting& setting, const json& value, const std::string& source) {
    if (const auto* format = std::get_if<ColorFormat*>(&setting.target))
        return choose(setting, **format, value, source);
    if (const auto* model = std::get_if<DirectionModel*>(&setting.target))
        return choose(setting, **model, value, source);
    if (const auto* mode = std::get_if<GridMode*>(&setting.target)) return choose(setting, **mode, value, source);
    return assignNumber(setting, value, source);
}

// "records.max_overlap" and "records.overlap_max" have the same words.
std::vector<std::string> sortedWords(std::string_view key) {
    std::vector<std::string> words = {""};
    for (const char c : key)
        if (c == '.' || c == '_')
            words.emplace_back();
        else
            words.back() += c;
    std::ranges::sort(words);
    return words;
}

// "'lightmaps.page_sice' is no setting; did you mean 'lightmaps.page_size'?"
std::string unknownKey(const std::string& key, const json& value, const std::vector<Setting>& settings) {
    if (key == "extends" || key == "description") return fmt::format("'{}' belongs in a profile's file", key);
    if (isGroupOfSettings(key, settings)) return fmt::format("'{}' must be an object, not {}", key, value.type_name());
    std::vector<std::string_view> known = {"extends", "description"};
    for (const Setting& s : settings) known.push_back(s.key);
    std::string_view nearest = nearestName(key, known);
    const auto turned = std::ranges::find(known, sortedWords(key), [](std::string_view k) { return sortedWords(k); });
    if (turned != known.end()) nearest = *turned;
    if (!nearest.empty()) return fmt::format("'{}' is no setting; did you mean '{}'?", key, nearest);
    if (key == "quality") return "'quality' is no setting but an option: --quality draft, preview or final";
    std::vector<std::string_view> ends;  // "page_size" for "lightmaps.page_size"
    std::ranges::copy_if(known, std::back_inserter(ends), [&](std::string_view k) { return k.ends_with("." + key); });
    if (!ends.empty()) return fmt::format("'{}' is no setting; did you mean '{}'?", key, fmt::join(ends, "' or '"));
    return fmt::format("'{}' is no setting; there are: {}", key, fmt::join(known, ", "));
}

constexpr const char* threshold_what =
    "where a light set's record is kept: this share (0..1) of the mean bounced light of the surfaces that the set "
    "lights "
    "directly. Higher saves memory and update time and loses faint light; 0.01 is hardly seen";

json schemaOf(const Setting& s) {
    json out = {{"description", s.what}, {"default", valueOf(s)}};
    if (std::holds_alternative<ColorFormat*>(s.target))
        out["enum"] = color_formats;
    else if (std::holds_alternative<DirectionModel*>(s.target))
        out["enum"] = direction_models;
    else if (std::holds_alternative<GridMode*>(s.target))
        out["enum"] = grid_modes;
    else {
        out["type"] = std::holds_alternative<float*>(s.target) ? "number" : "integer";
        out["minimum"] = s.least;
        out["maximum"] = s.most;
    }
    return out;
}

void addBudgets(Profile& p, std::vector<Setting>& list) {
    constexpr double any = 1e15;
    list.push_back({"budgets.total", &p.budget_total, 0, any,
                    "bytes of device memory for everything; 0: no limit. What the platform's memory plan grants"});
    list.push_back({"budgets.base_lightmaps", &p.budget_base_lightmaps, 0, any,
                    "bytes of the lightmap pages; 0: no limit. They grow with the square of the texel density"});
    list.push_back({"budgets.dynamic", &p.budget_dynamic, 0, any,
                    "bytes of all records of light sets and doors; 0: no limit. They also bound what an update reads"});
    list.push_back(
        {"budgets.global_grid", &p.budget_global_grid, 0, any,
         "bytes of the global grid's probes and of its tetrahedra; 0: no limit. The records of sets and doors at "
         "its probes are part of budgets.dynamic"});
    list.push_back(
        {"budgets.local_grids", &p.budget_local_grids, 0, any,
         "bytes of the probes of models' own grids; 0: no limit. The records of sets and doors at them are part "
         "of budgets.dynamic"});
    list.push_back({"budgets.per_element", &p.budget_per_element, 0, any,
                    "bytes of the records that name one light set or door; 0: no limit. Keeps one lamp that lights the "
                    "whole level from eating the budget of all others"});
}

void addQuality(const std::string& name, Quality& q, std::vector<Setting>& list) {
    const std::string prefix = fmt::format("bake.{}.", name);
    list.push_back({prefix + "samples_per_texel", &q.samples_per_texel, 1, 64,
                    "points of a texel that rays start from; more soften what a texel at an edge sees"});
    list.push_back({prefix + "series_rays", &q.series_rays, 1, 4096,
                    "rays per texel for the bounces; 2 to 3 bytes of memory each while the bake runs"});
    list.push_back({prefix + "rays", &q.rays, 1, 1 << 20,
                    "rays per texel and light set at most, in rounds of 32, for what is stored: the bake's time"});
    list.push_back({prefix + "emitter_samples", &q.emitter_samples, 0, 4096,
                    "samples per 32 rays towards each light set's emissive surfaces and an image sky"});
    list.push_back({prefix + "noise", &q.noise, 0, 1,
                    "rays end once the 95 % interval is within this share (0..1) of the light; 0: never early"});
    list.push_back({prefix + "denoise", &q.denoise, 0, 1, "1: filter the noise that is left; 0: keep every detail"});
    list.push_back({prefix + "sharpen", &q.sharpen, 0, 1,
                    "1: texels that bilinear filtering shows the gathered light of; 0: the light as it was gathered, "
                    "which filtering blurs again"});
    list.push_back(
        {prefix + "lamps_apart", &q.lamps_apart, 0, 1024,
         "light sets of at most so many lamps (all emissive surfaces of a set are one), and always-on light of as "
         "few (surfaces and sky are one), are baked lamp by lamp: an edit of one lamp bakes that lamp alone, and one "
         "of its brightness nothing; 0: set by set, in a shorter first cook"});
    list.push_back({prefix + "probe_sites", &q.probe_sites, 1, 256,
                    "places per probe of the global grid at which light is traced, to choose and fit probes by"});
    list.push_back({prefix + "probe_rays", &q.probe_rays, 32, 4096,
                    "rays from each of these places, up to four times as many where a small level has few of them"});
    list.push_back({prefix + "bounces", &q.bounces, 1, 1024, "bounces at most; a warning says when they were too few"});
    list.push_back({prefix + "tolerance", &q.tolerance, 1e-6, 1,
                    "bounces end when what is still to come is below this share (0..1) of a set's light, in the mean "
                    "over the places that it lights: bright or dim, they count alike"});
    list.push_back({prefix + "zstd_level", &q.zstd_level, 1, 19,
                    "compression of the pack: 7 packs a hundredth smaller than 1 in three times the time, 16 a "
                    "fourteenth in twenty; reading is as fast"});
}

}  // namespace

const char* nameOf(ColorFormat format) {
    return color_formats[static_cast<size_t>(format)];
}

const char* nameOf(GridMode mode) {
    return grid_modes[static_cast<size_t>(mode)];
}

const char* nameOf(DirectionModel model) {
    return direction_models[static_cast<size_t>(model)];
}

std::vector<Setting> settingsOf(Profile& p) {
    std::vector<Setting> list;
    addBudgets(p, list);
    list.push_back(
        {"lightmaps.texels_per_metre", &p.texels_per_metre, 0.01, 256,
         "density of lightmaps, texels per metre. Memory and bake time grow with its square; shadows of baked "
         "lights and contacts are as sharp as it"});
    list.push_back({"lightmaps.page_size", &p.page_size, 64, 4096,
                    "texels along a page's longest side at most; larger pages waste less and stream worse"});
    list.push_back({"lightmaps.color", &p.color_format, 0, 0,
                    "format of irradiance, 4 bytes: e5b9g9r9 is finer, r11g11b10f can be filtered and stored to by "
                    "devices that lack the other"});
    list.push_back(
        {"lightmaps.model", &p.direction_model, 0, 0,
         "how irradiance falls off over normals: ahd is better where one lamp rules, linear where many mix"});
    list.push_back({"records.threshold", &p.threshold, 0, 1, threshold_what});
    list.push_back({"records.door_share", &p.door_share, 0, 1,
                    "how far below its light set's threshold the light that needs a door is kept where it is faint "
                    "beside the set's other light: down to this share (0..1) of it; 1: no further than other light. "
                    "Lower keeps what a far lamp sends past a door, in more memory"});
    list.push_back(
        {"records.overlap_max", &p.overlap_max, 0, 4096,
         "contributions that one texel or probe holds at most, the brightest there; 0: no limit. Bounds what "
         "the worst texel of an update costs"});
    list.push_back({"grids.global", &p.global_grid, 0, 0,
                    "whether the global grid is baked, which lights what has no lightmap. auto: where the level says "
                    "that something moves (a node with dimmer_dynamic, a mesh whose dimmer_lighting is dynamic, a "
                    "dimmer_play_area); on: always; off: never"});
    list.push_back(
        {"grids.probes_max", &p.probes_max, 0, 1 << 20,
         "light probes of the global grid at most; 0: no grid, and nothing that moves is lit. In most levels "
         "grids.probes_per_m3 allows fewer"});
    list.push_back({"grids.probes_per_m3", &p.probes_per_m3, 0, 64,
                    "light probes of the global grid for each cubic metre of open space at most. 0: one, or up to four "
                    "(and 32 besides) while that makes no more than 256. Small rooms with lamps that are baked in full "
                    "gain most by more"});
    list.push_back({"grids.global_min_spacing", &p.global_min_spacing_m, 0.1, 1000,
                    "metres between probes of the global grid at least; light around a lamp changes over a hand's "
                    "breadth"});
    list.push_back({"grids.local_spacing", &p.local_spacing_m, 0.1, 100,
                    "metres between the probes of a model's own grid at most, where its node does not say"});
    list.push_back({"grids.local_probes_max", &p.local_probes_max, 8, 4096,
                    "light probes of one model's own grid at most; a larger model's stand further apart"});
    for (auto [name, q] : {std::pair{"draft", &p.draft}, {"preview", &p.preview}, {"final", &p.final}})
        addQuality(name, *q, list);
    return list;
}

json valueOf(const Setting& setting) {
    return std::visit(
        [](const auto* v) -> json {
            using Value = std::remove_cvref_t<decltype(*v)>;
            if constexpr (std::is_same_v<Value, float>)
                return shortDecimal(*v);
            else if constexpr (std::is_enum_v<Value>)
                return nameOf(*v);
            else
                return *v;
        },
        setting.target);
}

double shortDecimal(float value) {
    return std::stod(fmt::format("{}", value));
}

bool isGroupOfSettings(const std::string& key, const std::vector<Setting>& settings) {
    return key + "." == set_threshold_prefix ||
           std::ranges::any_of(settings, [&](const Setting& s) { return s.key.starts_with(key + "."); });
}

Expected<void> assignSetting(Profile& profile, const std::vector<Setting>& settings, const std::string& key,
                             const json& value, const std::string& source) {
    if (key.starts_with(set_threshold_prefix) && key.size() > set_threshold_prefix.size()) {
        const std::string set = key.substr(set_threshold_prefix.size());
        float threshold = 0;
        if (auto ok = assign({key, &threshold, 0, 1, ""}, value, source); !ok) return ok;
        profile.set_thresholds[set] = threshold;
        return {};
    }
    const auto it = std::ranges::find(settings, key, &Setting::key);
    if (it == settings.end()) return bad(source, unknownKey(key, value, settings));
    return assign(*it, value, source);
}

Expected<void> assignText(Profile& profile, const std::string& text, const std::string& source,
                          const std::string& origin) {
    const size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
        return bad(source, fmt::format("'{}' is not of the form key=value", text));
    const std::string key = text.substr(0, equals), written = text.substr(equals + 1);
    json value = json::parse(written, nullptr, false);
    if (value.is_discarded() || !value.is_primitive()) value = written;
    if (auto ok = assignSetting(profile, settingsOf(profile), key, value, source); !ok) return ok;
    profile.origin[key] = origin;
    return {};
}

std::string settingsSchema() {
    using ordered = nlohmann::ordered_json;
    ordered schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                      {"title", "A profile of the cooker"},
                      {"description",
                       "What a profile does not set is as in the one that it extends; \"default\" is what desktop has"},
                      {"type", "object"},
                      {"additionalProperties", false}};
    ordered& top = schema["properties"];
    top["$schema"] = {{"type", "string"}};
    top["description"] = {{"type", "string"}, {"description", "for people"}};
    top["extends"] = {
        {"type", "string"},
        {"description", "what this profile changes: a shipped profile's name or a file beside it; default: desktop"}};
    Profile desktop = loadProfile("desktop").value();
    for (const Setting& s : settingsOf(desktop)) {
        ordered* object = &schema;
        size_t begin = 0;
        for (size_t dot; (dot = s.key.find('.', begin)) != std::string::npos; begin = dot + 1) {
            object = &(*object)["properties"][s.key.substr(begin, dot - begin)];
            (*object)["type"] = "object";
            (*object)["additionalProperties"] = false;
        }
        (*object)["properties"][s.key.substr(begin)] = schemaOf(s);
    }
    top["records"]["properties"]["thresholds"] = {
        {"type", "object"},
        {"description", "records.threshold for single light sets, by name"},
        {"additionalProperties", {{"type", "number"}, {"minimum", 0}, {"maximum", 1}}}};
    return schema.dump(4) + "\n";
}

}  // namespace dimmer::cook
