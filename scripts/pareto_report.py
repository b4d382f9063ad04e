"""One HTML page, no network: error against update time, memory and cook time, with the fronts; see bench_pareto.py."""
import html
import math

WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 640, 440, 68, 62, 16, 16
DENSITY_COLOURS = {1: "#c9b458", 2: "#5aa469", 4: "#3b7dd8", 8: "#8e44ad"}
PLOTS = [("update_us", "update of all light sets, microseconds"), ("bytes", "device memory, MB"),
         ("bake_s", "cook, CPU seconds")]
STYLE = """
:root { color-scheme: light dark; --ink: #222; --paper: #fff; --faint: #8886; }
@media (prefers-color-scheme: dark) { :root { --ink: #ddd; --paper: #181a1c; } }
body { font: 16px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 0 auto;
       padding: 1rem; max-width: 1320px; }
figure { margin: 0 0 1.5rem; } figcaption { font-weight: 600; margin-bottom: .3rem; }
.grid { max-width: 640px; } .plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr)); gap: 1rem; }
svg { width: 100%; height: auto; display: block; } svg text { fill: var(--ink); font-size: 19px; }
.axis { stroke: var(--ink); } .line { stroke: var(--faint); } .front { fill: none; stroke: #d33; stroke-width: 2; }
circle { fill-opacity: .55; } circle:hover { stroke: var(--ink); stroke-width: 2; fill-opacity: 1; }
.default { fill: none; stroke: var(--ink); stroke-width: 2.5; }
.key span { display: inline-block; margin-right: 1.2em; } .key i { display: inline-block; width: .8em; height: .8em;
  border-radius: 50%; margin-right: .35em; }
table { border-collapse: collapse; } td, th { padding: .15rem .7rem .15rem 0; text-align: right; }
td:first-child, th:first-child { text-align: left; } .scroll { overflow-x: auto; }
"""


def front(figures, cost):
    """Keys that no other beats in both mean error and cost."""
    kept, best = [], math.inf
    for key, f in sorted(figures.items(), key=lambda item: (item[1][cost], item[1]["mean"], item[0])):
        if f["mean"] < best:
            kept.append(key)
            best = f["mean"]
    return kept


def above_front(figures, key, cost):
    """How much more error than the front's best at no more cost, as a share of that error."""
    least = min(f["mean"] for f in figures.values() if f[cost] <= figures[key][cost])
    return figures[key]["mean"] / least - 1


def ticks(low, high):
    """1, 2, 5 times powers of ten within a range."""
    found = []
    for power in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        found += [m * 10.0**power for m in (1, 2, 5) if low <= m * 10.0**power <= high]
    return found


