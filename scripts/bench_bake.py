"""Accuracy of the baker and of the reference path tracer; see docs/measurements.md.

Called by scripts/bench bake. Levels and irradiance that an independent path tracer computed for them are expected in
../shared/levels and ../shared/truth; without them only the house is measured.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
LEVELS = ROOT.parent / "shared/levels"
TRUTH = ROOT.parent / "shared/truth"
PAGE = ROOT / "docs/measurements.md"
DIMMER = str((ROOT / os.environ.get("DIMMER_BIN", "build/bin") / "dimmer").resolve())
HOUSE = ROOT / "game_sample/levels/house.gltf"
HOUSE_PROFILE = ROOT / "game_sample/house_profile.json"
HOUSE_STATES = {"all on": "", "all off": "all=0", "alarm and desk": "all=0,alarm=1/0.2/0.2,desk=0.5",
                "half, den open": "all=0.5,door:den=1", "front open": "all=0,door:front=1"}
CAUSES = ["noise", "series_expansion", "texel_size", "activity_threshold", "colour_format", "directional_model"]
NORMAL_MEAN, NORMAL_P95 = math.sqrt(2 / math.pi), 1.959964  # magnitude of a standard normal number


def dimmer(*arguments):
    done = subprocess.run([DIMMER, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"dimmer {' '.join(map(str, arguments))}\n{done.stderr}")
    return done.stdout


def luminance(rgb):
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]


def read(file):
    """Rows as (luminance, its standard error or 0); the error as if the channels erred together, its upper bound."""
    with open(file) as stream:
        rows = [[float(x) for x in row] for row in list(csv.reader(stream))[1:]]
    return [(luminance(r[6:9]), luminance(r[9:12]) if len(r) > 9 else 0.0) for r in rows]


def without(measured, noise):
    return math.sqrt(max(0.0, measured**2 - noise**2))


def light_error(values, truth, floor):
    """Mean and 95th percentile of |E - E_ref| / (E_ref + floor), the truth's noise off in quadrature; bias."""
    kept = [(v, t, s) for (v, _), (t, s) in zip(values, truth) if not math.isnan(v) and t + floor > 0]
    errors = sorted(abs(v - t) / (t + floor) for v, t, _ in kept)
    noise = sum(s / (t + floor) for _, t, s in kept) / len(kept)
    p95 = errors[math.ceil(0.95 * len(errors)) - 1]
    total = sum(t for _, t, _ in kept)
    bias = (sum(v for v, _, _ in kept) - total) / total if total > 0 else 0
    return without(sum(errors) / len(errors), NORMAL_MEAN * noise), without(p95, NORMAL_P95 * noise), bias, len(kept)


def effect_error(values, truth):
    """sum |dE - dE_ref| / sum |dE_ref| over points where |dE_ref| exceeds three standard errors."""
    kept = [(v, t, s) for (v, _), (t, s) in zip(values, truth) if not math.isnan(v) and abs(t) > 3 * s]
    scale = sum(abs(t) for _, t, _ in kept)
    if scale == 0:
        return None
    measured = sum(abs(v - t) for v, t, _ in kept) / scale
    noise = NORMAL_MEAN * sum(s for _, _, s in kept) / scale
    return without(measured, noise), sum(v - t for v, t, _ in kept) / scale, noise, len(kept)


def minus(a, b):
    return [(x - y, math.hypot(s, t)) for (x, s), (y, t) in zip(a, b)]


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "|".join([" --- "] + [" ---: "] * (len(header) - 1)) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def percent(x):
    return f"{100 * x:.2f} %"


def level_states(level):
    return json.loads((TRUTH / f"{level}.json").read_text())["states"]


