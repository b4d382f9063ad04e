#!/usr/bin/env python3
"""What updates cost on this machine's Vulkan device: packs like those of UBERBAKE's Table 1, every mode, growth.

Packs, JSON and SVG end up in out/bench/; on a Vulkan device that is a CPU the tables of docs/measurements.md are made
anew, on others they end up in out/bench/, too. The Vulkan loader's VK_DRIVER_FILES chooses among devices."""
import argparse
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/measurements.md"
OUT = ROOT / "out/bench"
MODES = ["worklist", "per-combination", "gather", "scatter", "cpu"]
LEVELS = [(f"{name}, {n:,} clusters", f"{name}_{n}", ["--like", name, "--clusters", str(n)])
          for name in ("estate", "consulate", "townhoused", "safehouse", "yard") for n in (100, 1000, 10000)]
ESTATE = LEVELS[1]
PROBES = ("estate, 1,000 clusters, with probes", "estate_probes",
          ["--like", "estate", "--clusters", "1000", "--probes"])
FLICKER_FRAMES = 1000
devices = {}  # those that were measured, and their clocks
GROWTH = [("estate, 1,000 clusters", "estate_1000", ["--like", "estate", "--clusters", "1000"])] + [
    (f"{n} x the receivers and clusters", f"estate_x{n}",
     ["--like", "estate", "--scale", str(n), "--clusters", str(1000 * n)]) for n in (2, 4, 8)] + [
    ("8 x the sets, the same receivers", "estate_sets_x8", ["--like", "estate", "--sets", "1056"])]


def measure(name, synth, frames, *options):
    """Makes the pack, measures it and returns the cases."""
    tool = [os.path.join(os.environ.get("DIMMER_BIN", "build/bin"), "dimmer")]
    pack = OUT / f"{name}.dimmer"
    subprocess.run(tool + ["synth", *synth, "-o", pack], check=True)
    figures = OUT / f"{name}.json"
    subprocess.run(tool + ["bench", pack, "--frames", str(frames), "--json", figures, "--plot", OUT / f"{name}.svg",
                           *options], check=True)
    report = json.loads(figures.read_text())
    devices[report["device"]] = report["clock"]
    return report


def cost(report, case):
    """Milliseconds: of the processors on a Vulkan device that is one, else of the GPU."""
    clock = "process_us" if report["clock"] == "process" or case["mode"] == "cpu" else "gpu_us"
    return case[clock]["median"] / 1000


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| --- |" + " ---: |" * (len(head) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def modes_table(levels, frames):
    rows = []
    for label, name, synth in levels:
        report = measure(name, synth, frames, "--mode", "all", "--only", "all sets changed")
        by_mode = {case["mode"]: case for case in report["cases"]}
        work = by_mode["worklist"]
        rows.append([label, f"{work['receivers'] / 1e6:.2f}"] + [f"{cost(report, by_mode[m]):.1f}" for m in MODES] +
                    [f"{cost(report, by_mode['per-combination']) / cost(report, work):.1f}",
                     f"{work['efficiency']:.2f}", f"{work['efficiency_pages']:.2f}"])
    return table(["level", "M receivers", *MODES, "per-combination / worklist", "roof / worklist",
                  "pages' roof / worklist"], rows)


def growth_table(frames):
    rows, first = [], None
    for label, name, synth in GROWTH:
        report = measure(name, synth, frames, "--mode", "worklist", "--only", "all sets changed")
        case = report["cases"][0]
        first = first or cost(report, case)
        rows.append([label, f"{case['receivers'] / 1e6:.2f}", f"{cost(report, case):.1f}",
                     f"{cost(report, case) / first:.2f}", f"{case['host_us']['median']:.0f}"])
    return table(["pack", "M texels active", "ms", "times the first", "host us"], rows)


def toggles(report):
    """Of the light sets that are toggled alone: the one with the fewest receivers, the middle one, and the most."""
    sets = sorted((c for c in report["cases"] if c["name"].startswith("set ") and c["receivers"] > 0),
                  key=lambda c: c["receivers"])
    return [sets[0], sets[len(sets) // 2], sets[-1]]


def cases_table(frames):
    estate = measure(ESTATE[1], ESTATE[2], frames, "--mode", "worklist")
    changed = [c for c in estate["cases"] if c["name"].endswith("changed")]
    flicker = measure(ESTATE[1], ESTATE[2], FLICKER_FRAMES, "--mode", "worklist", "--only", "flicker")
    doors = measure("townhoused", ["--like", "townhoused"], frames, "--mode", "worklist", "--only", "door ")
    models = measure(PROBES[1], PROBES[2], frames, "--mode", "worklist", "--only", "models")
    rows = []
    for report, cases, of in ((estate, changed[:1] + toggles(estate) + changed[1:], ""),
                              (flicker, flicker["cases"], f", {FLICKER_FRAMES:,} updates"),
                              (doors, doors["cases"], ", townhoused"), (models, models["cases"], ", with probes")):
        rows += [[case["name"] + of, f"{case['receivers']:,}", f"{cost(report, case):.2f}",
                  f"{1e6 * cost(report, case) / case['receivers']:.1f}" if case["receivers"] else "-",
                  f"{case['host_us']['median']:.1f}"] for case in cases]
    return table(["case", "receivers", "ms", "ns per receiver", "host us"], rows)


def refresh(topic, text):
    begin, end = f"<!-- {topic}: begin -->", f"<!-- {topic}: end -->"
    page = PAGE.read_text()
    if begin not in page or end not in page:
        raise SystemExit(f"{PAGE}: the markers of '{topic}' are missing")
    PAGE.write_text(f"{page[:page.index(begin)]}{begin}\n{text}\n{page[page.index(end):]}")


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench update", description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=20, help="updates measured per case")
    parser.add_argument("--only", choices=["modes", "growth", "cases"], help="one part of it")
    options = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    parts = {"modes": lambda: modes_table(LEVELS + [PROBES], options.frames),
             "growth": lambda: growth_table(options.frames), "cases": lambda: cases_table(options.frames)}
    for name, part in parts.items():
        if options.only not in (None, name):
            continue
        text = f"`scripts/bench update --only {name} --frames {options.frames}`\n\n{part()}"
        if "gpu" not in devices.values():
            refresh(f"update {name}", text)
        else:  # the page's tables are lavapipe's, and the text around them speaks of it
            (OUT / f"{name}.md").write_text(f"{', '.join(devices)}\n\n{text}\n")
            print(f"{', '.join(devices)}: {OUT / name}.md")


if __name__ == "__main__":
    main()
