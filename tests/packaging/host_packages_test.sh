#!/bin/bash
# host_packages_test.sh SOURCE_DIR BUILD_DIR PYTHON: the packages of host and simulator, which package_test.sh has made, hold
# what they should, and all packages what they have in common.
set -eu
source=$1 build=$2 python=$3
all=$build/package/all
fail() { echo "host_packages_test: $*" >&2; exit 1; }

rm -rf "$all"
for name in birdseyed:8 birdseye:1 birdseye-sim:1; do
  section=${name#*:} name=${name%:*}
  deb=$(echo "$build/package/${name}"_[0-9]*.deb)
  contents=$(dpkg-deb -c "$deb")
  for path in usr/bin/$name usr/share/man/man$section/$name.$section.gz usr/share/bash-completion/completions/$name \
    usr/share/doc/$name/copyright usr/share/doc/$name/changelog.gz; do
    grep -q " \./$path\$" <<<"$contents" || fail "$name: no $path in it: $contents"
  done
  if grep -v ' root/root ' <<<"$contents"; then fail "$name: not root's (above)"; fi
  if grep '^d' <<<"$contents" | grep -v '^drwxr-xr-x '; then fail "$name: folders that not all may enter (above)"; fi
  dpkg-deb -x "$deb" "$all"
  version=$(dpkg-deb -f "$deb" Version)
  [ "$(zcat "$all/usr/share/doc/$name/changelog.gz" | head -n 1)" = "birdseye ($version) unstable; urgency=medium" ] ||
    fail "packaging/changelog does not begin with $version"

  program=$all/usr/bin/$name
  if LC_ALL=C grep -aoE "($source|$build)[ -~]*" "$program"; then fail "$name: holds paths of where it was built (above)"; fi
  # Every command that the program has is in its manual page, and every page is one.
  page=$(zcat "$all/usr/share/man/man$section/$name.$section.gz")
  commands=$("$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z0-9-]\{1,\}\).*/\1/p')
  [ "$name" = birdseyed ] || [ -n "$commands" ] || fail "$name --help: tells no commands"
  for command in $commands; do
    inner=$("$program" "$command" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z0-9-]\{1,\}\).*/\1/p')
    for said in ${inner:-""}; do
      grep -qE "(^\.B |\\\\fB)$command${said:+ $said}(\\\\fR|\$)" <<<"$page" || fail "$name.$section: says nothing of $command $said"
    done
  done
  for option in $([ -n "$commands" ] || "$program" --help | grep -oE '^  (-h,)?--[a-z-]+' | grep -oE -- '--[a-z-]+'); do
    grep -qF -- "${option//-/\\-}" <<<"$page" || fail "$name.$section: says nothing of $option"
  done
done
"$python" -B "$source/tests/docs/pages.py" "$all/usr/share/doc/birdseye" || fail "the manual that is installed is not whole (above)"

entry=$all/usr/share/applications/birdseye.desktop
says() { sed -n "s/^$1=//p" "$entry"; }
[ -x "$all/usr/bin/$(says Exec | cut -d ' ' -f 1)" ] || fail "birdseye.desktop starts $(says Exec)"
[ -f "$all/usr/share/icons/hicolor/scalable/apps/$(says Icon).svg" ] || fail "birdseye.desktop shows $(says Icon)"
"$python" -c 'import sys, xml.dom.minidom as x; x.parse(sys.argv[1])' "$all/usr/share/icons/hicolor/scalable/apps/birdseye.svg"
version=$(dpkg-deb -f "$build"/package/birdseye_*.deb Version)
recommends=$(dpkg-deb -f "$build"/package/birdseye_*.deb Recommends)
[ "$recommends" = "birdseye-sim (= $version), birdseyed (= $version)" ] || fail "birdseye recommends $recommends"

# The completion, as bash calls it.
PATH=$all/usr/bin:$PATH
completes() {
  local wanted=$1
  shift
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
  . "$all/usr/share/bash-completion/completions/$1"
  _birdseye "$1"
  [ "${COMPREPLY[*]}" = "$wanted" ] || fail "completion of '$*': '${COMPREPLY[*]}', not '$wanted'"
}
# A program of the folder that one is in is not started by it.
(
  cd "$(mktemp -d)"
  printf '#!/bin/sh\ntouch started\n' >birdseye
  chmod +x birdseye
  . "$all/usr/share/bash-completion/completions/birdseye"
  COMP_WORDS=(./birdseye de) COMP_CWORD=1
  _birdseye ./birdseye
  [ ! -e started ] && [ "${COMPREPLY[*]}" = demo ]
) || fail "the completion of ./birdseye started that program"
completes "demo" birdseye de
completes "hand-eye" birdseye calibrate h
completes "--ct" birdseye demo --c
completes "" birdseye demo --ct /e
completes "--check" birdseyed --ch
completes "campaign cart camera case" birdseye-sim ca
echo "birdseye, birdseyed, birdseye-sim $version: whole"