class LogPlot:
    """Both axes logarithmic, 7 to 10 % of room around what is there."""

    def __init__(self, xs, ys, label, about):
        self.x0, self.x1 = min(xs) * 0.9, max(xs) * 1.1
        self.y0, self.y1 = min(ys) * 0.93, max(ys) * 1.07
        out = [f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{about}">']
        for t in ticks(self.x0, self.x1):
            out.append(f'<line class="line" x1="{self.x(t):.1f}" x2="{self.x(t):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>'
                       f'<text x="{self.x(t):.1f}" y="{HEIGHT - BOTTOM + 23}" text-anchor="middle">{t:g}</text>')
        for t in ticks(self.y0, self.y1):
            out.append(f'<line class="line" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{self.y(t):.1f}" y2="{self.y(t):.1f}"/>'
                       f'<text x="{LEFT - 6}" y="{self.y(t) + 4:.1f}" text-anchor="end">{t:g}</text>')
        out.append(f'<text x="{(LEFT + WIDTH) / 2}" y="{HEIGHT - 10}" text-anchor="middle">{label}</text>'
                   f'<text transform="translate(18 {HEIGHT / 2}) rotate(-90)" text-anchor="middle">mean error, %</text>')
        self.parts = out

    def x(self, v):
        return LEFT + (WIDTH - LEFT - RIGHT) * math.log(max(v, self.x0) / self.x0) / math.log(self.x1 / self.x0)

    def y(self, v):
        return HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * math.log(v / self.y0) / math.log(self.y1 / self.y0)

    def dot(self, x, y, colour, title):
        self.parts.append(f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="4" fill="{colour}">'
                          f"<title>{html.escape(title)}</title></circle>")

    def line(self, points, style):
        places = " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in points)
        self.parts.append(f'<polyline {style} points="{places}"/>')

    def name(self, x, y, text):
        cx, cy = self.x(x), self.y(y)
        right = cx > WIDTH * 0.6
        self.parts.append(f'<text x="{cx + (-10 if right else 10):.1f}" y="{cy - 8:.1f}" '
                          f'text-anchor="{"end" if right else "start"}">{html.escape(text)}</text>')

    def finish(self):
        return "\n".join(self.parts + ["</svg>"])


def scatter(figures, cost, label, defaults):
    def at(f):
        return f[cost] * (1e-6 if cost == "bytes" else 1), 100 * f["mean"]

    places = [at(f) for f in figures.values()]
    plot = LogPlot([max(x, 1e-6) for x, _ in places], [y for _, y in places], label, f"mean error against {label}")
    for f in figures.values():
        lines = [f"{k.split('.')[1]} {v}" for k, v in f["settings"].items()]
        lines += [f"mean {100 * f['mean']:.2f} %, 95th percentile {100 * f['p95']:.1f} %",
                  f"{f['update_us']:.0f} us{' (%.2f of the roof)' % f['roof'] if f['roof'] else ''}, "
                  f"{f['bytes'] / 1e6:.2f} MB, "
                  f"{f['bake_s']:.1f} CPU s"]
        plot.dot(*at(f), DENSITY_COLOURS.get(f["settings"]["lightmaps.texels_per_metre"], "#777"), "\n".join(lines))
    if cost != "bake_s":
        plot.line([at(figures[k]) for k in front(figures, cost)], 'class="front"')
    of_key = {}
    for name, key in defaults.items():
        if key in figures:
            of_key.setdefault(key, []).append(name)
    for key, names in of_key.items():
        x, y = at(figures[key])
        plot.parts.append(f'<circle class="default" cx="{plot.x(x):.1f}" cy="{plot.y(y):.1f}" r="7"/>')
        plot.name(x, y, ", ".join(names))
    return plot.finish()


def defaults_table(figures, defaults):
    rows = ["<tr><th>profile<th>mean %<th>above the front of update time<th>above the front of memory</tr>"]
    for name, key in defaults.items():
        if key in figures:
            rows.append(f"<tr><td>{name}<td>{100 * figures[key]['mean']:.2f}"
                        f"<td>{100 * above_front(figures, key, 'update_us'):.0f} %"
                        f"<td>{100 * above_front(figures, key, 'bytes'):.0f} %</tr>")
    return f"<div class=scroll><table>{''.join(rows)}</table></div>"


def grid_plot(grids):
    plot = LogPlot([g["probes"] for g in grids], [100 * g["mean"] for g in grids], "probes", "error against probes")
    for uniform, name, colour in ((False, "adaptive", "#3b7dd8"), (True, "uniform", "#c9b458")):
        line = sorted((g["probes"], 100 * g["mean"]) for g in grids if g["uniform"] == uniform)
        plot.line(line, f'fill="none" stroke="{colour}" stroke-width="2"')
        for probes, error in line:
            plot.dot(probes, error, colour, f"{name}, {probes} probes: {error:.1f} %")
        if line:
            plot.name(*line[0], name)
    return f"<div class=grid>{plot.finish()}</div>"


def causes_table(causes):
    if not causes:
        return ""
    rows = "".join(f"<tr><td>{cause.replace('_', ' ')}<td>{100 * share:.2f}</tr>" for cause, share in causes.items())
    return ("<h3>What the error comes from, as the desktop profile sets it, all on</h3><div class=scroll><table>"
            f"<tr><th>cause<th>mean %</tr>{rows}</table></div>")


def grid_table(grids):
    if not grids:
        return ""
    rows = ["<tr><th>places<th>probes<th>mean %<th>95th percentile %<th>kB<th>cook, CPU s</tr>"]
    rows += [f"<tr><td>{'uniform' if g['uniform'] else 'adaptive'}<td>{g['probes']}<td>{100 * g['mean']:.1f}<td>{100 * g['p95']:.0f}<td>{g['bytes'] / 1e3:.0f}"
             f"<td>{g['cook_s']:.1f}</tr>" for g in sorted(grids, key=lambda g: (g["uniform"], g["probes"]))]
    return f"<h3>Light grid, at free points</h3>{grid_plot(grids)}<div class=scroll><table>{''.join(rows)}</table></div>"


def report(levels, defaults):
    """`levels`: (name, quality, lightmap figures, grid figures, error by cause) each; `defaults`: profile -> key of its settings."""
    body = ["<h1>Run time against error</h1>",
            "<p>Each point is a level cooked with other settings: hover, or touch, for which. The red line joins those "
            "that no other beats in both; circles mark what the shipped profiles set. The mean error is that over "
            "the states that have light; both axes are logarithmic.</p>",
            '<p class="key">' + "".join(f'<span><i style="background:{c}"></i>{d} texels a metre</span>'
                                        for d, c in DENSITY_COLOURS.items()) + "</p>"]
    for name, quality, figures, grids, causes in levels:
        device = next(iter(figures.values()))["device"]
        body.append(f"<h2>{html.escape(name)}, {quality}</h2><p>{len(figures)} configurations; update on "
                    f"{html.escape(device)}</p><div class=plots>")
        for cost, label in PLOTS:
            body.append(f"<figure><figcaption>Error against {label.split(',')[0]}</figcaption>"
                        f"{scatter(figures, cost, label, defaults)}</figure>")
        body.append(f"</div>{defaults_table(figures, defaults)}{causes_table(causes)}"
                    f"{grid_table(grids)}")
    return ("<!doctype html><html lang=en><meta charset=utf-8><title>Run time against error</title>"
            '<meta name=viewport content="width=device-width, initial-scale=1">'
            f"<style>{STYLE}</style><body>{chr(10).join(body)}</body></html>\n")
