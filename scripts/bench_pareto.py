"""What each percent of error costs in microseconds and megabytes: every setting that trades one for the other.

Called by scripts/bench pareto. What was measured is kept in out/pareto and never measured again; each run adds what is
missing, those configurations first that differ from a profile's default in one setting. The report is
out/pareto/pareto.html. Real levels are looked for in ../shared/levels, their irradiance by an independent path tracer in
../shared/truth; the house is held against the cooker's reference path tracer.
"""
import argparse
import csv
import itertools
import json
import pathlib
import resource
import statistics
import sys
import time

from bench_bake import HOUSE, HOUSE_STATES, LEVELS, ROOT, TRUTH, dimmer, light_error, luminance, read, refresh, table
from pareto_report import front, report

OUT = ROOT / "out/pareto"
AXES = {
    "lightmaps.color": ["e5b9g9r9", "r11g11b10f"],
    "lightmaps.model": ["ahd", "linear"],
    "records.threshold": [0.001, 0.003, 0.01, 0.03, 0.1],
    "lightmaps.texels_per_metre": [1, 2, 4, 8],
    "records.overlap_max": [4, 8, 16, 0],
}
# The grid's density touches no texel: it is one axis of its own, from the default.
GRID_AXIS = [20, 40, 100, 300, 1000, 3000]
FLOOR_SHARE = 0.01  # of the mean light with all sets on, as `dimmer verify` has it
UPDATE_SHORT_US = 300
RIVAL, SETTLE_ROUNDS, RIVALS, TURNS = 0.9, 4, 6, 5
ROOF = 2     # as MEASURE, of the roof alone: what an older one gave is not shown
MEASURE = 2  # to be raised when errors() measures otherwise: what was kept by another measure is measured again


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def profiles():
    """The shipped profiles as {name: configuration}."""
    def load(name):
        own = json.loads((ROOT / f"profiles/{name}.json").read_text())
        base = load(own["extends"]) if "extends" in own else {}
        flat = {f"{group}.{key}": value for group, values in own.items() if isinstance(values, dict)
                for key, value in values.items()}
        return base | flat
    found = {}
    for path in sorted((ROOT / "profiles").glob("*.json")):
        if path.stem != "schema":
            settings = load(path.stem)
            found[path.stem] = {key: settings.get(key, 0) for key in AXES}
    return found


def key_of(configuration):
    return " ".join(f"{k.split('.')[1]}={configuration[k]}" for k in sorted(configuration))


def configurations():
    """Defaults first, then what differs from one in one setting, then all the others."""
    defaults = list(profiles().values())
    near = [d | {axis: value} for d in defaults for axis, values in AXES.items() for value in values]
    every = [dict(zip(AXES, values)) for values in itertools.product(*AXES.values())]
    # Configurations of one bake follow each other, the cheap ones first.
    every.sort(key=lambda c: (c["lightmaps.texels_per_metre"], -c["records.threshold"]))
    unique = {key_of(c): c for c in defaults + near + every}
    return list(unique.values())


class Level:
    """A level with its truth: per state, points and luminances with their standard errors."""

    def __init__(self, name, quality):
        self.name, self.quality = name, quality
        self.path = HOUSE if name == "house" else LEVELS / f"{name}.glb"
        self.folder = OUT / f"{name}_{quality}"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.results_file = self.folder / f"results_{MEASURE}.json"
        self.results = json.loads(self.results_file.read_text()) if self.results_file.exists() else {}
        self.cache = self.folder / "cache"

    def keep(self, key, figures):
        self.results[key] = figures
        partial = self.results_file.with_suffix(".part")
        partial.write_text(json.dumps(self.results, indent=1))
        partial.replace(self.results_file)

    def truth(self):
        """{state text: (points file, [(luminance, its standard error)])}, made once."""
        if self.name != "house":
            states = list(json.loads((TRUTH / f"{self.name}.json").read_text())["states"].items())[:5]
            points = TRUTH / f"{self.name}.surface.points.csv"
            return {text: (points, read(TRUTH / f"{self.name}.surface.{state}.csv")) for state, text in states}
        found = {}
        pack = OUT / "house_truth.dimmer"
        for number, text in enumerate(HOUSE_STATES.values()):
            file = OUT / f"house_truth_{number}.csv"  # of every quality
            if not file.exists():
                if not pack.exists():
                    dimmer("cook", self.path, "-o", pack, "--quality", "draft", "--set", "grids.probes_max=0",
                           "--cache", self.cache)
                dimmer("verify", self.path, pack, "--no-sets", "--points", 300, "--state", text, "--csv", file,
                       "--seed", 1 + number)
            rows = [r for r in csv.DictReader(file.open()) if r.get("kind", "surface") == "surface"]
            points = self.folder / f"points_{number}.csv"
            points.write_text("x,y,z,nx,ny,nz\n" + "".join(
                ",".join(r[c] for c in ("x", "y", "z", "nx", "ny", "nz")) + "\n" for r in rows))
            found[text] = (points, [(float(r["reference_lux"]), float(r["reference_error_lux"])) for r in rows])
        return found


