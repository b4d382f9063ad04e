#include <report/report.h>

#include <pack/pack_data.h>
#include <pipeline/budget.h>
#include <pipeline/contribution_text.h>
#include <pipeline/heat_map.h>
#include <pipeline/human_bytes.h>
#include <pipeline/profile.h>
#include <report/page_pictures.h>

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace dimmer::cook {
namespace {

// Light on dark as the pages are; one column on a phone; nothing from outside.
constexpr const char* style = R"(
:root{color-scheme:dark;--line:#3f3f46;--dim:#a1a1aa;--bar:#4f9cf0;--over:#ef5350}
*{box-sizing:border-box}
body{margin:0 auto;max-width:70rem;padding:1rem;background:#18181b;color:#e4e4e7;font:16px/1.45 system-ui,sans-serif}
h1{font-size:1.4rem;overflow-wrap:anywhere}h2{font-size:1.1rem;margin:2rem 0 .6rem}
.dim,small{color:var(--dim)}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%}
th,td{padding:.3rem .6rem;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap}
th:first-child,td:first-child{text-align:left;white-space:normal;overflow-wrap:anywhere;min-width:7rem}
.bars{display:grid;grid-template-columns:minmax(6rem,auto) 1fr auto;gap:.35rem .7rem;align-items:center}
.track{background:#27272a;height:1rem;border-radius:3px;overflow:hidden}
.track i{display:block;height:100%;background:var(--bar)}.track i.over{background:var(--over)}
select{font:inherit;padding:.4rem;width:100%;max-width:28rem;background:#27272a;color:inherit;border:1px solid var(--line)}
.page{margin:.8rem 0}.page img{width:100%;image-rendering:pixelated;display:block;background:#000}
.key span{display:inline-block;padding:.1rem .5rem;margin:0 .2rem .2rem 0;border-radius:3px}
li{overflow-wrap:anywhere;margin:.3rem 0}
@media(max-width:36rem){th,td{padding:.3rem .35rem}.bars{grid-template-columns:minmax(2rem,auto) 1fr}
.bars small{grid-column:1/-1;margin-top:-.35rem}}
)";

// Shows the pictures of what was chosen.
constexpr const char* script = R"(
const choice=document.getElementById('view');
function show(){for(const f of document.querySelectorAll('.page'))f.hidden=f.dataset.view!==choice.value}
choice.addEventListener('change',show);show();
)";

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

std::string percent(double share) {
    return fmt::format("{:.2f} %", 100 * share);
}

// A row of a `.bars` grid. `label` is escaped here; `text` is ours.
std::string bar(std::string_view label, double share, std::string_view text, bool over = false) {
    return fmt::format("<span>{}</span><div class=track><i{} style=\"width:{:.1f}%\"></i></div><small>{}</small>\n",
                       escaped(label), over ? " class=over" : "", 100 * std::clamp(share, 0.0, 1.0), text);
}

std::string elementName(const Element& e) {
    return (e.kind == ElementKind::Door ? "door:" : "") + e.name;
}

class Report {
   public:
    Report(const Pack& pack, const ReportInput& input)
        : pack_(pack), d_(pack.data()), input_(input), cost_(costOf(d_)) {}

    Expected<std::string> write() {
        heading();
        budgets();
        elements();
        if (auto ok = pages(); !ok) return std::unexpected(ok.error());
        overlaps();
        if (auto ok = errors(); !ok) return std::unexpected(ok.error());
        stages();
        warnings();
        settings();
        return fmt::format(
            "<!doctype html>\n<html lang=en><meta charset=utf-8>\n"
            "<meta name=viewport content=\"width=device-width,initial-scale=1\">\n"
            "<title>{}</title><style>{}</style>\n<body>\n{}<script>{}</script>\n</body></html>\n",
            escaped(input_.title), style, body_, script);
    }

   private:
    void heading() {
        body_ += fmt::format(
            "<h1>{}</h1>\n<p class=dim>{} {} of {} x {} texels, {} light sets, {} doors, {} contributions, "
            "{} clusters, exposure {}{}</p>\n",
            escaped(input_.title), d_.page_count, d_.page_count == 1 ? "page" : "pages", d_.page_width, d_.page_height,
            count(ElementKind::LightSet), count(ElementKind::Door), d_.contributions.size(), d_.clusters.size(),
            d_.exposure, input_.file_bytes ? ", file " + humanBytes(input_.file_bytes) : "");
    }

    size_t count(ElementKind kind) const {
        return static_cast<size_t>(std::ranges::count(d_.elements, kind, &Element::kind));
    }

    void budget(std::string_view label, uint64_t bytes, uint64_t limit, uint64_t largest) {
        const uint64_t whole = limit > 0 ? limit : std::max<uint64_t>(largest, 1);
        const double share = static_cast<double>(bytes) / static_cast<double>(whole);
        body_ += bar(label, share,
                     limit > 0 ? fmt::format("{} of {} ({:.0f} %)", humanBytes(bytes), humanBytes(limit), 100 * share)
                               : humanBytes(bytes) + ", no limit",
                     share > 1);
    }

    // Budgets are in the settings that the pack carries.
    void budgets() {
        Profile profile;
        if (const auto settings = readSettings(d_.settings_json)) profile = settings->profile;
        body_ += "<h2>Memory on the device</h2>\n<div class=bars>\n";
        budget("total", cost_.device(), profile.budget_total, cost_.device());
        budget("base lightmaps", cost_.base_lightmap, profile.budget_base_lightmaps, cost_.device());
        budget("dynamic records", cost_.dynamic, profile.budget_dynamic, cost_.device());
        budget("global grid", cost_.global_grid, profile.budget_global_grid, cost_.device());
        budget("local grids", cost_.local_grids, profile.budget_local_grids, cost_.device());
        budget("ancillary", cost_.ancillary, 0, cost_.device());
        body_ += "</div>\n";
    }

    float dropped(uint32_t element) const {
        for (const Contribution& c : d_.contributions)
            if (c.light_set == element && c.doors_open.empty() && c.doors_closed.empty()) return c.energy_dropped;
        return 0;
    }

    void elements() {
        std::vector<ElementCost> by_size = cost_.elements;
        std::ranges::stable_sort(by_size, [](const auto& a, const auto& b) { return a.bytes > b.bytes; });
        body_ +=
            "<h2>Light sets and doors</h2>\n<div class=scroll><table><tr><th>name<th>bytes<th>texel records<th>largest "
            "weight<th>energy dropped\n";
        for (const ElementCost& e : by_size) {
            const Element& element = d_.elements[e.element];
            body_ +=
                fmt::format("<tr><td>{}<td>{}<td>{}<td>{}<td>{}\n", escaped(elementName(element)), humanBytes(e.bytes),
                            e.receivers, element.kind == ElementKind::Door ? "" : fmt::format("{}", element.max_weight),
                            element.kind == ElementKind::Door ? "" : percent(static_cast<double>(dropped(e.element))));
        }
        body_ += "</table></div>\n";
    }

    void figure(const std::string& view, size_t page, const std::string& picture, const std::string& caption) {
        body_ += fmt::format(
            "<figure class=page data-view=\"{}\"><img alt=\"page {}\" src=\"{}\"><figcaption class=dim>page {}: {}"
            "</figcaption></figure>\n",
            view, page, picture, page, caption);
    }

    Expected<void> pages() {
        const PagePictures draw{report_picture_max};
        const auto light = draw.light(pack_), overlap = draw.overlap(pack_);
        if (!light) return std::unexpected(light.error());
        if (!overlap) return std::unexpected(overlap.error());
        std::string options =
            "<option value=light>light: every set on, doors closed<option value=overlap>overlap: "
            "contributions at each texel";
        for (size_t e = 0; e < d_.elements.size(); ++e)
            options += fmt::format("<option value=e{}>region of {}", e, escaped(elementName(d_.elements[e])));
        body_ += "<h2>Pages</h2>\n<select id=view aria-label=\"what to show\">" + options + "</select>\n";
        for (size_t p = 0; p < light->size(); ++p) figure("light", p, (*light)[p], "every set on, doors closed");
        for (size_t p = 0; p < overlap->size(); ++p) figure("overlap", p, (*overlap)[p], overlapKey());
        for (uint32_t e = 0; e < d_.elements.size(); ++e) {
            const auto region = draw.region(pack_, e);
            if (!region) return std::unexpected(region.error());
            const std::string view = fmt::format("e{}", e);
            for (size_t p = 0; p < region->size(); ++p)
                if (!(*region)[p].empty())
                    figure(view, p, (*region)[p],
                           "region of " + escaped(elementName(d_.elements[e])) +
                               ", at weight 1, four powers of ten from dark to bright");
        }
        return {};
    }

    static std::string overlapKey() {
        std::string key = "<span class=key>";
        for (size_t n = 0; n < overlap_colours.size(); ++n) {
            const auto& [r, g, b] = overlap_colours[n];
            key += fmt::format("<span style=\"background:rgb({},{},{});color:{}\">{}{}</span>", r, g, b,
                               n >= 3 && n <= 6 ? "#000" : "#fff", n, n + 1 == overlap_colours.size() ? "+" : "");
        }
        return key + "</span>";
    }

    void overlaps() {
        constexpr size_t rows_max = 16;
        const auto& histogram = cost_.overlap_histogram;
        std::vector<uint64_t> rows(histogram.begin(), histogram.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                              histogram.size(), rows_max + 1)));
        for (size_t n = rows.size(); n < histogram.size(); ++n) rows.back() += histogram[n];
        uint64_t most = 1;
        for (size_t n = 1; n < rows.size(); ++n) most = std::max(most, rows[n]);
        body_ += "<h2>Contributions at a texel</h2>\n<div class=bars>\n";
        for (size_t n = 1; n < rows.size(); ++n)
            body_ += bar(fmt::format("{}{}", n, n == rows_max && histogram.size() > rows.size() ? " and more" : ""),
                         static_cast<double>(rows[n]) / static_cast<double>(most), fmt::format("{} texels", rows[n]));
        body_ += fmt::format("</div>\n<p class=dim>{} texels never change.</p>\n", histogram[0]);
    }

    static bool isOfNothing(const nlohmann::json& figures) {
        return figures.is_object() && figures.contains("points") && figures["points"] == 0;
    }

    // Of what `verify` measured.
    static std::string stateOf(const nlohmann::json& verified) {
        const bool named = verified.contains("state") && verified["state"].is_string() && verified["state"] != "";
        return named ? "In the state " + escaped(verified["state"].get<std::string>())
                     : "All light sets on, doors closed";
    }

    // Figures of `verify --json` and pictures of `verify --heatmap`.
    Expected<void> errors() {
        const auto number = [](const nlohmann::json& object, const char* key) {
            const auto found = object.is_object() ? object.find(key) : object.end();
            return found != object.end() && found->is_number() ? percent(found->get<double>()) : std::string("-");
        };
        const nlohmann::json& v = input_.verify;
        if (v.is_object()) {
            body_ += fmt::format("<h2>Error against the path tracer</h2>\n<p class=dim>{}{}</p>\n", stateOf(v),
                                 v.contains("converged") && v["converged"] == false
                                     ? "; not converged: what noise adds is taken off"
                                     : "");
            body_ += "<div class=scroll><table><tr><th>points<th>mean<th>95 %<th>bias\n";
            for (const char* where : {"surface", "tilted", "grid", "models", "models_without_self_visibility"})
                if (v.contains(where) && !isOfNothing(v[where]))
                    body_ += fmt::format("<tr><td>{}<td>{}<td>{}<td>{}\n", where, number(v[where], "mean"),
                                         number(v[where], "p95"), number(v[where], "bias"));
            body_ += "</table></div>\n";
            const auto effects = [&](const char* key, std::string_view header, std::vector<const char*> names) {
                if (!v.contains(key) || !v[key].is_array() || v[key].empty()) return;
                body_ += fmt::format(
                    "<div class=scroll><table><tr>{}<th>error<th>bias<th>reference noise<th>elsewhere\n", header);
                for (const nlohmann::json& row : v[key]) {
                    const auto named = [&](const char* name) {
                        return row.is_object() && row.contains(name) && row[name].is_string();
                    };
                    if (!std::ranges::all_of(names, named)) continue;
                    body_ += "<tr>";
                    for (const char* name : names) body_ += "<td>" + escaped(row[name].get<std::string>());
                    // Nothing of the reference's counts: then there is no share of it.
                    const bool none = isOfNothing(row);
                    for (const char* share : {"error", "bias", "reference_noise"})
                        body_ += "<td>" + (none ? "-" : number(row, share));
                    body_ += fmt::format("<td>{}\n", number(row, "elsewhere"));
                }
                body_ += "</table></div>\n";
            };
            effects("sets", "<th>light set, alone", {"name"});
            effects("doors", "<th>door, opened<th>light", {"door", "light"});
        }
        if (input_.heat_maps.empty()) return {};
        body_ += "<h2>Error on the pages</h2>\n<p class=dim>Points: blue too dark, white exact, red too bright.</p>\n";
        for (uint32_t page = 0; page < d_.page_count; ++page) {
            const auto file = input_.heat_maps / heatMapName(page);
            std::error_code ignored;
            const bool usable = std::filesystem::is_regular_file(file, ignored);
            std::ifstream in(usable ? file : std::filesystem::path(), std::ios::binary);
            const std::string png{std::istreambuf_iterator<char>(in), {}};
            if (!in || !png.starts_with("\x89PNG"))
                return fail(ErrorCode::Io,
                            fmt::format("{}: it is no heat map; write it by `dimmer verify --heatmap`", file.string()));
            body_ += fmt::format(
                "<figure class=heat><img alt=\"error on page {}\" style=\"width:100%\" "
                "src=\"data:image/png;base64,{}\"></figure>\n",
                page, base64(std::as_bytes(std::span(png))));
        }
        return {};
    }

    void time(const std::string& stage, double seconds, double sum) {
        body_ += bar(stage, sum > 0 ? seconds / sum : 0, fmt::format("{:.2f} s", seconds));
    }

    void stages() {
        if (input_.seconds.empty()) return;
        double sum = 0;
        for (const auto& [stage, seconds] : input_.seconds) sum += seconds;
        body_ += "<h2>Time</h2>\n<div class=bars>\n";
        for (const auto& [stage, seconds] : input_.seconds) time(stage, seconds, sum);
        for (const auto& [stage, seconds] : input_.bake_seconds) time("bake: " + stage, seconds, sum);
        body_ += fmt::format("</div>\n<p class=dim>{:.2f} s in all.</p>\n", sum);
    }

    void warnings() {
        body_ += "<h2>Warnings</h2>\n";
        if (input_.warnings.empty()) body_ += "<p class=dim>none</p>\n";
        if (!input_.warnings.empty()) body_ += "<ul>\n";
        for (const std::string& w : input_.warnings) body_ += "<li>" + escaped(w) + "\n";
        if (!input_.warnings.empty()) body_ += "</ul>\n";
    }

    void settings() {
        const auto all = listedSettings(d_.settings_json);
        if (all.empty()) return;
        body_ += "<details><summary>Settings</summary><div class=scroll><table><tr><th>name<th>value<th>from\n";
        for (const auto& [name, setting] : all.items())
            body_ += fmt::format("<tr><td>{}<td>{}<td>{}\n", escaped(name), escaped(setting["value"].dump()),
                                 escaped(setting["from"].dump()));
        body_ += "</table></div></details>\n";
    }

    const Pack& pack_;
    const PackData& d_;
    const ReportInput& input_;
    PackCost cost_;
    std::string body_;
};

}  // namespace

Expected<std::string> reportHtml(const Pack& pack, const ReportInput& input) {
    return Report(pack, input).write();
}

}  // namespace dimmer::cook
