# What scripts in the virtual machine have in common: the instruments a cart has, made of Linux's own test drivers. To be sourced.
# A function prints nothing unless it fails.

# Before the drivers, so that none of what they announce is missed: without a udev daemon libusb never sees an adapter come back.
start_udev() {
  local from=build/vm/udev
  mkdir -p /lib/systemd /lib/udev /etc/udev /usr/lib/x86_64-linux-gnu/systemd
  cp -a $from/bin/udevadm /bin/
  cp -a $from/lib/systemd/systemd-udevd /lib/systemd/
  cp -a $from/lib/udev/. /lib/udev/
  cp -a $from/etc/udev/. /etc/udev/
  cp -a $from/usr/lib/x86_64-linux-gnu/systemd/. /usr/lib/x86_64-linux-gnu/systemd/
  # Or it renames the network interface, where the host's own rules and links say so, while start_network is at it.
  mkdir -p /etc/udev/rules.d
  ln -sf /dev/null /etc/udev/rules.d/80-net-setup-link.rules
  /lib/systemd/systemd-udevd --daemon
}

# The host forwards one TCP port here; nothing in here reaches the host or beyond.
start_network() {
  modprobe virtio_net
  wait_for /sys/class/net/eth0 &&
    busybox ip link set lo up &&
    busybox ip link set eth0 up &&
    busybox ip addr add 10.0.2.15/24 dev eth0
}

# A webcam at /dev/video0. Its stamps are of the start of the exposure: those of the end that it gives at first lie in the future.
start_vivid() {
  modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0 vid_cap_nr=0
  wait_for /dev/video0
  v4l2-ctl -d /dev/video0 -c timestamp_source=1
}
unplug_vivid() { echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind; }
plug_vivid() {
  echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
  wait_for /dev/video0
  v4l2-ctl -d /dev/video0 -c timestamp_source=1
}

# /dev/video7: what is written to it comes out as a camera's pictures.
start_loopback() {
  modprobe v4l2loopback devices=1 video_nr=7 exclusive_caps=1
  wait_for /dev/video7
}

gpio_lines=(strobe pedal led trigger)

start_gpio() {
  modprobe gpio-sim
  mountpoint -q /sys/kernel/config || mount -t configfs none /sys/kernel/config
  local chip=/sys/kernel/config/gpio-sim/cart line
  mkdir -p $chip/bank
  echo ${#gpio_lines[@]} >$chip/bank/num_lines
  echo cart >$chip/bank/label
  for line in "${!gpio_lines[@]}"; do
    mkdir $chip/bank/line"$line"
    echo "${gpio_lines[line]}" >$chip/bank/line"$line"/name
  done
  echo 1 >$chip/live
}

# gpio_line NAME: the folder in which the outside world drives that line (pull) and sees it (value).
gpio_line() {
  local chip=/sys/kernel/config/gpio-sim/cart line
  for line in "${!gpio_lines[@]}"; do
    if [ "${gpio_lines[line]}" = "$1" ]; then
      echo /sys/devices/platform/"$(cat $chip/dev_name)/$(cat $chip/bank/chip_name)"/sim_gpio"$line"
    fi
  done
}
gpio_drive() { echo "pull-$2" >"$(gpio_line "$1")/pull"; }  # gpio_drive NAME up|down
gpio_value() { cat "$(gpio_line "$1")/value"; }

# gpio_seen NAME: the values that the line takes within two seconds or so, "0", "1" or "0 1". Nothing is started meanwhile: that takes an
# emulated processor longer than a light flickers, and to find the line may take it those seconds, so they count from there.
gpio_seen() {
  local path value zero='' one='' end
  path=$(gpio_line "$1")/value
  end=$((SECONDS + 3))
  while [ $SECONDS -lt $end ]; do
    read -r value <"$path"
    if [ "$value" = 0 ]; then zero=0; else one=1; fi
  done
  echo $zero $one
}

# gpio_pulses NAME COUNT SECONDS: that many rises, and falls half a period later.
gpio_pulses() {
  local pull i
  pull=$(gpio_line "$1")/pull
  for ((i = 0; i < $2; ++i)); do
    echo pull-up >"$pull"
    sleep "$3"
    echo pull-down >"$pull"
    sleep "$3"
  done
}

# start NAME COMMAND...: in the background, its output in /run/out/NAME.log; stop NAME ends it and gives its exit code.
start() {
  local name=$1
  shift
  mkdir -p /run/started
  (
    "$@" >"/run/out/$name.log" 2>&1 &
    echo $! >"/run/started/$name"
    wait $!
    echo $? >"/run/started/$name.code"
  ) >/dev/null 2>&1 </dev/null 3>&- &
  wait_for "/run/started/$name"
}
stop() {
  local pid code
  pid=$(cat "/run/started/$1")
  kill "$pid" 2>/dev/null
  wait_for "/run/started/$1.code" 50 || kill -KILL "$pid"
  code=$(cat "/run/started/$1.code")
  rm -f "/run/started/$1" "/run/started/$1.code"
  return "$code"
}

# wait_for FILE [TENTHS]: until it is there, or fails.
wait_for() {
  local tenths=${2:-100}
  while [ ! -e "$1" ]; do
    [ $((tenths--)) -gt 0 ] || { echo "no $1" >&2; return 1; }
    sleep 0.1
  done
}
