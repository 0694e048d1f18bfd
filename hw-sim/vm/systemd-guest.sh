# The life of the appliance's package under systemd, from its installation to its purge. Runs in the virtual machine of systemd-init; what
# a step finds goes to /out/said.json in the words that the test outside judges: {"step": ..., "key": "value", ...}, one a line.
. hw-sim/vm/guest.sh
packages=build/systemd-test
systemctl_show() { systemctl show -P "$1" birdseyed; }

# say STEP KEY VALUE...: one line for the judge.
say() {
  local line="{\"step\": \"$1\", \"uptime\": \"$(cut -d ' ' -f 1 /proc/uptime)\""
  shift
  while [ $# -gt 1 ]; do
    line+=", \"$1\": \"$(tr '\n"\\' "  /" <<<"$2" | sed 's/ *$//')\""
    shift 2
  done
  echo "$line}" >>/out/said.json
  echo "$line}"
}
# say_service STEP KEY VALUE...: with it how the service is.
say_service() {
  local step=$1
  shift
  say "$step" active "$(systemctl_show ActiveState)" status "$(systemctl_show StatusText)" restarts "$(systemctl_show NRestarts)" \
    result "$(systemctl_show Result)" "$@"
}

# until_true SECONDS COMMAND...: tries it again and again.
until_true() {
  local end=$((SECONDS + $1))
  shift
  while ! "$@"; do
    [ $SECONDS -lt $end ] || { echo "not within its time: $*"; return 1; }
    sleep 0.5
  done
}
status_is() { [[ "$(systemctl_show ActiveState) $(systemctl_show StatusText)" == "active "$1 ]]; }
journal() { journalctl -u birdseyed -o cat --no-pager; }
main_pid() { systemctl_show MainPID; }
other_pid_than() { [ "$(main_pid)" != "$1" ] && [ "$(systemctl_show ActiveState)" = active ]; }

# A fault in the code of an instrument: its thread gets the signal that such a fault is.
crash_thread() {
  local task
  for task in /proc/"$(main_pid)"/task/*; do
    if [ "$(cat "$task/comm" 2>/dev/null)" = "$1" ]; then
      perl -e 'exit syscall(234, map { $_ + 0 } @ARGV) != 0' "$(main_pid)" "${task##*/}" 11  # tgkill
      return
    fi
  done
  return 1
}

plug_tracker() {
  systemd-run --quiet --collect --unit=bird "$PWD/$packages/vm_instruments" minibird --tty /run/bird
  until_true 20 test -e /run/bird
  chgrp dialout /run/bird
  chmod g+rw /run/bird
}

echo "== install"
start_vivid
start_gpio
plug_tracker
apt-get install -y -qq "$PWD/$(echo $packages/first/*.deb)"
code=$?
say install code $code installed "$(dpkg-query -W -f '${Status}' birdseyed)" active "$(systemctl_show ActiveState)" \
  enabled "$(systemctl is-enabled birdseyed)" user "$(id -nG birdseye)"

echo "== start"
cat >/etc/birdseye/birdseyed.toml <<'TOML'
[tracker]
device = "/run/bird"
[camera]
source = "v4l2:/dev/video0"
width = 320
height = 180
rate_hz = 25
[gpio]
chip = "cart"
pedal = "pedal"
led = "led"
[record]
folder = "/var/lib/birdseye"
frames = false
TOML
runuser -u birdseye -- birdseyed --config /etc/birdseye/birdseyed.toml --check
systemctl start birdseyed
until_true 30 status_is ready
sleep 5
proc=/proc/$(main_pid)
say_service start policy "$(ps -o cls=,rtprio= "$(main_pid)")" capabilities "$(sed -n 's/^CapBnd:\t//p' $proc/status)" \
  filtered "$(sed -n 's/^Seccomp:\t//p' $proc/status)" user "$(ps -o user= "$(main_pid)")" \
  exposure "$(systemd-analyze security --no-pager birdseyed | sed -n 's/.*birdseyed.service: \([0-9.]*\).*/\1/p')" \
  wire "$(timeout 10 bash -c 'head -c 58 </dev/tcp/127.0.0.1/18944' | grep -ao STATUS)" led "$(gpio_value led)" \
  recordings "$(ls /var/lib/birdseye | grep -c berec)" readable_by_others "$(find /var/lib/birdseye -perm /077)"