def over_states(values, truth):
    """Mean error and 95th percentile of a state, each as the mean over the states that have light at all.

    Both are {state text: [(luminance, its standard error)]}. Errors of a state are those of docs/measurements.md.
    """
    floor = FLOOR_SHARE * statistics.fmean(t for t, _ in truth[""])
    lit = [text for text, of_state in truth.items() if any(t > 0 for t, _ in of_state)]
    found = [light_error(values[text], truth[text], floor) for text in lit]
    return statistics.fmean(f[0] for f in found), statistics.fmean(f[1] for f in found)


def errors(pack, truth, source="surface"):
    values = {}
    for text, (points, _) in truth.items():
        state = ["--state", text] if text else []
        lines = dimmer("sample", pack, "--points", points, "--from", source, *state).splitlines()
        # "nan" where there is no surface.
        values[text] = [(luminance([float(row[c]) for c in ("Er", "Eg", "Eb")]), 0.0) for row in csv.DictReader(lines)]
    return over_states(values, {text: of_state for text, (_, of_state) in truth.items()})


def timed(pack):
    """(report, case, times) of updates of all sets."""
    for frames in (300, 3000):
        bench = json.loads(dimmer("bench", pack, "--frames", frames, "--only", "all sets changed", "--json", "-"))
        update = bench["cases"][0]
        clock = update["process_us" if bench["clock"] == "process" else "gpu_us"]
        if clock["min"] > UPDATE_SHORT_US:  # below, a moment of a shared machine decides
            break
    return bench, update, clock


def cook(level, configuration):
    pack = level.folder / "pack.dimmer"
    settings = itertools.chain.from_iterable(("--set", f"{k}={v}") for k, v in configuration.items())
    dimmer("cook", level.path, "-o", pack, "--quality", level.quality, "--set", "grids.probes_max=0", "--set",
           "budgets.total=0", "--set", "budgets.dynamic=0", "--cache", level.cache, *settings)
    return pack


def measure(level, configuration, truth):
    before = cpu_seconds()
    pack = cook(level, configuration)
    seconds = cpu_seconds() - before
    mean, p95 = errors(pack, truth)
    bench, update, clock = timed(pack)
    size = json.loads(dimmer("inspect", pack, "--json", "-"))
    return {"settings": configuration, "mean": mean, "p95": p95, "update_us": clock["min"],
            "roof": update.get("efficiency", 0), "roof_by": ROOF, "bytes": size["bytes"]["device"],
            "file_bytes": size["bytes"]["file"],
            "cook_s": seconds, "device": bench["device"]}


def with_bake(level, figures):
    """A cook that finds its bake in the cache costs what the first with that bake did."""
    of_bake = {}
    for f in figures.values():
        bake = (f["settings"]["lightmaps.texels_per_metre"], f["settings"]["records.threshold"])
        of_bake[bake] = max(of_bake.get(bake, 0), f["cook_s"])
    for f in figures.values():
        f["bake_s"] = of_bake[(f["settings"]["lightmaps.texels_per_metre"], f["settings"]["records.threshold"])]
    return figures


def work_of(f):
    """Whose updates do the same: packs are alike where a limit drops nothing, and a directional model is an update's
    data, not its work."""
    s = f["settings"]
    return tuple(s[k] for k in AXES if k not in ("records.overlap_max", "lightmaps.model")) + (f["bytes"],)


def with_work(figures):
    """The least time of those whose updates do the same."""
    least = {}
    for f in figures.values():
        least[work_of(f)] = min(least.get(work_of(f), f["update_us"]), f["update_us"])
    return {key: f | {"update_us": least[work_of(f)]} for key, f in figures.items()}


def margin(own, other, axis):
    """Above 1: by so much the other is better in both the mean error and `axis`."""
    return min(own["mean"] / other["mean"], own[axis] / other[axis])


def off_front(figures, key, axis):
    """By which share another configuration is better in both the mean error and `axis`."""
    return max(0, max(margin(figures[key], f, axis) for f in figures.values()) - 1)


