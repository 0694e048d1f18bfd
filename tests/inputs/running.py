"""Runs a row of the table in a folder of its own."""
import os
import select
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from judge import Outcome

DEADLINE_S = 120
READY_S = 30
PORT = 20000 + os.getpid() % 20000  # of the appliances that rows start


def data_folder():
    """Where public recordings are, or None."""
    named = os.environ.get("BIRDSEYE_DATA")
    folder = Path(named) if named else Path(__file__).parents[2] / ".." / "shared" / "data"
    return folder.resolve() if folder.is_dir() else None


def missing_data(row, data):
    """The first recording that a row needs and that is not there, or nothing."""
    if row.data and data is None:
        return row.data[0]
    return next((name for name in row.data if not (data / name).exists()), "")


def _end(process):
    """Ends a program that we started, and all that it started."""
    try:
        os.killpg(process.pid, signal.SIGTERM)  # an X server takes its lock away
        process.wait(timeout=5)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()


def _listing(folder):
    return {str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns)
            for path in folder.rglob("*") if path.is_file()}


def _start(command, folder, environment, log):
    return subprocess.Popen(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                            stdout=log, stderr=subprocess.STDOUT, start_new_session=True)


def _start_beside(row, folder, logs, environment):
    """The programs that run beside the command; each is ready before the next one starts."""
    started = []
    for number, (command, ready) in enumerate(row.beside):
        log = logs / f"beside{number}.log"
        with log.open("wb") as file:
            started.append(_start(command, folder, environment, file))
        for _ in range(READY_S * 20):
            if ready in log.read_text(errors="replace"):
                break
            time.sleep(0.05)
        else:
            for process in started:
                _end(process)
            raise RuntimeError(f"{command}: not ready: {log.read_text(errors='replace')[-300:]}")
    return started


def _start_screen(environment):
    """An X server, which chooses a number that is free: environment names it. xvfb-run would put its own exit code in
    place of the window's."""
    server = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp", "-noreset"],
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              start_new_session=True)
    number = server.stdout.readline().decode().strip() if select.select([server.stdout], [], [], READY_S)[0] else ""
    if not number:
        _end(server)
        raise RuntimeError("Xvfb: not ready")
    environment["DISPLAY"] = f":{number}"
    return server


def _run(row, folder, logs, environment):
    """Exit code (None after the deadline), seconds and the most memory, MB."""
    began = time.monotonic()
    with (logs / "out").open("wb") as out, (logs / "err").open("wb") as err:
        process = subprocess.Popen(["bash", "-c", row.run], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                   stdout=out, stderr=err, start_new_session=True)
        exit_code = None
        while time.monotonic() - began < DEADLINE_S:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                exit_code = os.waitstatus_to_exitcode(status)
                process.returncode = exit_code
                break
            time.sleep(0.01)
        seconds = time.monotonic() - began
        if exit_code is None:
            os.killpg(process.pid, signal.SIGKILL)
            _, _, usage = os.wait4(process.pid, 0)
            process.returncode = -signal.SIGKILL
    return exit_code, seconds, usage.ru_maxrss / 1024


def _figures(row, folder, output):
    """What is wrong with the row's figures; also where the files that have them cannot be read."""
    try:
        return row.check(folder, output) if row.check else ""
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        return f"the figures cannot be read: {error!r}"


def run(row, programs, data):
    """Makes the row's input, runs its command and returns what came of it."""
    with tempfile.TemporaryDirectory(prefix="inputs-") as scratch:
        folder, logs = Path(scratch) / "work", Path(scratch) / "logs"
        folder.mkdir()
        logs.mkdir()
        environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8",
                       "PORT": str(PORT), "DATA": str(data or ""),
                       "BIRDSEYE_IDENTITY": str(Path(scratch) / "identity")}
        if row.make:
            row.make(folder)
        before = _listing(folder)
        beside = _start_beside(row, folder, logs, environment)
        kept = _listing(folder) if row.beside else before
        try:
            if row.screen:
                beside.append(_start_screen(environment))
            exit_code, seconds, most_mb = _run(row, folder, logs, environment)
        finally:
            for process in reversed(beside):
                _end(process)
        new = {name: size for name, (size, made) in _listing(folder).items()
               if name not in kept or before.get(name, kept[name]) != (size, made) and not row.beside}
        errors = (logs / "err").read_text(errors="replace")
        output = (logs / "out").read_text(errors="replace") + errors
        figures = _figures(row, folder, output) if exit_code is not None else ""
        return Outcome(exit=exit_code, output=output, errors=errors, seconds=seconds, most_mb=most_mb,
                       files=[name for name, size in sorted(new.items()) if size],
                       empty_files=[name for name, size in sorted(new.items()) if not size], figures=figures)
