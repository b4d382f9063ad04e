# The programs of bench/: the gather against bare Embree, planning on the host, reading a pack, steps through the air.
#
#   scripts/bench programs [PACK]    the pack to read (default: the house at draft, cooked into out/bench)
set -euo pipefail
source scripts/lib.sh

pack=${1:-out/bench/house.dimmer}
if [ $# -eq 0 ]; then
    mkdir -p out/bench
    "$DIMMER_BIN/dimmer" cook game_sample/levels/house.gltf -o "$pack" --quality draft
fi
install_packages "${packages[@]}" "${bench_packages[@]}"
build release "${bench_programs[@]}"
for program in "${bench_programs[@]}"; do
    echo "== $program"
    DIMMER_BENCH_PACK=$pack build/bin/"$program" --benchmark_counters_tabular=true
done
if [ $# -eq 0 ]; then
    build release dimmer_grid_steps
    echo "== dimmer_grid_steps"
    build/bin/dimmer_grid_steps game_sample/levels/house.gltf "$pack"
fi
