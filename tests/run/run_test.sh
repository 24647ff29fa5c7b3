#!/usr/bin/env bash
# ./run as a user runs it: what it leaves when it ends, and that an interrupt at any moment leaves nothing behind.
# Usage: run_test.sh whole|interrupted|restarted
set -uo pipefail
cd "$(dirname "$0")/../.."

fails=0
fail() { echo "FAIL: $*" >&2; fails=1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export TMPDIR=$scratch/tmp
mkdir "$TMPDIR"

leftovers() { # nothing of a run may be left: processes, sockets and run folders, partial results
    local left
    left=$(pgrep -f "$TMPDIR/fovea-run" || true)
    [ -z "$left" ] || fail "$1: processes are left: $left"
    left=$(find "$scratch" -name 'fovea-run*' -o -name '.partial*' -o -name '*.sock' -o -name '*-wal' -o -name '*-shm')
    [ -z "$left" ] || fail "$1: files are left: $left"
}

case "${1-}" in
whole)
    ./run --no-build --duration 2 --out "$scratch/out" -- --size 192 >"$scratch/log" 2>&1 || fail "exit status $?"
    for file in session.fovea frame.png frame_levels.png report.html; do
        [ -s "$scratch/out/$file" ] || fail "no $file"
    done
    grep -q 'motion to photon  ' "$scratch/log" || fail "no summary"
    grep -q 'judged frames' "$scratch/log" || fail "no foveal misses"
    tail -c 20 "$scratch/out/report.html" | grep -q '</html>' || fail "the report is torn"
    frames=$(build/release/bin/fovea latency "$scratch/out/session.fovea" --json | sed -n 's/^  "frames": \([0-9]*\),*/\1/p')
    [ "${frames:-0}" -gt 0 ] || fail "no frames in the session"
    leftovers whole
    ;;
interrupted)
    # A process group of its own, as a terminal gives it; the interrupt goes to all of it.
    set -m
    for delay in 0.05 0.3 0.8 1.5 3; do
        ./run --no-build --duration 30 --out "$scratch/out" -- --size 192 >"$scratch/log" 2>&1 &
        run=$!
        sleep "$delay"
        kill -INT -- "-$run" 2>/dev/null || fail "after $delay s: it had ended already"
        wait "$run"
        status=$?
        [ "$status" -eq 130 ] || fail "after $delay s: exit status $status"
        leftovers "after $delay s"
        [ -z "$(ls -A "$scratch/out" 2>/dev/null)" ] || fail "after $delay s: results of an interrupted run: $(ls -A "$scratch/out")"
    done
    ;;
restarted)
    # The daemon is killed in mid-stream under a running viewer and started again: the viewer goes on by itself, and
    # both sessions hold their frames.
    bin=build/release/bin
    mkdir "$scratch/sockets"
    start_daemon() { # start_daemon SESSION: returns when clients can connect
        mkfifo "$scratch/$1.ready"
        "$bin/fovead" --run-dir "$scratch/sockets" --record "$scratch/$1" --ready-file "$scratch/$1.ready" \
            --set log.level=warn --set source.path=tests/data/recordings/eyelink_lookatpoint_s1.csv >>"$scratch/log" 2>&1 &
        daemon=$!
        for _ in $(seq 150); do
            read -r -t 0.2 _ <>"$scratch/$1.ready" && return
            kill -0 "$daemon" 2>/dev/null || { fail "fovead ended before it was ready"; return; }
        done
        fail "fovead is not ready"
    }
    frames() { "$bin/fovea" latency "$1" --json 2>>"$scratch/log" | sed -n 's/^  "frames": \([0-9]*\),*/\1/p'; }
    has_frames() { [ "$(frames "$1")" -gt 0 ] 2>/dev/null; }
    # Whoever has ended will never do what is waited for.
    alive() { kill -0 "$viewer" 2>/dev/null || { fail "the viewer has ended"; return 1; }; kill -0 "$daemon" 2>/dev/null || { fail "fovead has ended"; return 1; }; }
    wait_for() {
        local end=$((SECONDS + 60))
        while [ "$SECONDS" -lt "$end" ]; do "$@" && return; alive || return; sleep 0.1; done
        fail "waited a minute in vain: $*"
    }

    start_daemon first.fovea
    "$bin/fovea-view" --socket "$scratch/sockets/focus.sock" --duration 0 --size 96 --json >"$scratch/viewer.json" 2>>"$scratch/log" &
    viewer=$!
    wait_for has_frames "$scratch/first.fovea"
    kill -KILL "$daemon"
    wait "$daemon" 2>/dev/null
    has_frames "$scratch/first.fovea" || fail "the killed daemon's frames are lost"
    start_daemon second.fovea
    wait_for has_frames "$scratch/second.fovea"
    kill -INT "$viewer"
    wait "$viewer" || fail "the viewer ended with $?"
    kill -TERM "$daemon"
    wait "$daemon" || fail "fovead ended with $?"
    grep -q '"connects": 2' "$scratch/viewer.json" || fail "the viewer did not reconnect once: $(cat "$scratch/viewer.json")"
    ;;
*) echo "usage: run_test.sh whole|interrupted|restarted" >&2; exit 2 ;;
esac
[ "$fails" -eq 0 ] || { echo "--- log of the last run" >&2; cat "$scratch/log" >&2; exit 1; }
