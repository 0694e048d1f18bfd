#!/bin/sh
# lintian_test.sh FOLDER: lintian, which looks for breaches of Debian's policy, finds no error in the packages of FOLDER. What it
# warns of is shown. It needs a hundred packages of its own, which no other work here needs: where it is not installed, the
# test is skipped.
set -eu
command -v lintian >/dev/null || { echo "lintian_test: lintian is not installed; skipped"; exit 77; }
cd "$1"
exec lintian --allow-root --profile debian --fail-on error birdseye*.deb