def settle(level, configuration):
    """A shared machine is fast now and slow then: what is as right as a default and seems faster, or slower by little,
    is timed in turns with it, and those times stand."""
    key, settled = key_of(configuration), set()
    for _ in range(SETTLE_ROUNDS):
        known = lightmap_results(level)
        rivals = {work_of(f): k for k, f in known.items() if margin(known[key], f, "update_us") > RIVAL}
        rivals.pop(work_of(known[key]), None)
        rivals = {work: k for work, k in rivals.items() if k not in settled}
        if not rivals:
            return
        most = sorted(rivals.values(), key=lambda k: -margin(known[key], known[k], "update_us"))[:RIVALS]
        packs = {}
        for k in [key] + most:
            packs[k] = cook(level, known[k]["settings"]).replace(level.folder / f"turn_{len(packs)}.dimmer")
        times = {k: [] for k in packs}
        for _ in range(TURNS):
            for k, pack in packs.items():
                times[k].append(timed(pack)[2]["min"])
        settled.update(most)
        for k in packs:
            for same in [s for s, f in known.items() if work_of(f) == work_of(known[k])]:
                level.keep(same, level.results[same] | {"update_us": min(times[k])})


def measure_grids(level):
    """Error at free points against the number of probes, from the desktop's default; and for a uniform grid of as many."""
    if level.name == "house":
        return
    states = list(json.loads((TRUTH / f"{level.name}.json").read_text())["states"].items())[:5]
    points = TRUTH / f"{level.name}.free.points.csv"
    truth = {text: (points, read(TRUTH / f"{level.name}.free.{state}.csv")) for state, text in states}
    for probes, uniform in itertools.product(GRID_AXIS, (False, True)):
        key = f"grid probes_max={probes}" + " uniform" * uniform
        if key in level.results:
            continue
        pack = level.folder / "grid.dimmer"
        before = cpu_seconds()
        dimmer("cook", level.path, "-o", pack, "--quality", level.quality, "--set", f"grids.probes_max={probes}",
               "--set", "grids.global=on", *(["--grid-baseline", "uniform", "--no-cache"] if uniform
                                             else ["--cache", level.cache]))
        seconds = cpu_seconds() - before
        mean, p95 = errors(pack, truth, "grid")
        size = json.loads(dimmer("inspect", pack, "--json", "-"))
        level.keep(key, {"grid": probes, "uniform": uniform, "probes": size["receivers"]["global_probes"], "mean": mean, "p95": p95,
                         "bytes": size["bytes"].get("global_grid", 0), "cook_s": seconds})
        print(f"  {level.name}: {key}: mean {100 * mean:.1f} %", flush=True)


def measure_causes(level):
    """What the error at the desktop's default comes from."""
    if "causes" in level.results:
        return
    pack = level.folder / "causes.dimmer"
    dimmer("cook", level.path, "-o", pack, "--quality", level.quality, "--set", "grids.probes_max=0", "--cache",
           level.cache)
    dimmer("verify", level.path, pack, "--no-sets", "--causes", "--points", 200, "--json", level.folder / "causes.json")
    level.keep("causes", json.loads((level.folder / "causes.json").read_text())["causes"])


def chosen(texts):
    """--only as {axis: values}."""
    only = {}
    for text in texts:
        axis, _, values = text.partition("=")
        found = [v for v in AXES.get(axis, []) if str(v) in values.split(",")]
        if len(found) != len(values.split(",")):
            sys.exit(f"--only {text}: not AXIS=VALUE,... with an axis and values of "
                     + "; ".join(f"{a}: {', '.join(map(str, v))}" for a, v in AXES.items()))
        only[axis] = found
    return only


def measure_level(level, deadline, only):
    truth = level.truth()
    missing = [c for c in configurations()
               if key_of(c) not in level.results and all(c[axis] in values for axis, values in only.items())]
    begin = time.monotonic()
    for done, configuration in enumerate(missing):
        if time.monotonic() > deadline:
            print(f"  {level.name}: {len(missing) - done} configurations left for the next run")
            return
        figures = measure(level, configuration, truth)
        level.keep(key_of(configuration), figures)
        left = (time.monotonic() - begin) / (done + 1) * (len(missing) - done - 1)
        print(f"  {level.name} {done + 1}/{len(missing)}, {left / 60:.0f} min left: {key_of(configuration)}: "
              f"{100 * figures['mean']:.2f} %, {figures['update_us']:.0f} us, {figures['bytes'] / 1e6:.2f} MB", flush=True)


