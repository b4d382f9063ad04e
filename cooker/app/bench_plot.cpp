#include <app/bench.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace dimmer::cook {
namespace {

constexpr double width = 640, height = 420, left = 70, right = 20, top = 40, bottom = 50;

struct Point {
    double x, y;
};
struct Series {
    std::string name, colour;
    std::vector<Point> points;
};

constexpr std::array<std::pair<std::string_view, std::string_view>, 5> colours = {{
    {"worklist", "#0072b2"},
    {"per-combination", "#d55e00"},
    {"gather", "#009e73"},
    {"scatter", "#cc79a7"},
    {"cpu", "#555555"},
}};

// A decade-aligned logarithmic axis.
struct Axis {
    double low = 1, high = 10;

    void fit(double least, double most) {
        low = std::pow(10, std::floor(std::log10(std::max(least, 1e-3))));
        high = std::pow(10, std::ceil(std::log10(std::max(most, low * 1.001))));
    }
    double share(double value) const { return std::log10(value / low) / std::log10(high / low); }
};

std::string number(double value) {
    return value >= 1e6   ? fmt::format("{:g}M", value / 1e6)
           : value >= 1e3 ? fmt::format("{:g}k", value / 1e3)
                          : fmt::format("{:g}", value);
}

std::string text(double x, double y, std::string_view anchor, std::string_view content, double angle = 0) {
    return fmt::format(
        "<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"{2}\" transform=\"rotate({4} {0:.1f} "
        "{1:.1f})\">{3}</text>\n",
        x, y, anchor, content, angle);
}

std::string grid(const Axis& x, const Axis& y, double origin_x) {
    std::string svg;
    for (double v = x.low; v <= x.high * 1.001; v *= 10) {
        const double px = origin_x + left + x.share(v) * (width - left - right);
        svg += fmt::format("<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#ddd\"/>\n", px, top, height - bottom);
        svg += text(px, height - bottom + 16, "middle", number(v));
    }
    for (double v = y.low; v <= y.high * 1.001; v *= 10) {
        const double py = height - bottom - y.share(v) * (height - top - bottom);
        svg +=
            fmt::format("<path d=\"M{} {:.1f}H{}\" stroke=\"#ddd\"/>\n", origin_x + left, py, origin_x + width - right);
        svg += text(origin_x + left - 6, py + 4, "end", number(v));
    }
    return svg;
}

std::string diagram(const std::vector<Series>& all, std::string_view title, std::string_view x_label, double origin_x) {
    Axis x, y;
    double x_low = INFINITY, x_high = 0, y_low = INFINITY, y_high = 0;
    for (const Series& s : all)
        for (const Point& p : s.points) {
            x_low = std::min(x_low, p.x), x_high = std::max(x_high, p.x);
            y_low = std::min(y_low, p.y), y_high = std::max(y_high, p.y);
        }
    if (x_high == 0) return {};
    x.fit(x_low, x_high);
    y.fit(y_low, y_high);
    std::string svg = grid(x, y, origin_x);
    svg += text(origin_x + width / 2, 20, "middle", title);
    svg += text(origin_x + width / 2, height - 12, "middle", x_label);
    svg += text(origin_x + 16, height / 2, "middle", "microseconds, median", -90);
    double legend_y = top + 12;
    for (const Series& s : all) {
        if (s.points.empty()) continue;
        for (const Point& p : s.points)
            svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n",
                               origin_x + left + x.share(p.x) * (width - left - right),
                               height - bottom - y.share(p.y) * (height - top - bottom), s.colour);
        svg += fmt::format("<circle cx=\"{}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", origin_x + left + 12,
                           legend_y - 4, s.colour);
        svg += text(origin_x + left + 20, legend_y, "start", s.name);
        legend_y += 16;
    }
    return svg;
}

// cost(result) and x(result) of each mode's cases; points without both are left out.
template <class X>
std::vector<Series> seriesOf(const BenchReport& report, X x) {
    std::vector<Series> all;
    for (const auto& [mode, colour] : colours) {
        Series series{std::string(mode), std::string(colour), {}};
        for (const CaseResult& r : report.results) {
            if (r.mode != mode) continue;
            const Spread& us = mode == "cpu" ? r.host_us : report.clock == "process" ? r.process_us : r.gpu_us;
            if (x(r) > 0 && us.median > 0) series.points.push_back({x(r), us.median});
        }
        all.push_back(std::move(series));
    }
    return all;
}

}  // namespace

std::string plotSvg(const BenchReport& report) {
    const auto receivers = [](const CaseResult& r) { return static_cast<double>(r.largest.receivers); };
    const auto sets = [](const CaseResult& r) { return static_cast<double>(r.sets); };
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" font-family=\"sans-serif\" "
        "font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n{2}{3}</svg>\n",
        2 * width, height,
        diagram(seriesOf(report, receivers), "Cost of an update against receivers changed",
                "receivers of the changed clusters", 0),
        diagram(seriesOf(report, sets), "Cost of an update against light sets changed", "light sets changed", width));
}

}  // namespace dimmer::cook
