#!/bin/sh
# hardening_test.sh FORTIFIED PROGRAM...: each program is built so that damage ends it rather than taking it over: read from
# its ELF file, on whichever machine it was built for. FORTIFIED is 0 where the compiler did not optimise.
set -eu
fortified=$1
shift

fail() { echo "hardening_test: $program: $*" >&2; exit 1; }

for program in "$@"; do
  header=$(readelf --wide --file-header --program-headers "$program")
  dynamic=$(readelf --wide --dynamic "$program")
  imported=$(readelf --wide --dyn-syms "$program" | awk '$7 == "UND" { sub("@.*", "", $8); print $8 }')
  has() { echo "$1" | grep -qE "$2"; }

  has "$header" '^ *Type: +DYN ' && has "$header" '^ *INTERP ' || fail "stands always at the same address: not PIE"
  has "$header" '^ *GNU_RELRO ' || fail "its table of functions could be overwritten: no GNU_RELRO"
  has "$dynamic" '\(FLAGS\).*BIND_NOW|\(FLAGS_1\).* NOW( |$)' ||
    fail "its table of functions stays open while it runs: no BIND_NOW"
  stack=$(echo "$header" | awk '$1 == "GNU_STACK" { print $7 }')
  [ "$stack" = RW ] || fail "its stack is ${stack:-not said to be RW}: what is written there could be run"
  ! has "$header" '^ *LOAD .* RWE ' || fail "has memory that is both written and run"
  has "$imported" '^__stack_chk_fail$' || fail "does not see an overrun of its stack: no __stack_chk_fail"
  checked=$(echo "$imported" | grep -cE '^__.*_chk$' || true)
  [ "$fortified" = 0 ] || [ "$checked" -gt 0 ] || fail "copies without looking at sizes: no function of FORTIFY"
  echo "$(basename "$program"): PIE, RELRO, BIND_NOW, a stack of data only and guarded; $checked functions of FORTIFY"
done
