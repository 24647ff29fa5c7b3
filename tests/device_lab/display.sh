# The lab's display, sourced by cases.sh: a kernel screen with real vertical blanks (vkms), and a compositor on it.

# photons SESSION: how the photon instants of its frames lie: how many, marked how, whether they rise, and how far their
# distances are from whole refresh periods of 60 Hz, in microseconds.
photons() {
    python3 - "$1" <<'PY'
import sqlite3, sys
rows = sqlite3.connect(sys.argv[1]).execute("SELECT photon_ns, gpu_done_ns, photon_simulated != 0 FROM frames ORDER BY n").fetchall()
steps = [b[0] - a[0] for a, b in zip(rows, rows[1:])]
period = 1e9 / 60.004
off = max((abs(s - round(s / period) * period) / max(round(s / period), 1) for s in steps), default=-1)
print("frames=%d unmeasured=%d falling=%d before_done=%d off_us=%.1f" % (
    len(rows), sum(r[2] for r in rows), sum(s <= 0 for s in steps), sum(r[0] <= r[1] for r in rows), off / 1e3))
PY
}
on_grid() { # on_grid TEXT: 50 us a period: the rate of the grid is known to 3e-5 only
    awk -v off="$(field "$1" off_us)" 'BEGIN {exit !(off >= 0 && off < 50)}'
}

# The emulated processor draws slowly: few pixels, one pass, shaders compiled without optimisation.
light="--scene fragbox --method full --size 32x480 --json"
export GALLIVM_PERF=nopt

case_display() {
    local result
    step "display: vkms"
    modprobe -a drm drm_kms_helper drm_shmem_helper
    insmod "$LAB_VKMS"
    await 5 ls /dev/dri/card0 || { bad "display: the virtual screen appears"; return; }
    start_daemon "source.path=$PWD/$recording"
    FOVEA_KMS_MODE=640x480 "$LAB_BIN/fovea-view" --socket /run/lab/fovea/focus.sock --present kms $light --frames 40 >/run/lab/kms.json 2>/run/lab/kms.err
    check $? "display: fovea-view on a bare screen ($(cat /run/lab/kms.err))"
    stop_daemon display
    grep -q '"photons_estimated": 0' /run/lab/kms.json && grep -q '"simulated": false' /run/lab/kms.json
    check $? "display: every page flip has told its time ($(grep -o '"photons_measured": [0-9]*' /run/lab/kms.json))"
    result=$(photons /run/lab/session.fovea)
    [ "$(field "$result" frames)" -ge 38 ] && [ "$(field "$result" unmeasured)" = 0 ] && [ "$(field "$result" falling)" = 0 ] && [ "$(field "$result" before_done)" = 0 ]
    check $? "display: its photons are measured, rise, and follow the GPU ($result)"
    on_grid "$result"
    check $? "display: they lie on the screen's vertical blanks"
    cp /run/lab/kms.json /out/
    echo "MEASURED kms: $(tr -d ' \n' </run/lab/kms.json | grep -o '"latch":.*"motion_to_photon_ms":[0-9.]*')"
    case_display_wayland
}

case_display_wayland() {
    local weston result
    step "display: weston on vkms"
    command -v weston >/dev/null || { echo "SKIP display: weston is not installed (apt-get install weston)"; return; }
    mkdir -p -m 700 /run/lab/wayland
    modprobe -a evdev uinput
    printf '[core]\nrequire-input=false\nidle-time=0\n[output]\nname=Virtual-1\nmode=640x480\n' >/run/lab/weston.ini
    XDG_RUNTIME_DIR=/run/lab/wayland LIBSEAT_BACKEND=builtin SEATD_VTBOUND=0 weston -c /run/lab/weston.ini --backend=drm-backend.so --drm-device=card0 --use-pixman \
        --tty=1 --socket=lab --continue-without-input >/run/lab/weston.log 2>&1 &
    weston=$!
    await 60 test -S /run/lab/wayland/lab || { tail -5 /run/lab/weston.log; bad "display: weston starts"; return; }
    start_daemon "source.path=$PWD/$recording"
    XDG_RUNTIME_DIR=/run/lab/wayland WAYLAND_DISPLAY=lab "$LAB_BIN/fovea-view" --socket /run/lab/fovea/focus.sock $light --frames 30 \
        >/run/lab/wayland.json 2>/run/lab/wayland.err
    check $? "display: fovea-view in a window, chosen by itself ($(cat /run/lab/wayland.err))"
    stop_daemon display
    grep -q '"photons_estimated": 0' /run/lab/wayland.json && grep -q '"presenter": "wayland"' /run/lab/wayland.json
    check $? "display: presentation feedback comes from the hardware ($(grep -oE '"(photons_measured|never_shown)": [0-9]*' /run/lab/wayland.json | tr '\n' ' '))"
    result=$(photons /run/lab/session.fovea)
    [ "$(field "$result" frames)" -ge 20 ] && [ "$(field "$result" unmeasured)" = 0 ] && [ "$(field "$result" falling)" = 0 ] && on_grid "$result"
    check $? "display: and lies on the screen's vertical blanks ($result)"
    cp /run/lab/wayland.json /out/
    kill $weston
    wait $weston
}
