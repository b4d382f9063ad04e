#!/usr/bin/env bash
# scripts/bench update [--frames N]: what updates cost on this machine's Vulkan device: synthetic packs like those of
# UBERBAKE's Table 1, every mode, growth with receivers and with light sets. Tables, JSON and SVG end up in out/bench/.
set -euo pipefail

frames=20
while [ $# -gt 0 ]; do
    case $1 in
        --frames) frames=$2; shift 2 ;;
        *) echo "usage: scripts/bench update [--frames N]" >&2; exit 2 ;;
    esac
done
out=out/bench
mkdir -p "$out"

# synth NAME OPTION...: makes out/bench/NAME.dimmer.
synth() {
    local name=$1
    shift
    "$DIMMER_BIN/dimmer" synth "$@" -o "$out/$name.dimmer"
}
# bench NAME OPTION...: measures it; JSON, SVG and the table beside the pack.
bench() {
    local name=$1
    shift
    "$DIMMER_BIN/dimmer" bench "$out/$name.dimmer" --frames "$frames" --json "$out/$name.json" \
        --plot "$out/$name.svg" "$@" | tee "$out/$name.txt"
}

for clusters in 100 1000 10000; do
    synth "estate_$clusters" --like estate --clusters "$clusters"
    bench "estate_$clusters" --mode all --only changed
done
for level in consulate townhoused safehouse yard; do
    synth "$level" --like "$level"
    bench "$level" --mode all --only changed
done
for scale in 2 4 8; do
    synth "estate_x$scale" --like estate --scale "$scale" --clusters "$((1000 * scale))"
    bench "estate_x$scale" --mode worklist --only "all sets"
done
synth estate_8_times_the_sets --like estate --sets 1056
bench estate_8_times_the_sets --mode worklist --only "all sets"
