# Runs as the first process of the virtual machine: / is the host's, read-only below a tmpfs. Sources the case file and
# leaves its exit status in /out/rc.
. /out/env
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root
mkdir -p "/lib/modules/$(uname -r)" /dev/pts /dev/shm
mount --bind "$LAB_MODULES" "/lib/modules/$(uname -r)"
mount -t devpts devpts /dev/pts
mount -t tmpfs shm /dev/shm
mkdir -p /run/lab
ip link set lo up
mkdir -p /etc/udev/rules.d
cp "$LAB_SOURCE/configs/udev/60-fovea.rules" /etc/udev/rules.d/
/lib/systemd/systemd-udevd --daemon >/dev/null 2>&1
echo "lab: up after $(cut -d' ' -f1 /proc/uptime) s"
cd "$LAB_SOURCE"
timeout ${LAB_LIMIT:-440} bash tests/device_lab/cases.sh $LAB_CASES >/out/log 2>&1
echo $? >/out/rc
dmesg >/out/dmesg
sync
echo o >/proc/sysrq-trigger
sleep 20
