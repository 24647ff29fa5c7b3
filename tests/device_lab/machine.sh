# The lab's virtual machine, sourced by run: its kernel, its file systems, its start. Uses $here, $source_dir, $cache, $out,
# $build, $kernel, $memory and the functions missing and left_s of run.

# fetch_kernel: Debian's newest kernel into $cache/root, once; its version in $cache/kernel_version.
fetch_kernel() {
    [ ! -s "$cache/kernel_version" ] || return 0
    local package work log=$cache/fetch.log
    for attempt in 1 2; do
        package=$(apt-cache depends linux-image-amd64 2>/dev/null | awk '/Depends:/ {print $2; exit}')
        work=$(mktemp -d "$cache/fetch.XXXXXX")
        if [ -n "$package" ]; then
            echo "device lab: fetching $package"
            (cd "$work" && timeout 150 apt-get "${patience[@]}" download -q "$package" >"$log" 2>&1) && break
        fi
        rm -rf "$work"
        # The lists may be absent or name a version that is gone.
        [ $attempt = 1 ] && [ "$(id -u)" = 0 ] && timeout 90 apt-get "${patience[@]}" update -q >/dev/null 2>&1 && continue
        missing "cannot download Debian's kernel (${package:-apt knows no linux-image-amd64}): $(tail -1 "$log" 2>/dev/null)"
    done
    rm -rf "$cache/root"
    dpkg -x "$work"/*.deb "$cache/root" || missing "the kernel package cannot be unpacked into $cache"
    rm -rf "$work"
    depmod -b "$cache/root" "${package#linux-image-}"
    echo "${package#linux-image-}" >"$cache/kernel_version"
}
patience=(-o Acquire::Retries=1 -o Acquire::http::Timeout=20)

modules_of() { # modules_of MODULE...: their files and those they need, in the order of loading
    local module
    for module in "$@"; do
        modprobe -d "$cache/root" -S "$kernel" --show-depends "$module" | awk '$1 == "insmod" {print $2}'
    done | awk '!seen[$0]++'
}

pack() { # pack TREE FILE [COMMAND]: a folder as a first file system
    (cd "$1" && find . | cpio -o -H newc --quiet | ${3:-gzip -1}) >"$2.new" && mv "$2.new" "$2"
    rm -rf "$1"
}

# make_initrd: busybox and the modules that reach the host's root.
make_initrd() {
    initrd=$cache/initrd.gz
    [ ! -s "$initrd" ] || [ "$here/machine.sh" -nt "$initrd" ] || [ "$cache/kernel_version" -nt "$initrd" ] || return 0
    local tree
    tree=$(mktemp -d "$cache/initrd.XXXXXX")
    mkdir -p "$tree"/{bin,modules,proc,sys,dev,lower,upper,new}
    cp "$(command -v busybox)" "$tree/bin/busybox"
    modules_of virtio_pci 9pnet_virtio 9p overlay | while read -r file; do
        cp "$file" "$tree/modules/"
        basename "$file" >>"$tree/modules/order"
    done
    cat >"$tree/init" <<'INIT'
#!/bin/busybox sh
b=/bin/busybox
$b mount -t proc proc /proc; $b mount -t sysfs sys /sys; $b mount -t devtmpfs dev /dev
if $b grep -q lab.probe /proc/cmdline; then echo "lab: here" >/dev/console; $b poweroff -f; fi
while read -r module; do $b insmod "/modules/$module"; done </modules/order
options=trans=virtio,version=9p2000.L,msize=262144
$b mount -t 9p -o $options,cache=loose,ro hostroot /lower || $b poweroff -f
$b mount -t tmpfs tmp /upper; $b mkdir /upper/up /upper/work
$b mount -t overlay -o lowerdir=/lower,upperdir=/upper/up,workdir=/upper/work root /new
for d in proc sys dev run out tmp; do $b mkdir -p /new/$d; done
for d in proc sys dev; do $b mount --move /$d /new/$d; done
$b mount -t tmpfs run /new/run
$b mount -t 9p -o $options out /new/out
exec $b switch_root /new /bin/bash /out/guest.sh </dev/console >/dev/console 2>&1
INIT
    chmod +x "$tree/init"
    pack "$tree" "$initrd"
}

# make_ram_root: the whole machine in memory, for a case that suspends it: a file system that the host serves does not
# outlive that. Programs with their libraries, the lab's files, a few modules; no package of the host's /etc.
make_ram_root() {
    local tree file program
    ram_root=$out/ram_root.cpio
    tree=$(mktemp -d "$out/ram.XXXXXX")
    mkdir -p "$tree"/{bin,dev,proc,sys,run,tmp,out/bin,etc/udev/rules.d,lib/systemd,lib/modules,lab}

    cp "$(command -v busybox)" "$tree/bin/busybox"
    cp "$(command -v bash)" "$tree/bin/bash"
    cp /lib/systemd/systemd-udevd "$tree/lib/systemd/"
    cp "$(command -v udevadm)" "$tree/bin/"
    for program in fovead fovea lab_probe lab_uhid_tracker lab_usb_headset; do
        strip -o "$tree/out/bin/$program" "$out/bin/$program" 2>/dev/null || cp "$out/bin/$program" "$tree/out/bin/"
    done
    { for file in "$tree"/bin/bash "$tree"/bin/udevadm "$tree"/lib/systemd/systemd-udevd "$tree"/out/bin/*; do ldd "$file" 2>/dev/null; done; } |
        grep -o '/[^ ]*\.so[^ ]*' | sort -u | while read -r file; do
            mkdir -p "$tree$(dirname "$file")"
            cp -L "$file" "$tree$file"
        done
    modules_of uhid hid-generic vhci-hcd vivid rtc-cmos 2>/dev/null | while read -r file; do
        file=${file#"$cache/root/lib/modules/"}
        mkdir -p "$tree/lib/modules/$(dirname "$file")"
        cp "$cache/root/lib/modules/$file" "$tree/lib/modules/$file"
    done
    cp "$cache/root/lib/modules/$kernel"/modules.{order,builtin} "$tree/lib/modules/$kernel/"
    depmod -b "$tree" "$kernel" 2>/dev/null
    mkdir -p "$tree/lab/configs"
    cp -r "$source_dir/configs/devices" "$source_dir/configs/udev" "$tree/lab/configs/"
    cp "$out"/bin/*.sh "$out/bin/recording.fovea" "$tree/out/bin/"
    cp "$here/guest.sh" "$tree/out/"
    printf 'root:x:0:0::/:/bin/sh\n' >"$tree/etc/passwd"
    printf 'root:x:0:\nplugdev:x:46:\nvideo:x:44:\n' >"$tree/etc/group"
    cat >"$tree/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
stty -F /dev/ttyS1 raw -echo
. /out/env_ram
export LAB_REPORT=/dev/ttyS1
exec bash /out/guest.sh </dev/null
INIT
    chmod +x "$tree/init"
    environment ram "$@" >"$tree/out/env"
    cp "$tree/out/env" "$tree/out/env_ram"
    pack "$tree" "$ram_root" cat
}

environment() { # environment KIND [CASE]: what guest.sh is told; without a case it takes them from the queue
    local kind=$1
    shift
    cat <<TXT
LAB_MODULES='$cache/root/lib/modules/$kernel'
LAB_SOURCE='$([ "$kind" = ram ] && echo /lab || echo "$source_dir")'
export LAB_BIN='$([ "$kind" = ram ] && echo /out/bin || echo "$out/bin")'
export LAB_KO='$cache/modules'
LAB_KIND=$kind
LAB_CASES='$*'
TXT
}

# find_clock: how fast this processor's time stamp counter runs, which is the emulated one's too. Left to measure it against
# emulated timers, a kernel that starts on a busy machine has run five times too fast.
find_clock() {
    local khz
    khz=$("$build/bin/lab_probe" tsc)
    clock=${khz:+tsc_early_khz=$khz}
}

# find_accelerator: KVM where the lab's kernel gets up under it, else emulation. A /dev/kvm may be there and be of no use.
find_accelerator() {
    [ "$accel" = auto ] || return 0
    accel=tcg
    [ -r /dev/kvm ] && [ -w /dev/kvm ] || return 0
    local console=$cache/kvm_probe.log
    (timeout 20 qemu-system-x86_64 -accel kvm -cpu host -smp 1 -m 512 -M pc -nodefaults -display none -no-reboot -serial "file:$console" \
        -kernel "$cache/root/boot/vmlinuz-$kernel" -initrd "$initrd" -append "console=ttyS0 quiet panic=-1 lab.probe" </dev/null >/dev/null 2>&1 || true) 2>/dev/null
    if grep -q "lab: here" "$console" 2>/dev/null; then accel=kvm; else echo "device lab: /dev/kvm is there but of no use; emulating"; fi
}

# boot DIR QUEUE|suspend: one virtual machine, for the cases of a queue or for the one; leaves up, cases, log, dmesg, console.log, qemu.log in DIR. One that does not get as
# far as its first program gets a second chance.
boot() {
    boot_once "$@"
    [ -e "$1/up" ] || { [ ! -e "$1/console.log" ] || mv "$1/console.log" "$1/console_first.log"; boot_once "$@"; }
}
boot_once() {
    local dir=$1 seconds first=$initrd
    shift
    mkdir -p "$dir"
    seconds=$(left_s)
    [ "$seconds" -gt 20 ] || return 0
    local machine=(-accel tcg,thread=multi -cpu max,la57=off)
    [ "$accel" = kvm ] && machine=(-accel kvm -cpu host)
    if [ "$1" = suspend ]; then
        # In a machine that never wakes up no clock goes on that could end it.
        [ "$seconds" -lt 300 ] || seconds=300
        make_ram_root "$@"
        first=$ram_root
        machine+=(-serial "file:$dir/console.log" -serial "file:$dir/report")
    else
        cp "$here/guest.sh" "$dir/guest.sh"
        environment host >"$dir/env"
        machine+=(-serial "file:$dir/console.log" -device virtio-rng-pci
            -fsdev local,id=root,path=/,security_model=none,readonly=on,multidevs=remap -device virtio-9p-pci,fsdev=root,mount_tag=hostroot
            -fsdev local,id=out,path="$dir",security_model=none,multidevs=remap -device virtio-9p-pci,fsdev=out,mount_tag=out
            -fsdev local,id=queue,path="$1",security_model=none,multidevs=remap -device virtio-9p-pci,fsdev=queue,mount_tag=queue)
    fi
    timeout -k 5 "$seconds" qemu-system-x86_64 "${machine[@]}" -smp "$processors" -m "$memory" -M pc -nodefaults -display none -no-reboot \
        -kernel "$cache/root/boot/vmlinuz-$kernel" -initrd "$first" \
        -append "console=ttyS0 quiet panic=-1 mitigations=off nokaslr tsc=reliable random.trust_cpu=on no_timer_check $([ "$accel" = kvm ] || echo "$clock")" \
        </dev/null >"$dir/qemu.log" 2>&1 || echo "qemu ended with $?" >>"$dir/qemu.log"
    # A machine without a share reports over its second serial line, in the same form.
    if [ -s "$dir/report" ]; then
        tr -d '\r' <"$dir/report" | grep -av '^lab-' >"$dir/log"
        grep -a '^lab-case ' "$dir/report" | cut -d' ' -f2- >"$dir/cases" || true
        ! grep -qa '^lab-clock-off' "$dir/report" || touch "$dir/clock_off"
        ! grep -qa '^lab-up' "$dir/report" || touch "$dir/up"
        rm -f "$ram_root"
    fi
}
