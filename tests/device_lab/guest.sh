# Runs as the first process of the virtual machine: / is the host's, read-only below a tmpfs, or a root in memory. Runs each
# case by itself and with a limit of its own; leaves in /out: log, `cases` (name, exit status, seconds), dmesg.
. /out/env
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root
mkdir -p /dev/pts /dev/shm /run/lab /etc/udev/rules.d
if [ "$LAB_KIND" = host ]; then
    mkdir -p "/lib/modules/$(uname -r)"
    mount --bind "$LAB_MODULES" "/lib/modules/$(uname -r)"
fi
mount -t devpts devpts /dev/pts
mount -t tmpfs shm /dev/shm
ip link set lo up
report=${LAB_REPORT:-/out/log}
cp "$LAB_SOURCE/configs/udev/60-fovea.rules" /etc/udev/rules.d/
/lib/systemd/systemd-udevd --daemon >/dev/null 2>&1
echo "lab: up after $(cut -d' ' -f1 /proc/uptime) s"
touch /out/up
if [ -n "${LAB_REPORT-}" ]; then echo lab-up >>"$report"; fi
cd "$LAB_SOURCE"

# Three times what it takes in emulation on a quiet machine, and a minute: what is slower than that hangs.
limit_of() { echo $(($(bash "$LAB_BIN/cases.sh" --length "$1") * 3 + 60)); }

# The clock on the board is the host's: ours must go as fast.
board() { cat /sys/class/rtc/rtc0/since_epoch; }
ours() { cut -d. -f1 /proc/uptime; }
board_from=$(board) ours_from=$(ours)
check_clock() {
    local b=$(($(board) - board_from)) o=$(($(ours) - ours_from))
    echo "lab: clock: $o s in $b s of the board's"
    if [ $((o * 10)) -gt $((b * 11 + 30)) ] || [ $((b * 10)) -gt $((o * 11 + 30)) ]; then
        touch /out/clock_off
        if [ -n "${LAB_REPORT-}" ]; then echo lab-clock-off >>"$report"; fi
    fi
}

# Making a folder succeeds once, on whichever machine.
next_case() { # the next case of all that nobody has taken, into $one
    for one in $LAB_CASES $(cat /run/queue/cases 2>/dev/null); do
        if mkdir "/run/queue/taken.$one" 2>/dev/null; then return 0; fi
    done
    return 1
}
mkdir -p /run/queue
if [ "$LAB_KIND" = host ]; then mount -t 9p -o trans=virtio,version=9p2000.L queue /run/queue; fi
while next_case; do
    from=$(cut -d. -f1 /proc/uptime)
    timeout -k 5 "$(limit_of "$one")" bash "$LAB_BIN/cases.sh" "$one" >>"$report" 2>&1
    status=$?
    [ $status -ne 124 ] && [ $status -ne 137 ] || echo "FAIL $one: has not ended in $(limit_of "$one") s" >>"$report"
    line="$one $status $(($(cut -d. -f1 /proc/uptime) - from))"
    echo "$line" >>/out/cases
    if [ -n "${LAB_REPORT-}" ]; then echo "lab-case $line" >>"$report"; fi
    for process in /proc/[0-9]*; do   # what a case that was ended has left behind
        case "$(readlink "$process/exe")" in "$LAB_BIN"/*) kill -9 "${process#/proc/}" ;; esac
    done 2>/dev/null
    check_clock
done
dmesg >/out/dmesg
[ -z "${LAB_REPORT-}" ] || sleep 1   # for the serial line
sync
echo o >/proc/sysrq-trigger
sleep 20
