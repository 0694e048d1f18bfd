#!/bin/sh
# package_test.sh SOURCE_DIR BUILD_DIR [EMULATOR...]: the appliance's Debian package holds what it should and its parts are
# sound. All packages are made here, for the other tests of packages too, and packed quickly rather than small.
set -eu
umask 022
source=$1 build=$2
shift 2

fail() { echo "package_test: $*" >&2; exit 1; }

(cd "$build" && rm -rf package && cpack -B package -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip >cpack.log 2>&1) || { cat "$build/cpack.log" >&2; fail "cpack failed"; }
# Packed again, elsewhere and later, it is the same to the byte. The time in it is the last commit's.
if git -C "$source" log -1 >/dev/null 2>&1; then
  (cd "$build" && cpack -B package/again -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip -D CPACK_COMPONENTS_ALL=birdseyed >cpack.log 2>&1) ||
    { cat "$build/cpack.log" >&2; fail "cpack failed"; }
  cmp "$build"/package/birdseyed_*.deb "$build"/package/again/birdseyed_*.deb || fail "packed twice it is not the same"
  rm -rf "$build/package/again"
fi
set -- "$@" "$build/bin/birdseyed"  # from here on "$@" runs the program
deb=$(ls "$build"/package/birdseyed_*.deb)

contents=$(dpkg-deb -c "$deb")
for path in ./usr/bin/birdseyed ./etc/birdseye/birdseyed.toml ./usr/lib/systemd/system/birdseyed.service \
  ./usr/lib/sysusers.d/birdseyed.conf ./usr/lib/udev/rules.d/60-birdseye.rules ./usr/share/doc/birdseyed/copyright ./usr/share/doc/birdseyed/changelog.gz \
  ./usr/share/man/man8/birdseyed.8.gz ./usr/share/bash-completion/completions/birdseyed; do
  echo "$contents" | grep -q "root/root .* $path\$" || fail "no $path in it, or not root's: $contents"
done
echo "$contents" | grep -q '^-rwxr-xr-x .*/usr/bin/birdseyed$' || fail "birdseyed is not to be run by everybody"
[ "$(echo "$contents" | grep -v /usr/share/doc/ | grep -c -v '/$')" -le 10 ] || fail "more in it than the appliance: $contents"

# Every link of the manual that comes with it leads somewhere, and so does the unit's.
files=$build/package/files
rm -rf "$files"
dpkg-deb -x "$deb" "$files"
for page in $(find "$files/usr/share/doc/birdseyed" -name '*.md'); do
  for link in $(sed 's/](/\n](/g' "$page" | sed -n 's/^](\([^)#]*\).*/\1/p'); do
    case $link in *://*) continue ;; esac
    [ -e "$(dirname "$page")/$link" ] || fail "${page#"$files"} links to $link, which is not in the package"
  done
done
documentation=$(sed -n 's|^Documentation=file://||p' "$source/packaging/birdseyed.service")
[ -f "$files$documentation" ] || fail "no $documentation, which the unit names"

depends=$(dpkg-deb -f "$deb" Depends)
for package in libc6 libstdc++6 libopenigtlink libfmt; do
  case $depends in *"$package"*) ;; *) fail "does not depend on $package: $depends" ;; esac
done
for package in opencv insighttoolkit libgl embree glfw; do
  case $depends in *"$package"*) fail "the appliance stands on $package: $depends" ;; esac
done
case $(basename "$deb") in
  *_"$(dpkg-deb -f "$deb" Architecture)".deb) ;;
  *) fail "$(basename "$deb") is for $(dpkg-deb -f "$deb" Architecture)" ;;
esac

control=$build/package/control
rm -rf "$control"
dpkg-deb -e "$deb" "$control"
grep -qx /etc/birdseye/birdseyed.toml "$control/conffiles" || fail "an upgrade would overwrite the configuration"
grep -q 'install -d -m 0700 -o birdseye -g birdseye /var/lib/birdseye' "$control/postinst" || fail "pairing before the first start finds no folder"
for script in postinst prerm postrm; do
  [ -x "$control/$script" ] || fail "$script: cannot be run"
  sh -n "$control/$script" || fail "$script: is not sh"
done

"$@" --config "$source/packaging/birdseyed.toml" --check || fail "the default configuration is refused"

if command -v systemd-analyze >/dev/null; then
  # Of a copy that names a program which is there, whoever's machine it is built for.
  sed "s|^ExecStart=[^ ]*|ExecStart=$build/bin/birdseyed|; /^Documentation=/d" "$source/packaging/birdseyed.service" \
    >"$build/package/birdseyed.service"
  said=$(systemd-analyze verify --recursive-errors=no "$build/package/birdseyed.service" 2>&1) || fail "the unit: $said"
  [ -z "$said" ] || fail "the unit: $said"
fi
echo "$(basename "$deb"): $(stat -c %s "$deb") bytes; depends: $depends"
