#!/bin/bash
# The guest's side of the tests: takes commands from outside, one a line, through a virtio port, and answers each with its exit
# code, the length of what it printed, and that. Ends with "off", or when the other side goes.
. hw-sim/vm/guest.sh
export LC_ALL=C
start_udev
modprobe virtio_console
port=/dev/virtio-ports/birdseye.control
wait_for $port || exit 1
modprobe xhci-pci
start_network || exit 1
exec 3<>$port
echo ready >&3
while read -r -u 3 command && [ "$command" != off ]; do
  echo "+ $command"
  output=$(eval "$command" 2>&1)
  code=$?
  [ $code = 0 ] || echo "$output"
  printf '%d %d\n%s' $code ${#output} "$output" >&3
done