echo "== unplug"
unplug_vivid
until_true 20 status_is 'degraded:*'
say_service unplug_camera
plug_vivid
until_true 20 status_is ready
say_service replug_camera
systemctl stop bird
until_true 20 status_is 'degraded:*'
say_service unplug_tracker
plug_tracker
until_true 30 status_is ready
say_service replug_tracker

echo "== usb"
sed -i 's,^device = .*,device = "usb:0403:6001:CART0001",' /etc/birdseye/birdseyed.toml
modprobe xhci-pci
controller=$(basename "$(echo /sys/bus/pci/drivers/xhci_hcd/0*)")
systemctl restart birdseyed
until_true 40 status_is ready
say_service usb
echo "$controller" >/sys/bus/pci/drivers/xhci_hcd/unbind
until_true 20 status_is 'degraded:*'
say_service unplug_usb
echo "$controller" >/sys/bus/pci/drivers/xhci_hcd/bind
until_true 40 status_is ready
say_service replug_usb
sed -i 's,^device = "usb.*,device = "/run/bird",' /etc/birdseye/birdseyed.toml
systemctl restart birdseyed
until_true 30 status_is ready

echo "== watchdog"
pid=$(main_pid)
kill -STOP "$pid"
until_true 40 other_pid_than "$pid"
until_true 30 status_is ready
say_service watchdog said "$(journal | grep -i watchdog | tail -n 1)"

echo "== crash loop"
systemctl restart birdseyed
for _ in 1 2 3; do
  until_true 30 status_is ready
  pid=$(main_pid)
  crash_thread camera
  until_true 30 other_pid_than "$pid"
done
until_true 30 status_is 'degraded:*left out*'
pid=$(main_pid)
# Longer than a thread may show no sign of life: one that was never begun must not count.
sleep 40
say_service crash_loop same_process "$([ "$(main_pid)" = "$pid" ] && echo yes)" said "$(journal | grep 'left out' | tail -n 1)" \
  threads "$(cat /proc/"$pid"/task/*/comm)"
systemctl restart birdseyed
until_true 30 status_is ready
say_service restart_by_hand

echo "== upgrade"
echo '# a line of its owner' >>/etc/birdseye/birdseyed.toml
pid=$(main_pid)
apt-get install -y -qq "$PWD/$(echo $packages/second/*.deb)"
code=$?
until_true 30 status_is ready
say_service upgrade code $code version "$(dpkg-query -W -f '${Version}' birdseyed)" restarted "$([ "$(main_pid)" != "$pid" ] && echo yes)" \
  configuration "$(tail -n 1 /etc/birdseye/birdseyed.toml)"

echo "== remove"
apt-get remove -y birdseyed
say remove code $? active "$(systemctl is-active birdseyed)" program "$(ls /usr/bin/birdseyed 2>/dev/null)" unit "$(ls /lib/systemd/system/birdseyed.service 2>/dev/null)" \
  configuration "$(ls /etc/birdseye)" recordings "$(ls /var/lib/birdseye | grep -c berec)" runtime "$(ls -d /run/birdseye 2>/dev/null)"

echo "== purge"
apt-get purge -y birdseyed
code=$?
say purge code $code files "$(find /etc /usr /lib /run -xdev \( -name '*birdseye*' -o -path '*/birdseye/*' \) -not -path '/run/bird*' -not -path '/run/udev/*' | sort)" \
  recordings "$(ls /var/lib/birdseye | grep -c berec)" key "$(ls -d /var/lib/birdseye/identity 2>/dev/null)" user "$(id -nu birdseye)" status "$(dpkg-query -W -f '${Status}' birdseyed 2>/dev/null)"
