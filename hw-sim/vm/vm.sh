#!/usr/bin/env bash
# vm.sh OUT SCRIPT [options of QEMU]: boots the virtual machine, runs SCRIPT in it as root, switches off. Run it in the root of the
# tree after prepare.sh. OUT then holds console.log, guest.log (what SCRIPT printed) and what SCRIPT wrote to /run/out. Exit code: that
# of SCRIPT; 124 if the machine ended, or was ended after BIRDSEYE_VM_LIMIT_S, before SCRIPT did; 125 if it never started.
set -euo pipefail
cd "$(dirname "$0")/../.."
out=$1 script=$2
shift 2
mkdir -p "$out"
rm -f "$out/code"

# The device node alone does not say: some containers have one behind which a kernel does not boot.
accel=tcg
if grep -qwE 'vmx|svm' /proc/cpuinfo && [ -w /dev/kvm ]; then accel=kvm; fi

# The guest reads the host's files with the rights of QEMU, so QEMU gets few.
as=()
if [ "$(id -u)" = 0 ]; then
  groups=--clear-groups
  if [ $accel = kvm ]; then groups=--groups=$(stat -c %g /dev/kvm); fi
  drop=(setpriv --reuid=nobody --regid=nogroup "$groups" --)
  if "${drop[@]}" test -r "$PWD/$script" -a -r build/vm/initrd.cpio 2>/dev/null; then
    as=("${drop[@]}")
    chown nobody "$out"
  else
    echo "vm: QEMU runs as root, for the user nobody cannot read $PWD" >&2
  fi
fi

# -cpu max: some libraries hold instructions that QEMU's default processor does not know.
status=0
timeout --kill-after=5 "${BIRDSEYE_VM_LIMIT_S:-180}" "${as[@]}" qemu-system-x86_64 -accel $accel -cpu max -m 512 -smp 1 \
  -display none -nodefaults -no-reboot -kernel build/vm/vmlinux -initrd build/vm/initrd.cpio \
  -append "console=ttyS0 panic=-1 quiet nokaslr mitigations=off birdseye.tree=$PWD birdseye.script=$script" \
  -serial "file:$out/console.log" \
  -virtfs local,path=/,mount_tag=root,security_model=none,readonly=on,multidevs=remap \
  -virtfs "local,path=$out,mount_tag=out,security_model=none,multidevs=remap" "$@" &
machine=$!
trap 'kill $machine' TERM INT
wait $machine || status=$?
if [ -f "$out/code" ]; then exit "$(cat "$out/code")"; fi
if [ $status = 0 ] || [ $status = 124 ] || [ $status = 137 ]; then exit 124; fi
exit 125
