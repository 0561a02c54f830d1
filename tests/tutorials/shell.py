"""Shells in which the commands of a page are run one after the other, as its reader does."""

from __future__ import annotations

import dataclasses
import fcntl
import os
import pty
import re
import select
import signal
import subprocess
import termios
import threading
import time
from pathlib import Path
from typing import Dict, List, Sequence

_PROMPT = re.compile(r"treeroll: ([^\n]*) > \Z")


@dataclasses.dataclass
class Said:
    """What a command has come to."""

    status: int
    output: Path
    errors: Path
    terminal: "Terminal"
    begin: int  # of the terminal's text, when it began

    def texts(self) -> List[str]:
        """Standard output, standard error, and what stood on the terminal."""
        return [self.output.read_text(errors="replace"), self.errors.read_text(errors="replace"),
                self.terminal.text[self.begin:]]


class Terminal:
    """At which an operator sits. Who answers what the page says, and then goes on with every trial."""

    def __init__(self) -> None:
        self._master, self.slave = pty.openpty()
        settings = termios.tcgetattr(self.slave)
        settings[1] &= ~termios.OPOST
        termios.tcsetattr(self.slave, termios.TCSANOW, settings)
        self.text = ""
        self.answers: List[str] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._sit, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        os.close(self._master)
        os.close(self.slave)

    def _sit(self) -> None:
        while not self._ended.is_set():
            if select.select([self._master], [], [], .05)[0]:
                self.text += os.read(self._master, 65536).decode(errors="replace")
                prompt = _PROMPT.search(self.text)
                if prompt:
                    if self.answers:
                        answer = self.answers.pop(0)
                    else:
                        answer = "a" if "a accepts" in prompt[1] else ""
                    os.write(self._master, (answer + "\n").encode())


class Shell:
    """Bash, with a terminal of its own."""

    def __init__(self, folder: Path, environment: Dict[str, str], before: Sequence[str] = ()):
        """:param before: what it is started with: ["nsenter", ...]"""
        self._folder = folder
        self._outputs = folder / ".said"
        self._outputs.mkdir(exist_ok=True)
        self._num_commands = 0
        self.terminal = Terminal()
        read_end, write_end = os.pipe()

        def take_terminal() -> None:
            os.setsid()
            fcntl.ioctl(self.terminal.slave, termios.TIOCSCTTY, 0)

        self._bash = subprocess.Popen(
            [*before, "bash", "--noprofile", "--norc"], cwd=folder, env=environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            preexec_fn=take_terminal, pass_fds=[write_end])
        os.close(write_end)
        self._statuses = os.fdopen(read_end)
        self._status_fd = write_end

    def run(self, command: str, limit_s: float) -> Said:
        """Runs a command to its end; one that ends with "&" goes on behind."""
        self._num_commands += 1
        name = f"{id(self)}-{self._num_commands}"
        said = Said(-1, self._outputs / (name + ".output"), self._outputs / (name + ".errors"),
                    self.terminal, len(self.terminal.text))
        # Of the shell's own process: it may change its folder, its variables and its jobs.
        self._bash.stdin.write(f"{{ {command}\n}} >{said.output} 2>{said.errors} </dev/null\n"
                               f"echo $? >&{self._status_fd}\n")
        self._bash.stdin.flush()
        if not select.select([self._statuses], [], [], limit_s)[0]:
            raise TimeoutError(f"{command}: has not ended after {limit_s:g} s\n" + "\n".join(said.texts()))
        said.status = int(self._statuses.readline() or -1)
        return said

    def close(self) -> None:
        """Ends what still runs in it: as a terminal that is closed does, then for good."""
        for number, wait_s in ((signal.SIGTERM, 5), (signal.SIGKILL, 5)):
            try:
                os.killpg(self._bash.pid, number)
            except ProcessLookupError:
                break
            deadline = time.monotonic() + wait_s
            while self._group_lives() and time.monotonic() < deadline:
                time.sleep(.02)
        self._bash.stdin.close()
        self._bash.wait()
        self._statuses.close()
        self.terminal.close()

    def _group_lives(self) -> bool:
        self._bash.poll()
        try:
            os.killpg(self._bash.pid, 0)
        except ProcessLookupError:
            return False
        return True
