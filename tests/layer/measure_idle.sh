#!/usr/bin/env bash
# What an idle layer costs a program with many calls: processor time per frame with and without it, run in turns.
# usage: tests/layer/measure_idle.sh [BUILD] [PAIRS]     prints the median of the paired ratios
set -euo pipefail
bin=${1:-build/release}/bin
pairs=${2:-15}
for ((i = 0; i < pairs; ++i)); do
    plain=$("$bin/layer_plain_program" link 40 2>&1 >/dev/null)
    layer=$("$bin/fovea" layer run -- "$bin/layer_plain_program" link 40 2>&1 >/dev/null)
    awk -v p="$plain" -v l="$layer" 'BEGIN { printf "%.6f %.6f %.4f\n", p, l, l / p }'
done | sort -k3n | awk '{ p[NR] = $1; l[NR] = $2; r[NR] = $3 }
    END { m = int((NR + 1) / 2); printf "pairs %d  ratio median %.4f  lowest %.4f  highest %.4f  (at the median: %.6f s plain, %.6f s with the layer, per frame)\n", NR, r[m], r[1], r[NR], p[m], l[m] }'