def lightmap_results(level):
    found = {k: f | {"roof": f["roof"] if f.get("roof_by") == ROOF else None} for k, f in level.results.items()
             if "settings" in f}
    return with_work(with_bake(level, found))


def front_table(levels):
    shipped = {key_of(c): name for name, c in reversed(profiles().items())}
    rows = []
    for level in levels:
        figures = lightmap_results(level)
        on_time = front(figures, "update_us")
        on_bytes = front(figures, "bytes")
        for key in sorted(set(on_time) | set(on_bytes) | (set(shipped) & set(figures)),
                          key=lambda k: figures[k]["mean"]):
            f = figures[key]
            of = " and ".join(name for name, keys in (("time", on_time), ("bytes", on_bytes)) if key in keys)
            if key in shipped:
                of = f"{of or 'none'}; off by {100 * off_front(figures, key, 'update_us'):.0f} and " \
                     f"{100 * off_front(figures, key, 'bytes'):.0f} %"
            rows.append([level.name, key, f"{100 * f['mean']:.2f}", f"{100 * f['p95']:.1f}", f"{f['update_us']:.0f}",
                         f"{f['roof']:.2f}" if f["roof"] else "-", f"{f['bytes'] / 1e6:.2f}",
                         f"{f['bake_s']:.1f}", of,
                         shipped.get(key, "")])
    return table(["level", "settings", "mean %", "p95 %", "update us", "of the roof", "MB", "cook CPU s", "front",
                  "default of"], rows)


def grids_of(level):
    """Each number of probes once: more than grids.probes_per_m3 allows are never placed."""
    return list({(f["uniform"], f["probes"]): f for f in level.results.values() if "grid" in f}.values())


def grid_table(levels):
    rows = []
    for level in levels:
        grids = grids_of(level)
        for g in sorted(grids, key=lambda g: (g["uniform"], g["probes"])):
            rows.append([level.name, "uniform" if g["uniform"] else "adaptive", str(g["probes"]),
                         f"{100 * g['mean']:.1f}", f"{100 * g['p95']:.0f}", f"{g['bytes'] / 1e3:.0f}"])
    return table(["light grid", "places", "probes", "mean %", "p95 %", "kB"], rows)


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench pareto", description=__doc__.splitlines()[0])
    parser.add_argument("--levels", nargs="*", default=["two_rooms", "house", "lq_old_start", "lq_e2m2", "lq_e2m3"])
    parser.add_argument("--quality", default="draft", choices=["draft", "preview", "final"])
    parser.add_argument("--minutes", type=float, default=60, help="end after so long; the next run goes on from there")
    parser.add_argument("--only", nargs="*", default=[], metavar="AXIS=VALUE,...",
                        help="configurations with these values, as in lightmaps.texels_per_metre=1,2,4: a large level's "
                             "bake takes a quarter of an hour at 8")
    parser.add_argument("--report-only", action="store_true", help="from what was measured before")
    options = parser.parse_args()
    only = chosen(options.only)
    names = [n for n in options.levels if n == "house" or ((LEVELS / f"{n}.glb").exists() and TRUTH.exists())]
    for name in sorted(set(options.levels) - set(names)):
        print(f"{name}: not measured: it is expected in {LEVELS}", file=sys.stderr)
    levels = [Level(name, options.quality) for name in names]
    if not options.report_only:
        begin = time.monotonic()
        for number, level in enumerate(levels):
            share = (number + 1) / len(levels)
            measure_level(level, begin + 60 * options.minutes * share, only)
            measure_causes(level)
            measure_grids(level)
            for configuration in profiles().values():
                if key_of(configuration) in level.results:
                    settle(level, configuration)
    levels = [level for level in levels if lightmap_results(level)]
    page = OUT / "pareto.html"
    page.write_text(report([(level.name, options.quality, lightmap_results(level),
                             grids_of(level), level.results.get("causes", {})) for level in levels],
                           {name: key_of(c) for name, c in profiles().items()}))
    counts = ", ".join(f"{level.name} {len(lightmap_results(level))}" for level in levels)
    refresh("pareto", lambda: f"`scripts/bench pareto --quality {options.quality}`; configurations measured, of "
            f"{len(configurations())} each: {counts}; errors: means over the states that have light, the reference's "
            "noise taken off\n\n" + front_table(levels) + "\n\n" + grid_table(levels))
    print(f"Report: {page}")


if __name__ == "__main__":
    main()