def reference_table(levels, paths, folder):
    rows = []
    for level in levels:
        jobs = [(kind, name, state, f"{level}.{kind}.points.csv", f"{level}.{kind}.{name}.csv")
                for name, state in level_states(level).items() for kind in ("surface", "free")]
        openings = TRUTH / f"{level}.openings.json"
        for i, opening in enumerate(json.loads(openings.read_text())["openings"] if openings.exists() else []):
            points = f"{level}.opening_{i}.points.csv"
            jobs.append((f"opening {i}", "closed", "", points, f"{level}.opening_{i}.closed.csv"))
            jobs.append((f"opening {i}", "open", opening["state"], points, f"{level}.opening_{i}.open.csv"))
        for kind, name, state, points, truth_file in jobs:
            out = folder / "reference.csv"
            dimmer("reference", LEVELS / f"{level}.glb", "--points", TRUTH / points, "--state", state, "--paths", paths,
                   "-o", out)
            ours, truth = read(out), read(TRUTH / truth_file)
            pairs = [(a - b, math.hypot(s, t)) for (a, s), (b, t) in zip(ours, truth)]
            z2 = [d * d / (s * s) for d, s in pairs if s > 0]
            wrong = sum(1 for d, s in pairs if s == 0 and d != 0)
            total = sum(t for t, _ in truth)
            difference, noise = sum(d for d, _ in pairs), math.sqrt(sum(s * s for _, s in pairs))
            cells = ["black in both" if not wrong else f"{wrong} points differ", "", ""] if not z2 else [
                f"{sum(z2) / len(z2):.3f}", f"{math.sqrt(2 / len(z2)):.3f}", f"{max(z2) ** 0.5:.1f}"]
            mean = f"{100 * difference / total:+.2f} ± {100 * noise / total:.2f} %" if total > 0 else ""
            rows.append([level, kind, name, str(len(z2)), *cells, mean])
            print(*rows[-1], flush=True)
    return table(["level", "points", "state", "n", "chi²/n", "its σ", "largest z", "mean difference"], rows)


def given_openings(level, pack, folder):
    """What opening each door does at the points that it changes most, and the light there with the door open."""
    file = TRUTH / f"{level}.openings.json"
    for i, opening in enumerate(json.loads(file.read_text())["openings"] if file.exists() else []):
        ours, truth = {}, {}
        for name, state in (("closed", ""), ("open", opening["state"])):
            out = folder / "sample.csv"
            dimmer("sample", pack, "--points", TRUTH / f"{level}.opening_{i}.points.csv", "--state", state, "-o", out)
            ours[name], truth[name] = read(out), read(TRUTH / f"{level}.opening_{i}.{name}.csv")
        error, bias, noise, n = effect_error(minus(ours["open"], ours["closed"]), minus(truth["open"], truth["closed"]))
        there = [(v, t, s) for (v, _), (t, s) in zip(ours["open"], truth["open"]) if not math.isnan(v)]
        all_light = sum(t for _, t, _ in there)
        light = without(sum(abs(v - t) for v, t, _ in there) / all_light,
                        NORMAL_MEAN * sum(s for _, _, s in there) / all_light)
        yield [level, opening["door"], percent(error), f"{100 * bias:+.2f} %", percent(noise), str(n), percent(light)]


def pack_tables(levels, quality, folder):
    errors, effects, doors = [], [], []
    for level in levels:
        pack = folder / f"{level}.dimmer"
        started = time.monotonic()
        dimmer("cook", LEVELS / f"{level}.glb", "-o", pack, "--quality", quality)
        print(f"{level}: cooked in {time.monotonic() - started:.1f} s", flush=True)
        states = {n: s for n, s in level_states(level).items() if "door:" not in s}
        truth = {n: read(TRUTH / f"{level}.surface.{n}.csv") for n in states}
        floor = 0.01 * sum(t for t, _ in truth["all_on"]) / len(truth["all_on"])
        ours = {}
        for name, state in states.items():
            out = folder / "sample.csv"
            dimmer("sample", pack, "--points", TRUTH / f"{level}.surface.points.csv", "--state", state, "-o", out)
            ours[name] = read(out)
            mean, p95, bias, n = light_error(ours[name], truth[name], floor)
            errors.append([level, name, str(n), percent(mean), percent(p95), f"{100 * bias:+.2f} %"])
            print(*errors[-1], flush=True)
        parts = [("first set", "only_first", "all_off"), ("middle set", "only_middle", "all_off"),
                 ("all sets but the first", "all_on", "only_first")]
        for what, lit, unlit in parts:
            if lit not in states or unlit not in states:
                continue
            effect = effect_error(minus(ours[lit], ours[unlit]), minus(truth[lit], truth[unlit]))
            cells = ["below the truth's noise", "", "", "0"] if effect is None else [
                percent(effect[0]), f"{100 * effect[1]:+.2f} %", percent(effect[2]), str(effect[3])]
            effects.append([level, what, *cells])
            print(*effects[-1], flush=True)
        for row in given_openings(level, pack, folder):
            doors.append(row)
            print(*row, flush=True)
    return (table(["level", "state", "points", "mean error", "95th percentile", "bias"], errors),
            table(["level", "what", "error", "bias", "truth's noise", "points"], effects),
            table(["level", "door opened", "error", "bias", "truth's noise", "points", "light there"], doors))


