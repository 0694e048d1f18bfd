#!/usr/bin/env python3
"""The appliance's package lives under a real systemd as its manual says: installed, started, unplugged, hung, crashed again and again,
upgraded, removed, purged. Boots the virtual machine once and judges what each step of hw-sim/vm/systemd-guest.sh said.
usage: in the root of the tree, systemd_test.py FOLDER of programs; or FILE, the said.json of a run that has been"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

OUT = pathlib.Path("out/systemd-test")
LIMIT_S = 1200  # six minutes on an emulated processor, ten on a busy machine
WELL = {"active": "active", "status": "ready"}

# Of each step, in order: what it says, and the whole of that as a regular expression.
STEPS = {
    "install": {"code": "0", "installed": "install ok installed", "active": "inactive", "enabled": "enabled",
                "user": "birdseye (?=.*dialout)(?=.*video)(?=.*gpio)(?=.*plugdev).*"},
    "start": {**WELL, "restarts": "0", "policy": r" *RR +10", "capabilities": "0+", "filtered": "2", "user": "birdseye",
              "exposure": r"1\.[0-2]|0\.\d", "wire": "STATUS", "led": "1", "recordings": "1",
              "readable_by_others": ""},
    "unplug_camera": {"active": "active", "status": "degraded: /dev/video0: .*", "restarts": "0"},
    "replug_camera": {**WELL, "restarts": "0"},
    "unplug_tracker": {"active": "active", "status": "degraded: /run/bird: .*", "restarts": "0"},
    "replug_tracker": {**WELL, "restarts": "0"},
    "usb": {**WELL, "restarts": "0"},
    "unplug_usb": {"active": "active", "status": "degraded: usb:.*", "restarts": "0"},
    "replug_usb": {**WELL, "restarts": "0"},
    "watchdog": {**WELL, "restarts": "1", "said": ".*'watchdog'.*"},
    "crash_loop": {"active": "active", "status": "degraded: the camera is left out, .*", "restarts": "3", "same_process": "yes",
                   "said": ".*the camera is left out, .*", "threads": "(?!.*camera).*tracker.*"},
    "restart_by_hand": {**WELL},
    "upgrade": {**WELL, "code": "0", "version": r".*\+later", "restarted": "yes", "configuration": "# a line of its owner"},
    "remove": {"code": "0", "active": "inactive", "program": "", "unit": "", "configuration": "birdseyed.toml", "recordings": "[1-9].*",
               "runtime": ""},
    # What was recorded stays, and with it the user whose it is. The key goes.
    "purge": {"code": "0", "files": "", "recordings": "[1-9].*", "key": "", "user": "birdseye", "status": ""},
}


def boot(binaries):
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    socket = OUT / "adapter.sock"
    command = ["hw-sim/vm/vm.sh", str(OUT), "hw-sim/vm/systemd-guest.sh", "-m", "1536", "-initrd", "build/systemd-vm/initrd.cpio",
               "-device", "qemu-xhci", "-chardev", f"socket,id=adapter,path={socket},server=on,wait=off",
               "-device", "usb-redir,chardev=adapter"]
    with open(OUT / "adapter.log", "w", encoding="utf-8") as log:
        machine = subprocess.Popen(command, env={**os.environ, "BIRDSEYE_VM_LIMIT_S": str(LIMIT_S)})
        while machine.poll() is None and not socket.exists():
            time.sleep(0.1)
        # The tracker's adapter is plugged in from outside. An emulated processor stops for longer than the chip's own fifo lasts.
        adapter = subprocess.Popen([binaries / "birdseye-sim", "ft232r", "--unix", socket, "--serial", "CART0001",
                                    "--receive-fifo", "4096"], stdin=subprocess.PIPE, stdout=log, stderr=log)
        try:
            return machine.wait()
        finally:
            adapter.kill()
            adapter.wait()


def judge(lines):
    """What is wrong, in words, while each step is printed."""
    said = {}
    for line in lines:
        step = json.loads(line)
        said[step.pop("step")] = step
    wrong = []
    for name, wanted in STEPS.items():
        if name not in said:
            wrong.append(f"{name}: the machine did not come to that")
            continue
        faults = [f"{name}: {key} is '{said[name].get(key)}', not '{words}'" for key, words in wanted.items()
                  if not re.fullmatch(words, said[name].get(key, "not said"))]
        print(f"{said[name]['uptime']:>8} s  {name:<16} {'as it should be' if not faults else 'WRONG'}")
        wrong += faults
    return wrong


def main():
    given = pathlib.Path(sys.argv[1])
    if given.is_file():
        wrong = judge(given.read_text(encoding="utf-8").splitlines())
    else:
        code = boot(given)
        file = OUT / "said.json"
        wrong = judge(file.read_text(encoding="utf-8").splitlines() if file.exists() else [])
        if code != 0:
            wrong.append(f"the machine ended with {code}; see {OUT}/guest.log and console.log")
    for fault in wrong:
        print(f"systemd_test: {fault}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
