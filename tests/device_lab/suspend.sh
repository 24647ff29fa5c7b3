# The machine sleeps and wakes up again, sourced by cases.sh. Suspended to memory for real, all devices and the processor off
# (ACPI S3), and woken by the clock on its board; so it has a file system in memory, for what the host serves over virtio does
# not outlive that.

status_line() { "$LAB_BIN/fovea" status --run-dir /run/lab/fovea | grep -E "$1"; }
running() { status_line "^ *state" | grep -q running; }
opened() { status_line "^ *state" | grep -o 'opened [0-9]* times, lost [0-9]* times'; }
number_published() { status_line "models published" | grep -o '[0-9]* models published' | cut -d' ' -f1; }
more_than() { [ "$(number_published)" -gt "$1" ]; }
sleep_of_the_machine() { # sleep_of_the_machine KIND: its line in $slept
    slept=$(${lab}probe sleep --seconds 6)   # falling asleep takes half a second, and more on a busy host
    check $? "suspend, $1: the machine slept ($slept)"
}

case_suspend() {
    local daemon tracker focus result slept files published
    if ! grep -q mem /sys/power/state || [ ! -e /sys/class/rtc/rtc0/wakealarm ]; then bad "suspend: this machine cannot sleep"; return; fi
    step "suspend: HID"
    modprobe -a uhid hid-generic vhci-hcd
    # Its clock is its own: it goes on through the night.
    ${lab}uhid_tracker --rate 250 --stamps boottime --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 5 ls /dev/hidraw0
    start_daemon source.driver=hid filter.name=none
    await 20 running || bad "suspend, hid: streams"
    ${lab}probe focus >/run/lab/focus.txt &
    focus=$!
    sleep 3
    files=$(ls /proc/$daemon/fd | wc -l)
    sleep_of_the_machine hid
    await 20 running
    check $? "suspend, hid: fovead recovers by itself"
    sleep 4
    [ "$(opened)" = "opened 2 times, lost 1 times" ] && grep -q "the machine has slept" /run/lab/daemon.log
    check $? "suspend, hid: it was a loss, and is told of ($(opened))"
    [ "$(ls /proc/$daemon/fd | wc -l)" -le "$files" ]
    check $? "suspend, hid: no file leaks"
    kill $focus
    wait $focus
    stop_daemon "suspend, hid"
    end $tracker
    result=$(cat /run/lab/focus.txt)
    [ "$(field "$result" live_before)" -gt 100 ] && [ "$(field "$result" woke)" = 1 ] && [ "$(field "$result" live_after)" -gt 100 ]
    check $? "suspend, hid: an app sees the gaze go and come back"
    echo "MEASURED suspend: an app was shown gaze from before the sleep for $(field "$result" old_gaze_ms) ms after it, and new gaze after $(field "$result" back_ms) ms"
    result=$(${lab}probe after-sleep /run/lab/session.fovea --to-ns "$(field "$slept" to_ns)" --from-boot-ns "$(field "$slept" from_boot_ns)" --to-boot-ns "$(field "$slept" to_boot_ns)")
    [ "$(field "$result" before)" -gt 200 ] && [ "$(field "$result" after)" -gt 200 ] && [ "$(field "$result" late)" = 0 ]
    check $? "suspend, hid: no sample from before is published after it ($result)"
    [ "$(field "$result" backwards)" = 0 ] && [ "$(field "$result" future)" = 0 ] && [ "$(field "$result" unmarked)" = 0 ] &&
        awk -v off="$(field "$result" worst_off_ms)" 'BEGIN {exit !(off < 500)}'
    check $? "suspend, hid: exposures rise, none is in the future, and the $(($(field "$slept" slept_ms) / 1000)) s that the tracker's clock gained do not show; times are marked as estimated until it is known again"

    step "suspend: camera"
    modprobe vivid n_devs=1 node_types=0x1 input_types=0x0 || bad "suspend: vivid"
    await 10 ls /dev/video0
    start_daemon source.driver=camera source.path=/dev/video0 source.format=GREY source.width=320
    await 30 running || bad "suspend, camera: streams"
    await 10 more_than 5
    sleep_of_the_machine camera
    await 20 running
    published=$(number_published)
    await 30 more_than $((published + 5)) && running && [ "$(opened)" = "opened 2 times, lost 1 times" ]
    check $? "suspend, camera: fovead streams again ($(opened))"
    stop_daemon "suspend, camera"
    rmmod vivid

    step "suspend: USB"
    # A bus that cuts the power when the machine sleeps: the headset is gone before, and is back, from its beginning, after.
    # (vhci refuses the sleep of a machine with a device plugged in.)
    ${lab}usb_headset --rate 120 --recording $recording >/run/lab/headset.log &
    tracker=$!
    await 10 usb_there 0cde
    start_daemon source.driver=psvr2
    await 20 running || bad "suspend, usb: streams"
    await 10 more_than 20
    end $tracker
    sleep_of_the_machine usb
    ${lab}usb_headset --rate 120 --recording $recording >/run/lab/headset.log &
    tracker=$!
    published=$(number_published)
    await 30 more_than $((published + 20)) && running
    check $? "suspend, usb: fovead finds a headset that was reset, and streams again"
    stop_daemon "suspend, usb"
    end $tracker

    step "suspend: asleep without a tracker"
    start_daemon source.driver=hid
    sleep 1
    sleep_of_the_machine "no tracker"
    ${lab}uhid_tracker --rate 250 --stamps boottime --recording $recording >/run/lab/tracker.log &
    tracker=$!
    await 20 running && await 10 more_than 20
    check $? "suspend: a tracker that is plugged in after it is found"
    stop_daemon "suspend, no tracker"
    end $tracker
}
