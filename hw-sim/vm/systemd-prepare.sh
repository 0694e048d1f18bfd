#!/usr/bin/env bash
# systemd-prepare.sh PACKAGE.deb: fills build/systemd-vm with what the virtual machine boots with systemd as its process 1: a Debian 12
# with systemd and all that the package stands on, but not the package, and the first root file system that unpacks it. Needs what
# prepare.sh makes. Does nothing when it is there; after 30 days it is made anew, with Debian's later versions.
set -euo pipefail
package=$(realpath "$1")
cd "$(dirname "$0")/../.."
here=hw-sim/vm
target=build/systemd-vm

stands_on=$(dpkg-deb -f "$package" Depends | sed 's/([^)]*)//g; s/|[^,]*//g; s/ //g')
wanted="systemd systemd-sysv udev kmod v4l-utils ${stands_on//,/ }"
recipe=$(cat $here/systemd-prepare.sh $here/systemd-init build/vm/stamp <(echo "$wanted") | sha256sum | cut -c1-16)
if [ "$(cat $target/stamp 2>/dev/null)" = "$recipe" ] && [ -n "$(find $target/stamp -mtime -30)" ]; then exit 0; fi

began=$(date +%s)
echo "vm: preparing $target, a Debian 12 with systemd (some 80 MB to download)"
work=$(mktemp -d build/systemd-vm.XXXXXX)
trap 'rm -rf "$work"' EXIT
# Without root it does the same in a user namespace.
mmdebstrap --quiet --variant=minbase --include="${wanted// /,}" \
  --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/locale/*' --dpkgopt='path-exclude=/usr/share/man/*' \
  bookworm "$work/root.tar" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
rm "$work/log"
# Of two files of one name the kernel takes the later one.
mkdir "$work/first"
install -m 755 $here/systemd-init "$work/first/init"
(cd "$work/first" && echo init | cpio -o -H newc --quiet) | cat build/vm/initrd.cpio - >"$work/initrd.cpio"
rm -r "$work/first"
echo "$recipe" >"$work/stamp"
chmod -R a+rX "$work"
rm -rf $target
mv "$work" $target
echo "vm: prepared in $(($(date +%s) - began)) s, $(du -sh $target | cut -f1)"