def verify_tables(levels, quality, points, paths, folder):
    errors, effects, causes, formats = [], [], [], []
    for name, level, profile in levels:
        pack, report = folder / "verify.dimmer", folder / "verify.json"
        dimmer("cook", level, "-o", pack, "--quality", quality, "--profile", profile)
        dimmer("verify", level, pack, "--points", points, "--paths", paths, "--causes", "--formats", "--json", report)
        found = json.loads(report.read_text())
        for kind in ("surface", "tilted"):
            f = found[kind]
            errors.append([name, kind, str(f["points"]), percent(f["mean"]), percent(f["p95"]), percent(f["rmse"]),
                           f"{100 * f['bias']:+.2f} %", percent(f["reference_relative_standard_error"])])
            print(*errors[-1], flush=True)
        for s in found["sets"]:
            effects.append([name, s["name"], percent(s["error"]), f"{100 * s['bias']:+.2f} %",
                            percent(s["reference_noise"]), str(s["points"]), percent(s["energy_dropped"])])
            print(*effects[-1], flush=True)
        causes.append([name, *(percent(found["causes"][c]) for c in CAUSES)])
        print(*causes[-1], flush=True)
        for color, model in dict.fromkeys((f["color"], f["model"]) for f in found["formats"]):
            cells = [f"{percent(f['mean'])}, {percent(f['p95'])}" for f in found["formats"]
                     if (f["color"], f["model"]) == (color, model)]
            formats.append([name, f"{color}, {model}", *cells])
    return (table(["level", "normals", "points", "mean", "95th percentile", "RMSE", "bias", "reference error"], errors),
            table(["level", "light set", "error", "bias", "reference noise", "points", "energy dropped"], effects),
            table(["level", *(c.replace("_", " ") for c in CAUSES)], causes),
            table(["level", "stored as", "1 set: mean, 95 %", "3 sets", "8 sets"], formats))


def states_table(points, paths, folder):
    """The house at final in several states of its sets and doors."""
    rows = []
    for name, profile in (("house", "desktop"), ("house, own profile", HOUSE_PROFILE)):
        pack, report = folder / "states.dimmer", folder / "states.json"
        dimmer("cook", HOUSE, "-o", pack, "--quality", "final", "--profile", profile, "--set", "grids.global=off")
        for state, text in HOUSE_STATES.items():
            dimmer("verify", HOUSE, pack, "--points", points, "--paths", paths, "--no-sets", "--state", text, "--json",
                   report)
            f = json.loads(report.read_text())["surface"]
            rows.append([name, state, str(f["points"]), percent(f["mean"]), percent(f["p95"]),
                         f"{100 * f['bias']:+.2f} %", percent(f["reference_relative_standard_error"])])
            print(*rows[-1], flush=True)
    return table(["level", "state", "points", "mean", "95th percentile", "bias", "reference error"], rows)


def openings_table(points, paths, folder):
    """What opening each door of the house does, at final and 8 texels per metre: as it is and without combinations."""
    rows = []
    for name, level in (("no combinations", door_variant(folder, "doors", True)), ("its three pairs named", HOUSE)):
        pack, report = folder / "openings.dimmer", folder / "openings.json"
        dimmer("cook", level, "-o", pack, "--quality", "final", "--profile", HOUSE_PROFILE, "--set", "grids.global=off")
        dimmer("verify", level, pack, "--points", points, "--paths", paths, "--no-sets", "--doors", "--json", report)
        for d in json.loads(report.read_text())["doors"]:
            there = d.get("light_there")
            rows.append([name, d["door"], d["light"], f"{100 * d['error']:.1f} ± {100 * d['sampling_error']:.1f} %",
                         f"{100 * d['bias']:+.1f} %", f"{100 * d['reference_noise']:.1f} %",
                         f"{100 * d['elsewhere']:.1f} %", str(d["points"]), f"{100 * there['error']:.1f} %" if there else ""])
            print(*rows[-1], flush=True)
    return table(["the house with", "door", "light", "error", "bias", "reference noise", "elsewhere", "points",
                  "light there"], rows)


