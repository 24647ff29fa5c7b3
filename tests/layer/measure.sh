#!/usr/bin/env bash
# What the layer costs and saves: an idle layer beside the driver in one process (programs/calls_program.c); then processor time per
# frame (all threads) with and without it, run in turns; the median of the paired ratios.
# usage: tests/layer/measure.sh [BUILD] [PAIRS]
set -euo pipefail
bin=${1:-build/release}/bin
pairs=${2:-9}

# compare NAME PROGRAM PLAIN_ARGUMENTS LAYER_ARGUMENTS
compare() {
    for ((i = 0; i < pairs; ++i)); do
        plain=$("$bin/$2" $3 2>&1 >/dev/null)
        layer=$("$bin/fovea" layer run -- "$bin/$2" $4 2>&1 >/dev/null)
        awk -v p="$plain" -v l="$layer" 'BEGIN { printf "%.6f %.6f %.4f\n", p, l, l / p }'
    done | sort -k3n | awk -v name="$1" '{ p[NR] = $1; l[NR] = $2; r[NR] = $3 }
        END { m = int((NR + 1) / 2); printf "%-46s ratio %.3f  (%.3f to %.3f of %d)  %.2f ms plain\n", name, r[m], r[1], r[NR], NR, p[m] * 1000 }'
}

"$bin/layer_calls_program" "$bin/../lib/liblayer_two_paths.so" "$bin/../lib/libfovea_layer.so" 400
compare "2000 draws, recorded, gain 0" layer_plain_program "link 30" "link 30 0"
compare "1024 x 1024 heavy shader, gain 0" layer_heavy_program "4" "4 0"
compare "1024 x 1024 heavy shader, gain 4" layer_heavy_program "4" "4 4"
compare "1024 x 1024 heavy shader, gain 10" layer_heavy_program "4" "4 10"
