"""birdseye verify, pair, convert and bench wire, birdseyed pair."""
import os

import volumes
from judge import Row
from rows_cart import BESIDE, cart, cart_at_port
from rows_points import pivot, table, tip_file

RECORD = "birdseye calibrate tip --poses poses.csv --record scope.json >/dev/null; "
RECORDED = tip_file(lambda: table(pivot()))
# With a key of its own: it is another machine.
WAITS = (("echo y | BIRDSEYE_IDENTITY=$PWD/../cart birdseyed pair --config cart.toml --port $PORT --name host-1", "for two minutes"),)
PAIR = "birdseye pair 127.0.0.1:$PORT --name cart-1"
CONVERT = "birdseye convert kept --ct ct.nii.gz --out new"


def pipe(folder):
    os.mkfifo(folder / "pipe")


def session_with_a_pipe(folder):
    (folder / "session").mkdir()
    (folder / "session/recording.json").write_text('{"birdseye_recording": 2, "ended": true, "sha256": {"events.jsonl": ""}, '
                                                   '"signed": {"machine": "", "key": "", "utc": "", "signature": ""}}')
    os.mkfifo(folder / "session/events.jsonl")


def folder_of(kept):
    def make(folder):
        volumes.write_nifti(folder / "ct.nii.gz")
        (folder / "kept").mkdir()
        if kept is not None:
            (folder / "kept/operation.json").write_text(kept)
    return make


ROWS = [
    Row("verify", "good", "a record that this machine wrote", "by whom it is signed; as it was signed", RECORD + "birdseye verify scope.json", 0,
        RECORDED, says=["signed by", "as it was signed"], writes=["scope.json"]),
    Row("verify", "good", "two records at once", "of each by whom it is signed",
        RECORD + "cp scope.json other.json; birdseye verify scope.json other.json", 0, RECORDED,
        says=["scope.json: .* as it was signed", "other.json: .* as it was signed"], writes=["scope.json", "other.json"]),
    Row("verify", "good", "a session recording that this machine recorded", "by whom it is signed; as it was signed",
        "birdseye record --server 127.0.0.1:$PORT --out session --seconds 1 >/dev/null; birdseye verify session", 0, cart_at_port, beside=BESIDE,
        says=["session recording: signed by .* as it was signed"], writes=["session/*"]),
    Row("verify", "good", "--key", "this machine's key and its fingerprint", "birdseye verify --key", 0, says=["fingerprint [0-9a-f]{4} "]),
    Row("verify", "odd", "a record of another machine", "exit code 3: whose it is, and that it is not known here",
        RECORD.replace("birdseye", "BIRDSEYE_IDENTITY=$PWD/../other birdseye") + "birdseye verify scope.json", 3, RECORDED,
        says=["not known here"], writes=["scope.json"]),
    Row("verify", "odd", "another machine's record, with --trust", "its writer is known from then on",
        RECORD.replace("birdseye", "BIRDSEYE_IDENTITY=$PWD/../other birdseye") + "birdseye verify --trust cart-1 scope.json", 0, RECORDED,
        says=["signed by cart-1"], writes=["scope.json"]),
    Row("verify", "wrong", "a record with a figure changed by hand", "exit code 3: changed",
        RECORD + "sed -i 's/\"rms_mm\": 0/\"rms_mm\": 9/' scope.json; birdseye verify scope.json", 3, RECORDED, says=["scope.json", "chang"],
        writes=["scope.json"]),
    Row("verify", "wrong", "a text", "refused: what it verifies", "echo text > some.txt; birdseye verify some.txt", 2, says=["nothing that Birdseye signs"],
        writes=["some.txt"]),
    Row("verify", "wrong", "a file that is not there", "refused: it is named", "birdseye verify none.json", 2, says=["none.json"]),
    Row("verify", "wrong", "a pipe that nobody writes to", "refused at once: it is named", "birdseye verify pipe", 2, pipe,
        says=["pipe: is no file but a pipe"]),
    Row("verify", "wrong", "/dev/zero", "refused at once", "birdseye verify /dev/zero", 2, says=["/dev/zero: is no file"]),
    Row("verify", "wrong", "a session recording whose events are a pipe", "exit code 3 at once: the pipe is named", "birdseye verify session", 3,
        session_with_a_pipe, says=["events.jsonl: is no file but a pipe"]),

    Row("pair", "good", "an appliance that waits, and yes at both", "paired; the code of six digits", "echo y | " + PAIR, 0, cart, beside=WAITS,
        says=["code: [0-9]{3} [0-9]{3}", "paired with cart-1"]),
    Row("pair", "odd", "no at the host", "refused: not paired", "echo n | " + PAIR, 2, cart, beside=WAITS, says=["not paired"]),
    Row("pair", "odd", "nobody at the host says anything", "refused: not paired", PAIR + " </dev/null", 2, cart, beside=WAITS, says=["not paired"]),
    Row("pair", "wrong", "a name that is none", "refused: the name", "echo y | " + PAIR.replace("cart-1", "'two words'"), 2, cart, beside=WAITS,
        says=["two words"]),
    Row("pair", "wrong", "nobody waits there", "refused: the address, and what to start there", "birdseye pair 127.0.0.1:1", 2,
        says=["127.0.0.1:1", "birdseyed pair"]),
    Row("pair", "wrong", "a port that is none", "refused", "birdseye pair 127.0.0.1:99999", 2, says=["99999"]),
    Row("birdseyed pair", "wrong", "no configuration", "refused: it is named", "birdseyed pair --config none.toml", 2, says=["none.toml"]),

    Row("convert", "wrong", "a folder without an operation", "refused: what is not there", CONVERT, 2, folder_of(None), says=["kept/operation.json"]),
    Row("convert", "wrong", "an operation.json that is none of 0.1.0", "refused: there is nothing to convert", CONVERT, 2, folder_of("{}"),
        says=["operation.json", "0.1.0"]),
    Row("convert", "wrong", "a CT that is not there", "refused: it is named", CONVERT.replace("ct.nii.gz", "none.nii.gz"), 2, folder_of("{}"),
        says=["none.nii.gz"]),

    Row("bench wire", "good", "one round of a second", "what TLS costs, and what plain does", "birdseye bench wire --rounds 1 --seconds 1 --json wire.json", 0,
        says=["tls_cpu_percent_more_client"], writes=["wire.json"]),
    Row("bench wire", "wrong", "rounds that are none", "refused: the option", "birdseye bench wire --rounds 0", 2, says=["--rounds"]),
]