def house_variant(folder, name, rename):
    """The house with other light sets: rename(set, how many of it came before) -> set or None (always on)."""
    level = json.loads(HOUSE.read_text())
    seen = {}
    for part in level["nodes"] + level.get("meshes", []) + level.get("materials", []) + level.get("lights", []):
        extras = part.get("extras", {})
        if "dimmer_light_set" not in extras:
            continue
        old = extras["dimmer_light_set"]
        new = rename(old, seen.get(old, 0))
        seen[old] = seen.get(old, 0) + 1
        extras.pop("dimmer_max_weight", None)
        if new is None:
            extras.pop("dimmer_light_set")
        else:
            extras["dimmer_light_set"] = new
    shutil.copy(HOUSE.parent / "house.bin", folder)
    file = folder / f"{name}.gltf"
    file.write_text(json.dumps(level))
    return file


def door_variant(folder, name, doors):
    """The house without its combinations, and without its doors: leaves as plain geometry."""
    level = json.loads(HOUSE.read_text())
    level["scenes"][0]["extras"].pop("dimmer_combinations")
    for node in level["nodes"] if not doors else []:
        extras = node.get("extras", {})
        for key in [key for key in extras if key.startswith("dimmer_door")]:
            extras.pop(key)
    shutil.copy(HOUSE.parent / "house.bin", folder)
    file = folder / f"{name}.gltf"
    file.write_text(json.dumps(level))
    return file


def cook_seconds(level, quality, folder, *options):
    """Processor seconds of a cook, lamps whole, what it traced and what it stored."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    text = dimmer("cook", level, "-o", folder / "sets.dimmer", "--no-cache", "--quality", quality,
                  "--set", f"bake.{quality}.lamps_apart=0", *options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    overlap = json.loads(dimmer("inspect", folder / "sets.dimmer", "--json", "-"))
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, text, overlap


def sets_table(folder, runs):
    """What light sets cost: the same lights all always on, in 12 and 24 sets, and with a gather for each set."""
    variants = [("all lights in the base", house_variant(folder, "base", lambda s, i: None), []),
                ("12 sets", HOUSE, []),
                ("24 sets", house_variant(folder, "sets24", lambda s, i: f"{s}{i % 2}"), []),
                ("24 sets, --per-set-passes", folder / "sets24.gltf", ["--per-set-passes"])]
    rows = []
    for quality in ("draft", "preview"):
        taken = {name: [] for name, _, _ in variants}
        for _ in range(runs):  # in turns: what else the machine does falls on all alike
            for name, level, options in variants:
                seconds, text, pack = cook_seconds(level, quality, folder, *options)
                taken[name].append((seconds, text, pack))
        first = statistics.median(t[0] for t in taken[variants[0][0]])
        for name, _, _ in variants:
            seconds = statistics.median(t[0] for t in taken[name])
            text, pack = taken[name][0][1:]
            histogram = pack["overlap_histogram"]
            pairs, texels = sum(n * count for n, count in enumerate(histogram)), sum(histogram)
            rays = text.split(" rays")[0].split(", ")[-1]
            rows.append([quality, name, f"{seconds:.2f}", f"{seconds / first:.2f}", rays, f"{pairs / texels:.1f}"])
            print(*rows[-1], flush=True)
    return table(["quality", "the house with", "CPU s", "times the base", "rays", "mean overlap"], rows)


def doors_table(folder, runs):
    """What the house's three doors cost: leaves as plain geometry, doors without their pairs, doors as they are."""
    variants = [("no doors", door_variant(folder, "plain", False)),
                ("3 doors, no combinations", door_variant(folder, "doors", True)),
                ("3 doors and their pairs", HOUSE)]
    rows = []
    for quality in ("draft", "preview", "final"):
        taken = {name: [] for name, _ in variants}
        for _ in range(runs if quality != "final" else 1):  # a single cook at final takes as long as all of preview's
            for name, level in variants:
                taken[name].append(cook_seconds(level, quality, folder))
        first = statistics.median(t[0] for t in taken[variants[0][0]])
        for name, _ in variants:
            seconds = statistics.median(t[0] for t in taken[name])
            rays = taken[name][0][1].split(" rays")[0].split(", ")[-1]
            kilobytes = taken[name][0][2]["bytes"]["dynamic"] / 1000
            rows.append([quality, name, f"{seconds:.2f}", f"{100 * (seconds / first - 1) / 3:.0f} %", rays,
                         f"{kilobytes:.0f} kB"])
            print(*rows[-1], flush=True)
    return table(["quality", "the house with", "CPU s", "per door", "rays", "records"], rows)


