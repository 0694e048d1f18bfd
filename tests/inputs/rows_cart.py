"""birdseye record, live and demo, birdseyed and birdseye-sim."""
import volumes
from judge import Row
from running import PORT
from rows_draw import registration


def cart(folder, more="", tracker="", camera="", wire=None):
    """birdseyed's configuration for the simulated instruments of BESIDE."""
    port = "port = 18944" if wire is None else wire
    (folder / "cart.toml").write_text(
        f'[tracker]\ndevice = "{folder}/bird"\nnames = ["scope"]\n{tracker}\n[camera]\nsource = "socket:{folder}/cam"\n'
        f'width = 320\nheight = 240\nrate_hz = 25\n{camera}\n[wire]\nbind = "127.0.0.1"\n{port}\n{more}')


def cart_at_port(folder):
    cart(folder, wire=f"port = {PORT}")


BESIDE = (("birdseye-sim minibird --tty $PWD/bird --boot-ms 0", "ready"),
          ("birdseye-sim camera --socket $PWD/cam --size 320x240 --rate 25", "ready"),
          ("birdseyed --config cart.toml", "camera running"))
CHECK = "birdseyed --config cart.toml --check"


def configured(text, **more):
    def make(folder):
        cart(folder, **more)
        if text is not None:
            (folder / "cart.toml").write_text(text)
    return make


def changed(old, new):
    def make(folder):
        cart(folder)
        path = folder / "cart.toml"
        path.write_text(path.read_text().replace(old, new))
    return make


def script(text):
    return lambda folder: (folder / "faults.toml").write_text(text)


def window_script(folder):
    registration(folder)
    (folder / "keys.txt").write_text("sleep 1\nend\n")


def bad_window_script(folder):
    registration(folder)
    (folder / "keys.txt").write_text("sleep 1\npres space\nend\n")


SIM = "birdseye-sim minibird --tty $PWD/bird --boot-ms 0 --seconds 1 --faults faults.toml"
WINDOW = "birdseye live --script keys.txt"

