#!/usr/bin/env bash
# Fills build/vm with what the virtual machine boots: Debian's own kernel and those of its modules that the guest loads, three modules
# that Debian does not build, a first root file system, and a udev daemon. Nothing is installed. Does nothing when it is all
# there for the kernel that apt offers.
set -euo pipefail
cd "$(dirname "$0")/../.."
here=hw-sim/vm
target=build/vm

boot_modules=(virtio_pci 9p 9pnet_virtio overlay)
guest_modules=("${boot_modules[@]}" virtio_console virtio_net xhci-pci usbserial ftdi_sio vivid v4l2loopback gpio-sim)

kernel_release() { apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: linux-image-//p'; }

refresh_lists() {
  local sudo=()
  [ "$(id -u)" = 0 ] || sudo=(sudo)
  "${sudo[@]}" apt-get update -qq
}

release=$(kernel_release)
recipe=$(cat $here/prepare.sh $here/init | sha256sum | cut -c1-16)
if [ -f $target/stamp ] && { [ -z "$release" ] || [ "$(cat $target/stamp)" = "$release $recipe" ]; }; then exit 0; fi
if [ -z "$release" ]; then
  refresh_lists
  release=$(kernel_release)
  [ -n "$release" ] || { echo "vm: apt knows no linux-image-amd64; is this Debian 12 with its package lists?" >&2; exit 2; }
fi
began=$(date +%s)
echo "vm: preparing $target for Linux $release (some 230 MB to download, once)"
mkdir -p build
work=$(mktemp -d build/vm.XXXXXX)
trap 'rm -rf "$work"' EXIT
work=$(realpath "$work")
mkdir "$work/packages" "$work/image" "$work/tree" "$work/new"

# The headers and the sources must be those of the very image, or its modules would not load.
series=$(cut -d. -f1,2 <<<"$release")
packages=("linux-image-$release" "linux-headers-$release" "linux-headers-${release%-amd64}-common" "linux-kbuild-$series"
  "linux-source-$series" v4l2loopback-dkms udev libsystemd-shared)
download() (
  cd "$work/packages"
  if [ "$(id -u)" = 0 ]; then apt-get download -qq -o APT::Sandbox::User=root "$@"; else apt-get download -qq "$@"; fi
)
download "${packages[@]}" || { refresh_lists; download "${packages[@]}"; }
unpack() { dpkg -x "$work/packages/$1"_*.deb "$2"; }
unpack "linux-image-$release" "$work/image"
for package in "${packages[@]:1:5}"; do unpack "$package" "$work/tree"; done
unpack udev "$work/new/udev"
unpack libsystemd-shared "$work/new/udev"

sources=$work/tree/linux-source-$series
tar -C "$work/tree" -xf "$work/tree/usr/src/linux-source-$series.tar.xz" \
  "linux-source-$series"/{scripts/extract-vmlinux,drivers/gpio/gpio-sim.c,drivers/gpio/gpiolib.h,kernel/irq/irq_sim.c}
# QEMU starts an unpacked kernel at once; unpacking itself would take the emulated processor three seconds at every boot.
sh "$sources/scripts/extract-vmlinux" "$work/image/boot/vmlinuz-$release" >"$work/new/vmlinux"

# gpio-sim is off in Debian's configuration, and so is the interrupt simulator that it needs, which cannot be a module
# as it stands: it calls one function that modules may not, where another does the same.
modules=$work/modules
mkdir -p "$modules/gpio" "$modules/loopback"
cp "$sources"/drivers/gpio/* "$sources/kernel/irq/irq_sim.c" "$modules/gpio/"
sed -i 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' "$modules/gpio/irq_sim.c"
cat >>"$modules/gpio/irq_sim.c" <<'C'
#include <linux/module.h>
MODULE_LICENSE("GPL");
C
echo 'obj-m := irq_sim.o gpio-sim.o' >"$modules/gpio/Kbuild"
cp "$work"/tree/usr/src/v4l2loopback-*/*.[ch] "$modules/loopback/"
echo 'obj-m := v4l2loopback.o' >"$modules/loopback/Kbuild"
headers=$work/tree/usr/src/linux-headers-$release
sed -i "s,include /usr/src,include $work/tree/usr/src," "$headers/Makefile"
for folder in gpio loopback; do
  make -s -C "$headers" M="$modules/$folder" modules >"$work/make.log" 2>&1 || { cat "$work/make.log" >&2; exit 1; }
done
mkdir -p "$work/image/lib/modules/$release/extra"
cp "$modules"/*/*.ko "$work/image/lib/modules/$release/extra/"
depmod -b "$work/image" "$release"

# Of the 300 MB of modules keep those that the guest loads, and what those need.
files_of() {
  for module in "$@"; do modprobe -d "$work/image" -S "$release" --show-depends "$module"; done |
    awk '$1 == "insmod" && !seen[$2]++ { print $2 }'
}
kept=$work/new/lib/modules/$release
mkdir -p "$kept"
cp "$work/image/lib/modules/$release"/modules.{order,builtin,builtin.modinfo} "$kept/"
files_of "${guest_modules[@]}" | while read -r file; do
  place=$kept/${file#"$work/image/lib/modules/$release/"}
  mkdir -p "$(dirname "$place")"
  cp "$file" "$place"
done
depmod -b "$work/new" "$release"

# The first root file system: a shell, and the modules without which there is no way to the real one.
initrd=$work/initrd
mkdir -p "$initrd"/{bin,modules,proc,sys,dev,host}
cp "$(command -v busybox)" "$initrd/bin/busybox"
cp $here/init "$initrd/init"
chmod 755 "$initrd/init"
files_of "${boot_modules[@]}" | while read -r file; do
  cp "$file" "$initrd/modules/"
  basename "$file"
done >"$work/order"
mv "$work/order" "$initrd/modules/order"
(cd "$initrd" && find . | cpio -o -H newc --quiet) >"$work/new/initrd.cpio"

chmod 755 "$work/new"
rm -rf $target
mv "$work/new" $target
echo "$release $recipe" >$target/stamp
echo "vm: prepared in $(($(date +%s) - began)) s, $(du -sh $target | cut -f1)"