def refresh(topic, measure):
    """Puts what measure() returns between the page's markers; asks for the markers first, as it may take an hour."""
    begin, end = f"<!-- {topic}: begin -->", f"<!-- {topic}: end -->"
    page = PAGE.read_text()
    if begin not in page or end not in page:
        raise SystemExit(f"{PAGE}: the markers of '{topic}' are missing")
    text = measure()
    page = PAGE.read_text()
    head, tail = page[:page.index(begin)], page[page.index(end):]
    PAGE.write_text(f"{head}{begin}\n{text}\n{tail}")


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench bake", description=__doc__.splitlines()[0])
    parser.add_argument("--levels", nargs="*", default=["two_rooms", "lq_old_start", "lq_e2m2", "lq_e2m3"])
    parser.add_argument("--quality", default="draft", choices=["draft", "final"])
    parser.add_argument("--paths", type=int, default=4096, help="per point, reference against truth")
    parser.add_argument("--points", type=int, default=500, help="verify's random points")
    parser.add_argument("--verify-paths", type=int, default=16384, help="per point, at most")
    parser.add_argument("--only", help="one part of it",
                        choices=["reference", "packs", "verify", "states", "sets", "doors", "openings"])
    parser.add_argument("--runs", type=int, default=3, help="cooks of each kind, of which the median counts")
    options = parser.parse_args()
    levels = [name for name in options.levels if (LEVELS / f"{name}.glb").exists() and TRUTH.exists()]
    if not levels:
        print("the levels with given irradiance are not here: the house alone is measured")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        def part(name, *more):
            return " ".join([f"`scripts/bench bake --only {name}", *more]) + "`\n\n"

        runs = f"--runs {options.runs}"
        if options.only in (None, "sets"):
            refresh("sets", lambda: part("sets", runs) + sets_table(folder, options.runs))
        if options.only in (None, "doors"):
            refresh("doors", lambda: part("doors", runs) + doors_table(folder, options.runs))
        paths = [f"--points {options.points}", f"--verify-paths {options.verify_paths}"]
        if options.only in (None, "openings"):
            refresh("openings", lambda: part("openings", *paths)
                    + openings_table(options.points, options.verify_paths, folder))
        if options.only in (None, "states"):
            refresh("states", lambda: part("states", *paths)
                    + states_table(options.points, options.verify_paths, folder))
        if levels and options.only in (None, "reference"):
            refresh("reference", lambda: part("reference", f"--paths {options.paths}")
                    + reference_table(levels, options.paths, folder))
        quality = f"--quality {options.quality}"
        if levels and options.only in (None, "packs"):
            refresh(f"packs {options.quality}", lambda: part("packs", quality)
                    + "\n\n".join(pack_tables(levels, options.quality, folder)))
        if options.only in (None, "verify"):
            measured = [("house", HOUSE, "desktop"), ("house, own profile", HOUSE, HOUSE_PROFILE)]
            measured += [(n, LEVELS / f"{n}.glb", "desktop") for n in levels if n == "two_rooms"]
            refresh(f"verify {options.quality}", lambda: part("verify", quality, *paths) + "\n\n".join(
                verify_tables(measured, options.quality, options.points, options.verify_paths, folder)))


if __name__ == "__main__":
    main()