ROWS = [
    Row("record", "good", "an appliance with tracker and camera, 2 s", "pass; a session recording",
        "birdseye record --server 127.0.0.1:$PORT --out session --seconds 2", 0, cart_at_port, "pass", says=["frames"],
        beside=BESIDE, writes=["session/*"]),
    Row("record", "odd", "a folder that holds something", "refused: it is never written over",
        "mkdir session; echo mine > session/events.jsonl; birdseye record --server 127.0.0.1:$PORT --out session --seconds 1", 2,
        cart_at_port, beside=BESIDE, says=["session"], writes=["session/events.jsonl"]),
    Row("record", "wrong", "nobody listens there", "refused or fail within seconds: the address is named",
        "birdseye record --server 127.0.0.1:1 --out session --seconds 1", 2, says=["127.0.0.1:1"], slow=True),
    Row("record", "wrong", "a port that is none", "refused", "birdseye record --server 127.0.0.1:99999 --out session --seconds 1", 2,
        says=["99999"]),
    Row("calibrate latency", "wrong", "an appliance whose scope moves, but whose video shows no texture", "refused: no motion is seen; what to look at",
        "birdseye calibrate latency --server 127.0.0.1:$PORT --seconds 10 --json latency.json", 2, cart_at_port,
        beside=BESIDE, says=["no motion", "texture"], slow=True),
    Row("live", "wrong", "no CT and no server", "refused: what to give", WINDOW, 2, window_script, says=["--server|--simulate|--recording"], screen=True),
    Row("live", "wrong", "a server without a CT", "refused: --ct is named", WINDOW + " --server 127.0.0.1:1", 2, window_script, says=["--ct"], screen=True),
    Row("live", "wrong", "no display", "refused: DISPLAY, xvfb-run",
        "env -u DISPLAY birdseye live --script keys.txt --server 127.0.0.1:1 --ct ct.nii.gz", 2, window_script, says=["DISPLAY|display"]),
    Row("live", "odd", "nobody listens at the server", "the window opens and goes on trying; ended by its script",
        WINDOW + " --server 127.0.0.1:1 --ct ct.nii.gz --board chessboard:9x6:5mm --json live.json", 0, window_script, writes=["live.json"], screen=True),
    Row("live", "wrong", "a script with a word that there is not", "refused before the window opens: line 2",
        WINDOW + " --server 127.0.0.1:1 --ct ct.nii.gz --board chessboard:9x6:5mm", 2, bad_window_script, says=["keys.txt", "2|pres"], screen=True),
    Row("live", "odd", "labels without --organ", "refused: --organ is named",
        WINDOW + " --server 127.0.0.1:1 --ct ct.nii.gz --labels ct.nii.gz --board chessboard:9x6:5mm", 2, window_script, says=["--organ"], screen=True),
    Row("live", "wrong", "a recording that is none", "refused: the path is named",
        WINDOW + " --recording ct.nii.gz --ct ct.nii.gz --board chessboard:9x6:5mm", 2, window_script, says=["ct.nii.gz"], screen=True),
    Row("live", "wrong", "a CT that is not there", "refused before the window opens", WINDOW + " --server 127.0.0.1:1 --ct none", 2, window_script,
        says=["none"], screen=True),
    Row("demo", "wrong", "--ct that is not there", "refused at once: the path is named", "birdseye demo --ct none --out out", 2, says=["none"]),
    Row("demo", "wrong", "--ct that is a text", "refused at once; no half a demo is left", "birdseye demo --ct notes.txt --out out", 2,
        lambda folder: (folder / "notes.txt").write_text("hello\n"), says=["notes.txt"]),
    Row("demo", "good", "a tracker without noise, a liver that has not moved", "pass; a report",
        "birdseye demo --noise none --deformation-mm 0 --out out", 0, verdict="pass", writes=["out/*"], slow=True),

    Row("birdseyed --check", "good", "the configuration of a simulated cart", "sound", CHECK, 0, cart),
    Row("birdseyed --check", "odd", "two faults in one file", "both are told, with their lines", CHECK, 2,
        configured(None, tracker="birds = 0\nrate_hz = 900"), says=["birds", "rate_hz"]),
    Row("birdseyed --check", "odd", "DOS' ends of lines and a mark before UTF-8", "sound", CHECK, 0,
        lambda folder: (cart(folder), (folder / "cart.toml").write_text("\ufeff" + (folder / "cart.toml").read_text().replace("\n", "\r\n"),
                                                                         newline=""))),
    Row("birdseyed --check", "odd", "more birds than names", "refused, or the others are named", CHECK, 2, configured(None, tracker="birds = 3"),
        says=["names|birds"]),
    Row("birdseyed --check", "wrong", "a key that there is not", "refused: key and line", CHECK, 2, configured(None, tracker="hemisfere = \"forward\""),
        says=["hemisfere", "line 4|:4|4"]),
    Row("birdseyed --check", "wrong", "a word in place of a number", "refused: key and line", CHECK, 2, changed("rate_hz = 25", 'rate_hz = "fast"'),
        says=["rate_hz"]),
    Row("birdseyed --check", "wrong", "a source of video that there is not", "refused: those that there are", CHECK, 2,
        changed("socket:", "webcam:"), says=["webcam", "v4l2"]),
    Row("birdseyed --check", "wrong", "TOML that is none", "refused: the line", CHECK, 2, changed("[camera]", "[camera"), says=["cart.toml"]),
    Row("birdseyed --check", "wrong", "a binary file", "refused", CHECK, 2,
        lambda folder: (folder / "cart.toml").write_bytes(bytes(range(256)) * 20), says=["cart.toml"]),
    Row("birdseyed --check", "wrong", "an empty file", "refused: what is missing", CHECK, 2, configured(""), says=["tracker|camera"]),
    Row("birdseyed --check", "wrong", "a map of the field that is not there", "refused: the file is named", CHECK, 2,
        configured(None, more='[calibration]\nfield = "/none/field.json"\n'), says=["/none/field.json"]),
    Row("birdseyed --check", "wrong", "hostile deep_birdseyed.toml", "refused at once",
        "birdseyed --config $DATA/hostile/deep_birdseyed.toml --check", 2, data=["hostile/deep_birdseyed.toml"], says=["deep_birdseyed.toml"]),
    Row("birdseyed --replay", "wrong", "a CT in place of an appliance recording", "refused: it is named",
        "birdseyed --config cart.toml --replay ct.nii.gz", 2, lambda folder: (cart(folder), volumes.write_nifti(folder / "ct.nii.gz")),
        says=["ct.nii.gz"]),

    Row("birdseye-sim", "good", "a script with one fault", "it runs and ends", SIM, 0,
        script('[[fault]]\nname = "drop_byte"\nat_s = 0.1\nfor_s = 0.2\nchance = 0.1\n'), says=["ready"]),
    Row("birdseye-sim", "wrong", "a fault that there is not", "refused: the line, and which page names those that there are", SIM, 2,
        script('[[fault]]\nname = "earthquake"\nat_s = 1\n'), says=["earthquake", "simulated-minibird.md", "line 2|:2"]),
    Row("birdseye-sim", "wrong", "a fault without its time", "refused: at_s", SIM, 2, script('[[fault]]\nname = "drop_byte"\n'), says=["at_s"]),
    Row("birdseye-sim", "wrong", "a chance of 3", "refused: the key", SIM, 2,
        script('[[fault]]\nname = "drop_byte"\nat_s = 1\nchance = 3\n'), says=["chance"]),
    Row("birdseye-sim", "wrong", "a case at an amplitude at which every draw folds", "refused: smaller amplitude",
        "birdseye-sim case --out case --amplitude-mm 200 --views 2 --size 160x120", 2, says=["amplitude"], writes=[]),
    Row("birdseye-sim", "wrong", "a size of video that is none", "refused", "birdseye-sim camera --socket cam --size 10", 2, says=["--size"]),
]
