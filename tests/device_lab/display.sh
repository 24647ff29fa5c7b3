# The lab's display, sourced by cases.sh: a kernel screen with real vertical blanks (vkms), and a compositor on it.

# What Linux makes of 640x480 at 25.175 MHz, 800 x 525 with the blanks: vkms takes its vertical blanks from it.
period_ns=16683217

# photons SESSION [WAYLAND_LOG]: how the photon instants of its frames lie: how many, marked how, whether they rise, and how
# far they are from whole refresh periods after the first, in microseconds. With what the compositor said (the log of
# WAYLAND_DEBUG): how it marked each frame, whether its count of refreshes rises, whether its instants are where that count
# says, and how far each photon is from the middle of the scan-out that was told.
photons() {
    python3 - "$1" "$period_ns" "${2-}" <<'PY'
import re, sqlite3, sys
rows = sqlite3.connect(sys.argv[1]).execute("SELECT photon_ns, gpu_done_ns, photon_simulated != 0 FROM frames ORDER BY n").fetchall()
period = float(sys.argv[2])
steps = [b[0] - a[0] for a, b in zip(rows, rows[1:])]
off = max((abs(r[0] - rows[0][0] - round((r[0] - rows[0][0]) / period) * period) for r in rows[1:]), default=-1e3)
out = "frames=%d unmeasured=%d falling=%d before_done=%d off_us=%.1f" % (
    len(rows), sum(r[2] for r in rows), sum(s <= 0 for s in steps), sum(r[0] <= r[1] for r in rows), off / 1e3)
if sys.argv[3]:
    told = [[int(x) for x in m.groups()] for m in re.finditer(
        r"wp_presentation_feedback[@#]\d+\.presented\((\d+), (\d+), (\d+), (\d+), (\d+), (\d+), (\d+)\)", open(sys.argv[3], errors="replace").read())]
    at = [((t[0] << 32) + t[1]) * 10**9 + t[2] for t in told]
    count = [(t[4] << 32) + t[5] for t in told]
    middles = {a + t[3] // 2 for a, t in zip(at, told)}
    out += " told=%d kind=%d refresh_off_ns=%d repeated=%d count_off_us=%.1f strangers=%d" % (
        len(told), min((t[6] & 7 for t in told), default=0), max((abs(t[3] - period) for t in told), default=-1),
        sum(b <= a for a, b in zip(count, count[1:])),
        max((abs(a - at[0] - (c - count[0]) * period) for a, c in zip(at, count)), default=-1e3) / 1e3,
        sum(min(abs(r[0] - m) for m in middles) > 1 for r in rows) if middles else len(rows))
print(out)
PY
}
below() { # below TEXT FIELD LIMIT: 0 <= field < limit
    awk -v x="$(field "$1" "$2")" -v most="$3" 'BEGIN {exit !(x != "" && x >= 0 && x < most)}'
}

# What is drawn does not matter here, and the emulated processor draws slowly: one triangle, few pixels, one pass, shaders
# compiled without optimisation.
scene=/run/lab/triangle.gltf
light="--scene $scene --method full --size 32x480 --json"
export GALLIVM_PERF=nopt

case_display() {
    local result
    step "display: vkms"
    # Blanks are never switched off between frames: vkms would begin them anew, at another phase.
    modprobe drm vblankoffdelay=0
    modprobe -a drm_kms_helper drm_shmem_helper
    insmod "$LAB_KO/vkms.ko"
    await 5 ls /dev/dri/card0 || { bad "display: the virtual screen appears"; return; }
    cat >$scene <<'GLTF'
{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}],
 "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}
GLTF
    start_daemon "source.path=$recording"
    FOVEA_KMS_MODE=640x480 "$LAB_BIN/fovea-view" --socket /run/lab/fovea/focus.sock --present kms $light --frames 12 >/run/lab/kms.json 2>/run/lab/kms.err
    check $? "display: fovea-view on a bare screen ($(cat /run/lab/kms.err))"
    stop_daemon display
    grep -q '"photons_estimated": 0' /run/lab/kms.json && grep -q '"simulated": false' /run/lab/kms.json
    check $? "display: every page flip has told its time ($(grep -o '"photons_measured": [0-9]*' /run/lab/kms.json))"
    result=$(photons /run/lab/session.fovea)
    [ "$(field "$result" frames)" -ge 10 ] && [ "$(field "$result" unmeasured)" = 0 ] && [ "$(field "$result" falling)" = 0 ] && [ "$(field "$result" before_done)" = 0 ]
    check $? "display: its photons are measured, rise, and follow the GPU ($result)"
    below "$result" off_us 5   # an event tells microseconds
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
    start_daemon "source.path=$recording"
    XDG_RUNTIME_DIR=/run/lab/wayland WAYLAND_DISPLAY=lab WAYLAND_DEBUG=client "$LAB_BIN/fovea-view" --socket /run/lab/fovea/focus.sock $light --frames 12 \
        >/run/lab/wayland.json 2>/run/lab/wayland.err
    check $? "display: fovea-view in a window, chosen by itself ($(grep '^fovea-view: display' /run/lab/wayland.err))"
    stop_daemon display
    grep -q '"photons_estimated": 0' /run/lab/wayland.json && grep -q '"simulated": false' /run/lab/wayland.json && grep -q '"presenter": "wayland"' /run/lab/wayland.json
    check $? "display: every photon of the window is measured ($(grep -oE '"(photons_measured|never_shown)": [0-9]*' /run/lab/wayland.json | tr '\n' ' '))"
    result=$(photons /run/lab/session.fovea /run/lab/wayland.err)
    [ "$(field "$result" frames)" -ge 9 ] && [ "$(field "$result" unmeasured)" = 0 ] && [ "$(field "$result" falling)" = 0 ] && below "$result" off_us 20
    check $? "display: they rise and lie on the screen's vertical blanks ($result)"
    [ "$(field "$result" told)" -ge 9 ] && [ "$(field "$result" kind)" = 7 ]
    check $? "display: the compositor marks each as in step with the screen, by its clock, told by it (VSYNC, HW_CLOCK, HW_COMPLETION)"
    below "$result" refresh_off_ns 1000 && [ "$(field "$result" repeated)" = 0 ] && below "$result" count_off_us 20
    check $? "display: its refresh is the mode's, its count rises, and its instants are where the count says"
    [ "$(field "$result" strangers)" = 0 ]
    check $? "display: each photon is the middle of a scan-out that it told of"
    cp /run/lab/wayland.json /run/lab/wayland.err /out/
    kill $weston
    wait $weston
}
