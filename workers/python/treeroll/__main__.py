"""``python3 -m treeroll task FILE.py:CLASS`` runs a task for a worker; ``python3 -m treeroll watch``
follows what is learnt; ``python3 -m treeroll log FILE`` shows what lcm-logger has written down."""

from __future__ import annotations

import argparse
import importlib.util
import os
import signal
import sys
from contextlib import nullcontext
from pathlib import Path

from .lcm_log import Reader, write_csv, write_lines
from .program import run
from .watcher import Watcher


def load_task(place: str) -> type:
    """The class of FILE.py:CLASS."""
    file, _, name = place.rpartition(":")
    # By the name under which others, a child of multiprocessing say, import it: what is pickled has it.
    stem = Path(file).stem
    module_name = stem if stem.isidentifier() and stem not in sys.modules else "treeroll_task"
    spec = importlib.util.spec_from_file_location(module_name, file) if file else None
    if spec is None or not Path(file).is_file():
        sys.exit(f"{place}: must be FILE.py:CLASS")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(Path(file).resolve().parent))
    sys.modules[module_name] = module
    spec.loader.exec_module(module)
    if not hasattr(module, name):
        sys.exit(f"{place}: the file has no class {name}")
    return getattr(module, name)


def write_whole(file: Path, text: str) -> None:
    """Whoever reads it meanwhile, a robot say, finds the text before or this one, whole."""
    part = file.with_name(file.name + ".part")
    part.unlink(missing_ok=True)  # one left over; a link that lies there is not written through
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    with os.fdopen(os.open(part, flags, 0o644), "w") as whole:
        whole.write(text)
    os.replace(part, file)


def watch(arguments: argparse.Namespace) -> None:
    """A line each time a run's best policy has become better."""
    with Watcher(arguments.study, arguments.lcm_url, arguments.key_file) as watcher:
        if not watcher.verified:
            print("unverified: anybody on the network may have said this (--key-file)", file=sys.stderr)
        shown: dict = {}
        written = None
        for _ in watcher.updates(arguments.timeout_s):
            for best in watcher.all_best():
                key = (best.study, best.condition, best.repetition)
                if shown.get(key) == best.reward:
                    continue
                shown[key] = best.reward
                print(f"{best.study} {best.condition} {best.repetition}: reward {best.reward!r} "
                      f"at roll-out {best.rollout}", flush=True)
            best = watcher.best()
            if arguments.output and best is not None and best.text != written:
                write_whole(arguments.output, best.text + "\n")
                written = best.text
            if watcher.is_done():
                return
        sys.exit(f"nothing was heard for {arguments.timeout_s:g} s")


def show_log(arguments: argparse.Namespace) -> None:
    """The messages of an LCM log."""
    if arguments.csv and not arguments.channel:
        sys.exit("--csv has the fields of one type: name its --channel")
    reader = Reader(arguments.file)
    with open(arguments.file, "rb"):
        pass  # what cannot be read leaves no output behind
    # "x": whatever stands there, the log itself even, is left as it is.
    with open(arguments.output, "x", newline="") if arguments.output else nullcontext(sys.stdout) as out:
        if arguments.csv:
            write_csv(reader, arguments.channel, out)
        else:
            write_lines(reader, arguments.channel, out)
    for channel, count in reader.unknown.items():
        # Its records are checked one by one and are no messages.
        hint = ": treeroll-replay DIR --export lcm makes messages of them" if channel == "TREEROLL_JOURNAL" else ""
        print(f"{count} messages of {channel!r} are of no type that is known here{hint}", file=sys.stderr)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python3 -m treeroll", description=__doc__)
    commands = parser.add_subparsers(required=True)
    task = commands.add_parser("task", help="run a task for treeroll-worker --evaluator")
    task.add_argument("place", metavar="FILE.py:CLASS")
    task.set_defaults(work=lambda arguments: run(load_task(arguments.place)))
    follow = commands.add_parser("watch", help="say what the best policies are, until the study ends")
    follow.add_argument("--study", help="name of the study [the first that is heard]")
    follow.add_argument("--lcm-url", help="[LCM_DEFAULT_URL, else LCM's own]")
    follow.add_argument("--key-file", help="of treeroll-keygen: only what a learner has signed")
    follow.add_argument("--output", type=Path, help="keep the best policy of all in this file")
    follow.add_argument("--timeout-s", type=float, default=60.0, help="give up after such a silence")
    follow.set_defaults(work=watch)
    log = commands.add_parser("log", help="print the messages of an LCM log as JSON lines, or as CSV")
    log.add_argument("file", type=Path, help="of lcm-logger")
    log.add_argument("--channel", help="of this one alone, such as TREEROLL_RUNS")
    log.add_argument("--csv", action="store_true", help="a row a message of the channel")
    log.add_argument("--output", type=Path, help="a new file to write to [standard output]")
    log.set_defaults(work=show_log)
    arguments = parser.parse_args()
    try:
        try:
            arguments.work(arguments)
        finally:
            if sys.stdout is not None:  # it may be closed
                sys.stdout.flush()  # what fails is told here, not at the interpreter's end
    except KeyboardInterrupt:
        # How one ends watching. Python ends by the signal itself, as shells expect, but is not to say where it was.
        sys.excepthook = lambda *_: None
        raise
    except BrokenPipeError:
        forget_output()
        sys.exit(128 + signal.SIGPIPE)  # as of any program whose reader has seen enough: head, less
    except OSError as error:
        forget_output()
        sys.exit(f"{parser.prog}: {error}")
    except ValueError as error:
        sys.exit(f"{parser.prog}: {error}")


def forget_output() -> None:
    """What could not be written would be tried again at the interpreter's end, and told as its fault."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)


if __name__ == "__main__":
    main()
