# The lab's cases, run inside the virtual machine: cases.sh CASE. Anywhere: cases.sh --list; --length CASE.
set -u

# Each with the seconds that it takes in emulation on a quiet machine, in the order in which they are begun: long ones first,
# the figures (which can fail nothing) beside the last short ones.
lengths="display 60
hid 60
eye 45
camera 45
life 45
daemon 40
latency 130
replug 35
usb 40
dma 25
auto 20
sample 10
suspend 60"
case "$1" in
    --list) cut -d' ' -f1 <<<"$lengths"; exit ;;
    --length) awk -v c="$2" '$1 == c {print $2}' <<<"$lengths"; exit ;;
esac
lab=$LAB_BIN/lab_
# A session file, of a real recording. In memory: where a session is opened its journal may want to stand beside it.
recording=/run/lab/recording.fovea
[ -e $recording ] || { mkdir -p /run/lab && cp "$LAB_BIN/recording.fovea" $recording; }
export FOVEA_DEVICES_DIR=$PWD/configs/devices
failures=0
pass() { echo "PASS $*"; }
bad() { echo "FAIL $*"; failures=$((failures + 1)); }
check() { # check STATUS TEXT
    if [ "$1" -eq 0 ]; then pass "$2"; else bad "$2"; fi
}
step() { echo "== [$(cut -d' ' -f1 /proc/uptime)] $*"; }
uptime_s() { local up _; read -r up _ </proc/uptime; now_s=${up%.*}; }   # into $now_s, without a process
await() { # await SECONDS COMMAND...: until it succeeds; four times as long on an emulated machine of a busy host
    uptime_s
    local end=$((now_s + $1 * ${LAB_PATIENCE:-4}))
    shift
    until "$@" >/dev/null 2>&1; do
        uptime_s
        [ "$now_s" -lt $end ] || return 1
        sleep 0.05
    done
}
end() { # end PID: the emulated device is pulled out and its log is complete
    kill "$1" 2>/dev/null
    wait "$1"
    await 5 gone
}
usb_there() { grep -qs "$1" /sys/bus/usb/devices/*/idProduct; }
usb_node() { # usb_node PRODUCT: its device node
    local d
    d=$(dirname "$(grep -ls "$1" /sys/bus/usb/devices/*/idProduct | head -1)")
    printf '/dev/bus/usb/%03d/%03d\n' "$(cat "$d/busnum")" "$(cat "$d/devnum")"
}
gone() { ! ls /dev/hidraw* && ! ls /dev/video* && ! grep -sE "0cde|e7e3|e7e4" /sys/bus/usb/devices/*/idProduct; }
field() { grep -o "$2=[^ ]*" <<<"$1" | head -1 | cut -d= -f2; }

# As many files as at the third opening; and from the 25th of 50 on no mapping more, and of the heap 16 KiB at most (what is under way just then).
leaks_nothing() {
    [ "$(field "$1" files)" = "$(field "$1" files_at_third_open)" ] && [ "$(field "$1" heap_grown_bytes)" -lt 16384 ] && [ "$(field "$1" mappings_grown)" -le 0 ]
}

# Samples as `fovea devices --watch` prints them, as a recording that lab_probe compare reads.
watch_to_recording() {
    { echo "# fovea-gaze-csv 1"; echo "# device: fovea devices --watch"
      echo "t_ns,combined_az_deg,combined_el_deg,combined_valid"
      grep -v '^#' "$1" | awk -F, '{v = ($6 != ""); print $2 "," $6 "," $7 "," v}'; } >"$2"
}

hid_shape() { # hid_shape SHAPE TOLERANCE_US TOLERANCE_MDEG [SETTING...]
    local shape=$1 us=$2 mdeg=$3
    shift 3
    local set=()
    for s in "$@"; do set+=(--set "$s"); done
    ${lab}uhid_tracker --shape "$shape" --rate 240 --count 240 --recording $recording --truth /run/lab/truth.csv >/run/lab/tracker.log &
    local tracker=$!
    await 5 ls /dev/hidraw0 || { bad "hid $shape: hidraw node appears"; return; }
    "$LAB_BIN/fovea" devices hid --dump >/run/lab/list.txt
    grep -q "gives gaze point" /run/lab/list.txt
    check $? "hid $shape: listed with its capabilities ($(grep -c ' bits' /run/lab/list.txt) fields dumped)"
    "$LAB_BIN/fovea" devices hid --watch --count 200 --patience 5 "${set[@]}" >/run/lab/watch.csv
    check $? "hid $shape: 200 samples, $(tail -1 /run/lab/watch.csv)"
    end $tracker
    cat /run/lab/tracker.log
    if [ "$shape" != inches ]; then   # it has no clock, so a sample cannot be told from its neighbour
        watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
        local result
        result=$(${lab}probe compare /run/lab/truth.csv /run/lab/watch_recording.csv --least 200 --tolerance-us "$us" --tolerance-mdeg "$mdeg")
        check $? "hid $shape: values and times are the recording's ($result)"
    fi
}

case_hid() {
    step hid
    modprobe -a uhid hid-generic || { bad "hid: modules"; return; }
    await 5 ls /dev/uhid
    hid_shape classic 0 1
    hid_shape packed 1000 20 screen_width_m=0.5 screen_height_m=0.3
    hid_shape ratio 100 20
    hid_shape inches 0 10 screen_width_m=0.5 screen_height_m=0.3

    step "hid: malformed reports"
    ${lab}uhid_tracker --rate 240 --count 240 --malformed-every 5 --truth /run/lab/truth.csv --recording $recording >/run/lab/tracker.log &
    local tracker=$!
    await 5 ls /dev/hidraw0
    "$LAB_BIN/fovea" devices hid --watch --count 150 --patience 5 >/run/lab/watch.csv 2>&1
    end $tracker
    watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
    local result
    result=$(${lab}probe compare /run/lab/truth.csv /run/lab/watch_recording.csv --least 150)
    check $? "hid: malformed reports between good ones harm none of them ($(tail -1 /run/lab/watch.csv)) ($result)"

    step "hid: malformed descriptors"
    local daemon watch crashes=0
    start_daemon source.driver=hid
    ${lab}probe watch hid --seconds 300 >/run/lab/broken.txt &   # tries at once, where fovead takes its time
    watch=$!
    ${lab}uhid_tracker --broken 30 >/run/lab/tracker.log &
    tracker=$!
    while kill -0 $tracker 2>/dev/null; do   # and whoever lists what is there meanwhile
        "$LAB_BIN/fovea" devices hid --dump >/run/lab/list.txt 2>&1
        [ $? -lt 2 ] || crashes=$((crashes + 1))
    done
    wait $tracker
    [ $crashes -eq 0 ] && grep -q "30 broken devices" /run/lab/tracker.log
    check $? "hid: 30 devices with damaged descriptors and random reports are listed without a crash ($(cat /run/lab/tracker.log))"
    kill $watch
    wait $watch
    result=$(grep "^watch samples" /run/lab/broken.txt)
    [ -n "$result" ]
    check $? "hid: a reader that tries each of them comes to no harm ($(grep "^not open" /run/lab/broken.txt | sort | uniq | wc -l) ways of saying why not; $result)"
    cp /run/lab/broken.txt /out/ 2>/dev/null
    ${lab}uhid_tracker --rate 120 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 20 sh -c '"$LAB_BIN/fovea" status --run-dir /run/lab/fovea | grep -q running'
    check $? "hid: and fovead, which tried each of them, streams from the good one that comes after"
    stop_daemon "hid, malformed descriptors"
    end $tracker

    step "hid: permission"
    ${lab}uhid_tracker --rate 120 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 5 ls /dev/hidraw0
    udevadm settle --timeout=10
    local group
    group=$(stat -c %G /dev/hidraw0)
    [ "$group" = plugdev ]
    check $? "hid: the udev rule gives the node to plugdev (is: $group, mode $(stat -c %a /dev/hidraw0))"
    chmod 000 /dev/hidraw0
    setpriv --reuid 65534 --regid 65534 --clear-groups "$LAB_BIN/fovea" devices hid --watch >/run/lab/denied.txt 2>&1
    grep -q "60-fovea.rules" /run/lab/denied.txt
    check $? "hid: permission denied names the udev rule"
    setpriv --reuid 65534 --regid 65534 --clear-groups "$LAB_BIN/fovea" devices hid >/run/lab/denied.txt 2>&1
    grep -q "CANNOT BE USED" /run/lab/denied.txt && grep -q "gives gaze point" /run/lab/denied.txt
    check $? "hid: listed with its capabilities although it may not be opened"
    end $tracker

    step "hid: silent"
    ${lab}uhid_tracker --rate 120 --silent-after 60 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 5 ls /dev/hidraw0
    result=$(${lab}probe watch hid --losses 1 --seconds 20 --set silent_ms=500)
    check $? "hid: a tracker that says nothing any more counts as lost"
    grep -q "last_loss='silent'" <<<"$result"
    check $? "hid: and says so ($(grep "^watch samples" <<<"$result"))"
    end $tracker
}

case_usb() {
    step usb
    modprobe vhci-hcd || { bad "usb: modules"; return; }
    local result headset
    ${lab}usb_headset --rate 120 --count 300 --deaf 1 --recording $recording --truth /run/lab/truth.csv >/run/lab/headset.log &
    headset=$!
    await 10 usb_there 0cde
    sleep 0.5
    "$LAB_BIN/fovea" devices psvr2 --dump >/run/lab/list.txt
    grep -q "endpoint 0x85 bulk in" /run/lab/list.txt
    check $? "usb: the headset is listed with its endpoints"
    "$LAB_BIN/fovea" devices psvr2 --watch --count 250 --patience 5 >/run/lab/watch.csv
    check $? "usb: 250 packets ($(tail -1 /run/lab/watch.csv))"
    end $headset
    cat /run/lab/headset.log
    grep -q "streaming after 2 requests" /run/lab/headset.log
    check $? "usb: the enable request is repeated until it takes"
    watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
    result=$(${lab}probe compare /run/lab/truth.csv /run/lab/watch_recording.csv --least 250)
    check $? "usb: values and times are the recording's ($result)"

    step "usb: faults"
    ${lab}usb_headset --rate 120 --count 300 --stall-every 40 --torn-every 7 --short-every 11 --overlong-every 13 \
        --recording $recording --truth /run/lab/truth.csv >/run/lab/headset.log &
    headset=$!
    await 10 usb_there 0cde
    sleep 0.5
    "$LAB_BIN/fovea" devices psvr2 --watch --count 280 --patience 5 >/run/lab/watch.csv
    check $? "usb: 280 packets between stalls, torn, short and overlong transfers ($(tail -1 /run/lab/watch.csv))"
    end $headset
    cat /run/lab/headset.log
    watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
    result=$(${lab}probe compare /run/lab/truth.csv /run/lab/watch_recording.csv --least 280)
    check $? "usb: and no good packet is lost or changed ($result)"
    ${lab}usb_headset --rate 120 --count 150 --endpoint interrupt --recording $recording >/run/lab/headset.log &
    headset=$!
    await 10 usb_there 0cde
    sleep 0.5
    result=$(${lab}probe watch psvr2 --count 100 --seconds 20)
    check $? "usb: an interrupt endpoint serves as well ($(grep "^watch samples" <<<"$result"))"
    end $headset

    step "usb: permission, busy, silent"
    ${lab}usb_headset --rate 120 --recording $recording >/run/lab/headset.log &
    headset=$!
    await 10 usb_there 0cde
    udevadm settle --timeout=10
    local node first
    node=$(usb_node 0cde)
    chmod 000 "$node"
    setpriv --reuid 65534 --regid 65534 --clear-groups "$LAB_BIN/fovea" devices psvr2 --watch >/run/lab/denied.txt 2>&1
    grep -q "60-fovea.rules" /run/lab/denied.txt
    check $? "usb: permission denied names the udev rule"
    chmod 666 "$node"
    ${lab}probe watch psvr2 --seconds 60 >/run/lab/first.txt &
    first=$!
    await 20 grep -q "watch open" /run/lab/first.txt
    "$LAB_BIN/fovea" devices psvr2 --watch >/run/lab/busy.txt 2>&1
    grep -q "another program holds" /run/lab/busy.txt
    check $? "usb: busy is told ($(tail -1 /run/lab/busy.txt))"
    kill $first
    wait $first
    end $headset
    ${lab}usb_headset --rate 120 --deaf 1000000 --recording $recording >/run/lab/headset.log &
    headset=$!
    await 10 usb_there 0cde
    sleep 0.5
    result=$(${lab}probe watch psvr2 --losses 1 --seconds 20 --set silent_ms=700)
    check $? "usb: a headset that says nothing counts as lost"
    grep -q "last_loss='silent'" <<<"$result"
    check $? "usb: and says so ($(grep "^watch samples" <<<"$result"))"
    end $headset
}

case_sample() {
    step sample
    modprobe vhci-hcd
    ${lab}usb_headset --device sample --rate 120 --count 150 --recording $recording --truth /run/lab/truth.csv >/run/lab/headset.log &
    local headset=$! result
    await 10 usb_there e7e3
    sleep 0.5
    "$LAB_BIN/fovea" devices sample --watch --count 120 --patience 5 >/run/lab/watch.csv
    check $? "sample: 120 packets ($(tail -1 /run/lab/watch.csv))"
    end $headset
    watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
    result=$(${lab}probe compare /run/lab/truth.csv /run/lab/watch_recording.csv --least 120 --tolerance-us 100 --tolerance-mdeg 10)
    check $? "sample: the driver to copy works: values and times are the recording's ($result)"
}

case_camera() {
    step "camera: UVC"
    modprobe -a vhci-hcd uvcvideo || { bad "camera: modules"; return; }
    local camera result show="${lab}uvc_camera --rate 10 --side 128 --recording $recording"
    $show --truth /run/lab/truth.csv >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0 || { bad "camera: video node appears"; return; }
    udevadm settle --timeout=10
    "$LAB_BIN/fovea" devices camera >/run/lab/list.txt
    grep -q "offers GREY" /run/lab/list.txt
    check $? "camera: listed with its formats ($(head -1 /run/lab/list.txt))"
    "$LAB_BIN/fovea" devices camera --watch --count 40 --patience 15 >/run/lab/watch.csv
    check $? "camera: 40 frames from uvcvideo ($(tail -1 /run/lab/watch.csv))"
    watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
    result=$(${lab}probe nearest /run/lab/truth.csv /run/lab/watch_recording.csv --least 35 --tolerance-mdeg 300)
    check $? "camera: the gaze is that of the pictures, in turn ($result)"
    end $camera
    $show --format MJPG --truth /run/lab/truth.csv >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0
    "$LAB_BIN/fovea" devices camera --watch --count 15 --patience 15 >/run/lab/watch.csv
    check $? "camera: 15 frames of motion JPEG ($(tail -1 /run/lab/watch.csv))"
    watch_to_recording /run/lab/watch.csv /run/lab/watch_recording.csv
    result=$(${lab}probe nearest /run/lab/truth.csv /run/lab/watch_recording.csv --least 12 --tolerance-mdeg 400)
    check $? "camera: and the gaze is that of its pictures ($result)"
    chmod 000 /dev/video0
    setpriv --reuid 65534 --regid 65534 --clear-groups "$LAB_BIN/fovea" devices camera --watch --set path=/dev/video0 >/run/lab/denied.txt 2>&1
    grep -q "you may not open" /run/lab/denied.txt
    check $? "camera: permission denied is told"
    "$LAB_BIN/fovea" devices camera --watch --count 1000 >/run/lab/watch.csv &
    local first=$!
    await 10 grep -q "^[0-9]" /run/lab/watch.csv
    "$LAB_BIN/fovea" devices camera --watch --set path=/dev/video0 >/run/lab/busy.txt 2>&1
    grep -q "another program holds" /run/lab/busy.txt
    check $? "camera: busy is told"
    kill $first
    wait $first
    end $camera
    $show --silent-after 5 >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0
    result=$(${lab}probe watch camera --losses 1 --seconds 60 --set silent_ms=1500)
    check $? "camera: one that shows nothing any more counts as lost"
    grep -q "last_loss='silent'" <<<"$result"
    check $? "camera: and says so ($(grep "^watch samples" <<<"$result"))"
    end $camera

    step "camera: vivid"
    modprobe vivid n_devs=2 node_types=0x1,0x1 input_types=0x0,0x0 || { bad "camera: vivid"; return; }
    await 10 ls /dev/video1
    sleep 1
    local format
    for format in GREY Y16 YUYV; do
        result=$(${lab}probe watch camera --count 15 --seconds 30 --set format=$format --set2 path=/dev/video0 --set3 width=320)
        check $? "camera: vivid in $format ($(grep "^watch samples" <<<"$result"))"
    done
    result=$(${lab}probe watch camera --count 30 --seconds 30 --set path=/dev/video0 --set2 right_path=/dev/video1 --set3 format=GREY)
    check $? "camera: two cameras at once ($(grep "^watch samples" <<<"$result"))"
    ${lab}probe watch camera --losses 1 --seconds 60 --set path=/dev/video0 --set2 format=GREY >/run/lab/unbound.txt &
    first=$!
    await 20 grep -q "watch open" /run/lab/unbound.txt
    sleep 0.5   # so that it streams
    echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
    wait $first
    check $? "camera: a driver that goes away in mid-stream is a loss ($(grep "^watch samples" /run/lab/unbound.txt))"
    rmmod vivid 2>/dev/null
}

case_dma() {
    step "dma: frames in DMA-BUFs"
    modprobe vivid n_devs=1 node_types=0x1 input_types=0x0 || { bad "dma: vivid"; return; }
    await 10 ls /dev/video0
    udevadm settle --timeout=10
    local format result
    result=$(${lab}probe dma /dev/video0 --format GREY 2>&1)
    grep -q "/dev/dma_heap/system" <<<"$result"
    check $? "dma: a kernel without a heap is told of ($result)"
    insmod "$LAB_KO/fovea_dma_heap.ko" || { bad "dma: the system's heap"; return; }
    await 10 ls /dev/dma_heap/system
    for format in GREY YUYV; do
        result=$(${lab}probe dma /dev/video0 --format $format)
        check $? "dma: a picture in $format is the same, byte by byte, in mapped memory, at user pointers and in DMA-BUFs of the system's heap ($result)"
    done
    rmmod vivid
}

unplugs() { # unplugs NAME DRIVER EMULATOR...: a device that is pulled out 50 times in mid-stream
    local name=$1 driver=$2 result emulator
    shift 2
    "$@" --cycles 50 --recording $recording >/run/lab/emulator.log &
    emulator=$!
    result=$(${lab}probe watch "$driver" --losses 50 --seconds 240)
    check $? "$name unplugs in mid-stream, 50 of them, are 50 losses ($(grep "^watch samples" <<<"$result"))"
    sort <<<"$result" | uniq -c | sort -rn | head -12   # the ways of saying why it cannot be opened
    leaks_nothing "$result"
    check $? "$name unplugs leak nothing ($(grep files= <<<"$result"))"
    end $emulator
}

case_life() {
    step "life: unplugs of HID and USB"
    modprobe -a uhid hid-generic vhci-hcd
    unplugs "life: HID" hid ${lab}uhid_tracker --rate 250 --count 15
    unplugs "life: USB" psvr2 ${lab}usb_headset --rate 250 --count 12
}

case_replug() {
    step "replug: unplugs of a camera"
    modprobe -a vhci-hcd uvcvideo || { bad "replug: modules"; return; }
    unplugs "replug: camera" camera ${lab}uvc_camera --rate 30 --side 96 --pictures 4 --frames 6
}

start_daemon() { # start_daemon SETTING...: fovead with a session file; its pid in $daemon
    rm -rf /run/lab/session* /run/lab/fovea
    mkdir -p /run/lab/fovea
    local set=()
    for s in "$@"; do set+=(--set "$s"); done
    "$LAB_BIN/fovead" --run-dir /run/lab/fovea ${record---record /run/lab/session.fovea} "${set[@]}" >>/run/lab/daemon.log 2>&1 &
    daemon=$!
    await 10 "$LAB_BIN/fovea" status --run-dir /run/lab/fovea || bad "daemon: fovead answers"
}
stop_daemon() {
    kill -TERM "$daemon"
    wait "$daemon"
    check $? "$1: fovead ends cleanly"
}

case_daemon() {
    step "daemon: HID to published focus"
    modprobe -a uhid hid-generic vhci-hcd
    local daemon result
    ${lab}uhid_tracker --rate 250 --count 1000 --recording $recording --truth /run/lab/truth.csv >/run/lab/tracker.log &
    local tracker=$!
    await 5 ls /dev/hidraw0
    start_daemon source.driver=hid filter.name=none
    wait $tracker   # all are sent
    stop_daemon "daemon, hid"
    result=$(${lab}probe compare /run/lab/truth.csv /run/lab/session.fovea --least 600)
    check $? "daemon: fovead's raw samples are the recording's, none missing ($result)"
    result=$(${lab}probe session /run/lab/truth.csv /run/lab/session.fovea --least 500)
    check $? "daemon: HID to published focus, values and times are the recording's ($result)"

    step "daemon: USB to published focus"
    # Fed with the session file that the daemon has just written.
    cp /run/lab/session.fovea /run/lab/fed.fovea
    ${lab}usb_headset --rate 120 --count 400 --recording /run/lab/fed.fovea --truth /run/lab/truth.csv >/run/lab/headset.log &
    local headset=$!
    await 10 usb_there 0cde
    start_daemon source.driver=psvr2 filter.name=none
    wait $headset
    stop_daemon "daemon, usb"
    result=$(${lab}probe session /run/lab/truth.csv /run/lab/session.fovea --least 250)
    check $? "daemon: USB to published focus, values and times are the recording's ($result)"

    step "daemon: 50 unplugs in mid-stream"
    start_daemon source.driver=hid
    ${lab}uhid_tracker --rate 250 --cycles 50 --count 15 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    local files_before files_after
    await 20 grep -q unplugged /run/lab/tracker.log
    files_before=$(ls /proc/$daemon/fd | wc -l)
    wait $tracker
    cat /run/lab/tracker.log | tail -1
    grep -q "50 cycles" /run/lab/tracker.log
    check $? "daemon: fovead opens the tracker again after each of 50 unplugs"
    sleep 0.5
    files_after=$(ls /proc/$daemon/fd | wc -l)
    [ "$files_after" -le "$files_before" ]
    check $? "daemon: no file leaks ($files_before then $files_after open)"
    "$LAB_BIN/fovea" status --run-dir /run/lab/fovea
    ${lab}uhid_tracker --rate 250 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    # The daemon's retries are up to 5 s apart.
    await 15 sh -c '"$LAB_BIN/fovea" status --run-dir /run/lab/fovea | tee /run/lab/status.txt | grep -q running'
    check $? "daemon: and streams again afterwards"

    end $tracker
    stop_daemon "daemon, after 50 unplugs"
}

case_eye() {
    step "eye: camera to published focus"
    modprobe -a vhci-hcd uvcvideo || { bad "eye: modules"; return; }
    local daemon result camera
    ${lab}uvc_camera --rate 10 --side 128 --frames 60 --recording $recording --truth /run/lab/truth.csv >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0 || { bad "eye: video node appears"; return; }
    start_daemon source.driver=camera filter.name=none
    wait $camera   # it pulls itself out when all are shown
    await 20 sh -c '"$LAB_BIN/fovea" status --run-dir /run/lab/fovea | grep -q lost'
    check $? "eye: a camera that is pulled out is a lost source"
    stop_daemon "eye, camera"
    result=$(${lab}probe nearest /run/lab/truth.csv /run/lab/session.fovea --least 30 --tolerance-mdeg 300)
    check $? "eye: fovead's samples are the pictures, in turn ($(head -1 <<<"$result"))"
    result=$(${lab}probe nearest /run/lab/truth.csv /run/lab/session.fovea --models yes --least 30 --tolerance-mdeg 300)
    check $? "eye: and so are the published models ($(head -1 <<<"$result"))"
    echo "MEASURED eye: from the camera's stamp to the published focus, detection included: $(tail -1 <<<"$result")"

    step "eye: a calibration, from targets to published focus"
    ${lab}uvc_camera --rate 12 --side 128 --mounted askew --targets /run/lab/targets.csv >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0
    start_daemon source.driver=camera filter.name=none
    await 60 sh -c '"$LAB_BIN/fovea" status --run-dir /run/lab/fovea | grep -q running'
    await 40 grep -q "all targets shown" /run/lab/camera.log
    stop_daemon "eye, targets"
    end $camera
    [ "$(wc -l </run/lab/targets.csv)" = 9 ]
    check $? "eye: nine targets were shown"
    python3 -c '
import csv, sqlite3, sys
db = sqlite3.connect(sys.argv[1])
db.executemany("INSERT INTO targets VALUES (?, ?, ?, ?, ?)", [[int(r[0]), int(r[1])] + [float(v) for v in r[2:]] for r in csv.reader(open(sys.argv[2]))])
db.commit()' /run/lab/session.fovea /run/lab/targets.csv
    "$LAB_BIN/fovea" calibrate --from /run/lab/session.fovea --out /run/lab/me.toml >/run/lab/calibrate.txt 2>&1
    check $? "eye: a calibration is fitted to the session's own targets ($(tail -1 /run/lab/calibrate.txt))"
    [ -s /run/lab/me.toml ] || return
    ${lab}uvc_camera --rate 10 --side 128 --frames 60 --mounted askew --recording $recording --truth /run/lab/truth.csv >/run/lab/camera.log &
    camera=$!
    await 60 ls /dev/video0
    start_daemon source.driver=camera filter.name=none pipeline.calibration=/run/lab/me.toml
    wait $camera
    stop_daemon "eye, calibrated"
    result=$(${lab}probe nearest /run/lab/truth.csv /run/lab/session.fovea --least 30 --tolerance-mdeg 1000)
    [ $? -ne 0 ]
    check $? "eye: uncalibrated, a camera mounted askew is off by more than a degree ($(head -1 <<<"$result"))"
    result=$(${lab}probe nearest /run/lab/truth.csv /run/lab/session.fovea --models yes --least 30 --tolerance-mdeg 1000)
    check $? "eye: calibrated, the published focus is within a degree of the recording's gaze ($(head -1 <<<"$result"))"
}

case_auto() {
    step "auto: two trackers, the better one comes and goes"
    modprobe -a uhid hid-generic vhci-hcd
    local result tracker headset watch
    ${lab}usb_headset --rate 60 --recording $recording >/run/lab/headset.log &
    headset=$!
    ${lab}uhid_tracker --rate 60 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 10 usb_there 0cde
    await 5 ls /dev/hidraw0
    sleep 0.5
    ${lab}probe watch auto --seconds 150 --switches 2 --set "order=hid psvr2" --set2 retry_ms=500 --set3 return_after_ms=2000 >/run/lab/auto.txt &
    watch=$!
    await 30 grep -q "watch open" /run/lab/auto.txt || bad "auto: opens"
    sleep 1
    kill $tracker
    wait $tracker
    await 30 grep -q "watch switch 1" /run/lab/auto.txt
    check $? "auto: falls back to the headset when the HID tracker is pulled out"
    # Hysteresis: three times it is back for less than it has to prove itself.
    ${lab}uhid_tracker --rate 60 --cycles 3 --count 24 --recording $recording >/run/lab/tracker.log
    ! grep -q "watch switch 2" /run/lab/auto.txt && [ "$(grep -c unplugged /run/lab/tracker.log)" = 3 ]
    check $? "auto: a loose plug (in and out three times) does not toss the gaze back and forth"
    ${lab}uhid_tracker --rate 60 --recording $recording >/run/lab/tracker.log &
    tracker=$!
    wait $watch
    result=$(grep "^watch samples" /run/lab/auto.txt)
    grep -q "opens=1 losses=[1-9].* switches=2 " <<<"$result"
    check $? "auto: and returns to it when it is back; the reader sees no loss ($result)"
    kill $headset
    wait $headset
    end $tracker
}

for part in latency display suspend; do . "${0%/*}/$part.sh"; done
"case_$1"
step "done"
[ $failures -eq 0 ]
