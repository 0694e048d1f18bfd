#!/usr/bin/env bash
# systemd-packages.sh BUILD: fills build/systemd-test with what the virtual machine takes: the appliance's package (first), the same under a
# higher version to upgrade to (second), and the simulated instruments.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=$1 target=$PWD/build/systemd-test
rm -rf "$target"
mkdir -p "$target/first" "$target/second"
(umask 022 && cd "$build" && cpack -B "$target/packed" -D CPACK_COMPONENTS_ALL=birdseyed -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip >"$target/log" 2>&1) ||
  { cat "$target/log" >&2; exit 1; }
mv "$target"/packed/birdseyed_*.deb "$target/first/"
dpkg-deb -R "$target"/first/*.deb "$target/files"
sed -i 's/^Version: .*/&+later/' "$target/files/DEBIAN/control"
dpkg-deb --root-owner-group -Zgzip -b "$target/files" "$target/second" >/dev/null
rm -rf "$target/packed" "$target/files"
cp "$build/bin/vm_instruments" "$target/"
chmod -R a+rX "$target"
