# The input side's latency and the daemon's share of the processor, sourced by cases.sh.

# Middle of the p50s that the rounds left in a file, and of the p99s.
middle() { grep -o "$2=[0-9]*" "$1" | cut -d= -f2 | sort -n | awk '{v[NR] = $1} END {print v[int((NR + 1) / 2)]}'; }
ratio() { awk -v a="$1" -v b="$2" 'BEGIN {if (b > 0) printf "%.2f", a / b; else print "-"}'; }
daemon_cpu_ms() { awk -v hz="$(getconf CLK_TCK)" '{print int(($14 + $15) * 1000 / hz)}' "/proc/$1/stat"; }
share() { # share PID SECONDS: of a core, in percent
    local before
    before=$(daemon_cpu_ms "$1")
    sleep "$2"
    awk -v ms=$(($(daemon_cpu_ms "$1") - before)) -v s="$2" 'BEGIN {printf "%.2f", ms / s / 10}'
}

# published SECONDS SKIP SETTING...: the latencies of a daemon that runs so long, one line more in published.latency.
published() {
    local seconds=$1 skip=$2
    shift 2
    start_daemon "$@" filter.name=none
    await 20 sh -c '"$LAB_BIN/fovea" status --run-dir /run/lab/fovea | grep -q running' || bad "latency: $1 streams"
    sleep "$seconds"
    stop_daemon "latency, $*"
    ${lab}probe published /run/lab/session.fovea --skip "$skip" >>/run/lab/published.latency
}
# line KIND: a line of the table, of what floor.latency and published.latency say.
line() {
    local f50 f99 p50 p99
    f50=$(middle /run/lab/floor.latency p50) f99=$(middle /run/lab/floor.latency p99)
    p50=$(middle /run/lab/published.latency p50) p99=$(middle /run/lab/published.latency p99)
    printf 'MEASURED %-46s %8s %8s %10s %10s %6s\n' "$1" "$f50" "$f99" "$p50" "$p99" "$(ratio "$p50" "$f50")" >>/run/lab/table
    [ "${p50:-0}" -gt 0 ] && [ "${f50:-0}" -gt 0 ]
    check $? "latency: $1 was measured"
}
# row KIND ROUNDS SECONDS SKIP FLOOR_COMMAND -- SETTING...: floor and daemon take turns, so that a busy host slows both.
row() {
    local kind=$1 rounds=$2 seconds=$3 skip=$4 floor=$5 round
    shift 6
    rm -f /run/lab/floor.latency /run/lab/published.latency
    for ((round = 0; round < rounds; round++)); do
        $floor >>/run/lab/floor.latency
        published "$seconds" "$skip" "$@"
    done
    line "$kind"
}

# camera_lines KIND PRESET: two lines; the first one's floor is in read.latency.
camera_lines() {
    rm -f /run/lab/published.latency
    published 2.5 4 source.driver=camera source.preset="$2"
    cp /run/lab/read.latency /run/lab/floor.latency
    line "$1 (floor: read)"
    ${lab}probe floor-camera /dev/video0 --count 24 --detect "$2" >/run/lab/floor.latency
    line "$1 (floor: read, detect)"
}

case_latency() {
    step "latency"
    modprobe -a uhid hid-generic vhci-hcd uvcvideo
    local tracker headset camera daemon device=${lab}
    if [ "$(nproc)" -gt 1 ]; then
        # A tracker runs on no processor of ours. A program that plays one would, between two reports, take the reader's out of
        # the caches and translations that it left there.
        taskset -pc 0 $BASHPID >/dev/null
        device="taskset -c 1 $lab"
    fi
    printf 'MEASURED %-46s %8s %8s %10s %10s %6s\n' "from the kernel to, us (emulated)" "floor50" "floor99" "publish50" "publish99" "ratio" >/run/lab/table
    ${device}uhid_tracker --rate 250 --stamps monotonic --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 5 ls /dev/hidraw0
    row "HID, 250 Hz" 3 2.5 100 "${lab}probe floor-hid /dev/hidraw0 --count 500" -- source.driver=hid
    step "latency: share of the processor"
    local record="" ours floor probe
    start_daemon source.driver=hid
    sleep 1
    ours=$(share $daemon 5)
    ${lab}probe floor-hid /dev/hidraw0 --count 100000 >/dev/null &
    probe=$!
    sleep 0.5
    floor=$(share $probe 4)
    kill $probe
    end $tracker
    sleep 1
    printf 'MEASURED processor at 250 Hz HID: fovead %s %% of a core, a bare read loop %s %%: %s times; with no device %s %% (emulated: %s)\n' "$ours" "$floor" "$(ratio "$ours" "$floor")" \
        "$(share $daemon 5)" "10 to 15 times slower than the machine" >>/run/lab/table
    stop_daemon "latency, no device"
    unset record
    local endpoint
    for endpoint in interrupt bulk; do
        step "latency: usb, $endpoint"
        ${device}usb_headset --rate 120 --stamps monotonic --endpoint $endpoint --recording $recording >/run/lab/headset.log &
        headset=$!
        await 10 usb_there 0cde
        sleep 0.5
        row "USB $endpoint, 120 Hz" 2 3 60 "${lab}probe floor-usb --count 300" -- source.driver=psvr2
        end $headset
    done
    # A 120 Hz camera as slowed down as the processor is: its readout takes 90 ms here, 7.5 ms there.
    step "latency: camera"
    local preset
    ${device}uvc_camera --rate 10 --recording $recording >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0
    ${lab}probe floor-camera /dev/video0 --count 24 >/run/lab/read.latency
    for preset in draft fast balanced best; do
        camera_lines "camera, $preset" $preset
    done
    end $camera
    ${device}uvc_camera --rate 10 --readout 0 --recording $recording >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0
    ${lab}probe floor-camera /dev/video0 --count 24 >/run/lab/read.latency
    camera_lines "camera, in one burst" balanced
    end $camera
    ${lab}probe stages --count 600 >/run/lab/stages
    sed 's/^/MEASURED stage: /' /run/lab/stages
    cat /run/lab/table
}
