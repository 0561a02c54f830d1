"""Reads a tutorial as a person does: writes its files, runs its commands, compares what it shows."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Callable, Dict, List, Optional

from page import Command, File, Picture, missing, steps_of
from shell import Said, Shell

COMMAND_LIMIT_S = 240.0
BEHIND_LIMIT_S = 60.0  # until what goes on behind has printed what the page shows
_TYPED = re.compile(r"^treeroll: .* > ?(.*)$")


def own_network(group: int) -> str:
    """A multicast group and a port of this process's own, on this host."""
    pid = os.getpid()
    return f"udpm://239.255.{group}.{pid % 250 + 1}:{20000 + pid % 20000}?ttl=0"


class TutorialError(Exception):
    """A command of the page did not do what the page says."""


class Hosts:
    """Network namespaces with a cable between them: they stand in for the hosts that a page names."""

    def __init__(self, names: List[str]):
        self._holders = {}
        try:
            for name in names:
                # Until its standard input ends, so that it cannot outlive this process.
                self._holders[name] = subprocess.Popen(["unshare", "--net", "cat"], stdin=subprocess.PIPE,
                                                       stdout=subprocess.DEVNULL)
            self._join()
        except BaseException:
            self.close()
            raise

    def _join(self) -> None:
        deadline = time.monotonic() + 10
        own = os.readlink("/proc/self/ns/net")
        for holder in self._holders.values():
            while os.readlink(f"/proc/{holder.pid}/ns/net") == own:
                if holder.poll() is not None or time.monotonic() > deadline:
                    raise OSError("unshare --net: no network namespace")
                time.sleep(.01)
        first, second = [str(holder.pid) for holder in self._holders.values()]
        subprocess.run(["ip", "link", "add", "eth0", "netns", first, "type", "veth", "peer", "name", "eth0",
                        "netns", second], check=True)
        for number, name in enumerate(self._holders, 1):
            for words in (["link", "set", "lo", "up"], ["addr", "add", f"10.77.0.{number}/24", "dev", "eth0"],
                          ["link", "set", "eth0", "up"]):
                subprocess.run([*self.enter(name), "ip", *words], check=True)

    def enter(self, name: str) -> List[str]:
        return ["nsenter", f"--net=/proc/{self._holders[name].pid}/ns/net"]

    def close(self) -> None:
        for holder in self._holders.values():
            holder.stdin.close()
            holder.wait()

    @staticmethod
    def refusal() -> Optional[str]:
        """Why there can be none here."""
        done = subprocess.run(["unshare", "--net", "ip", "link", "add", "eth0", "type", "veth"],
                              capture_output=True, text=True)
        return None if done.returncode == 0 else f"no network namespaces: {done.stderr.strip()}"


class Reader:
    """Follows one page in a new folder, which is the home folder too."""

    def __init__(self, page: Path, home: Path, prefix: Path, lcm_url: str):
        """
        :param prefix: where treeroll is installed; the page finds it as ~/opt/treeroll
        :param lcm_url: the network of its learners and workers, unless the page sets another
        """
        self._page = page
        self._steps = steps_of(page)
        self._home = home
        (home / "opt").mkdir()
        (home / "opt/treeroll").symlink_to(prefix)
        self._environment = {
            "HOME": str(home), "LCM_DEFAULT_URL": lcm_url, "LANG": "C.UTF-8", "TERM": "xterm",
            "PATH": f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
            "PYTHONDONTWRITEBYTECODE": "1"}
        for kept in ("CCACHE_DIR", "CXXFLAGS"):
            if kept in os.environ:
                self._environment[kept] = os.environ[kept]
        self.num_commands = 0
        self.at = home  # the folder that the commands are in

    def read(self, see: Callable[[Picture, Path], None]) -> None:
        """:param see: is called at the end, with each picture and what it is made from, in the page's order"""
        names = sorted({step.host for step in self._steps if isinstance(step, Command) and step.host})
        hosts = Hosts(names) if names else None
        shells: Dict[str, Shell] = {}
        try:
            for name in names or [""]:
                shells[name] = Shell(self._home, self._environment, hosts.enter(name) if hosts else ())
            for step in self._steps:
                if isinstance(step, File):
                    (self.at / step.name).write_text(step.text)
                elif isinstance(step, Command):
                    self._run(step, shells[step.host])
            for step in self._steps:
                if isinstance(step, Picture):
                    self._see(step, see)
        finally:
            for shell in shells.values():
                shell.close()
            if hosts:
                hosts.close()

    def _run(self, command: Command, shell: Shell) -> None:
        shell.terminal.answers = [typed[1] for line in command.shown if (typed := _TYPED.match(line))]
        said = shell.run(command.text, COMMAND_LIMIT_S)
        self.num_commands += 1
        wait_until = time.monotonic() + (BEHIND_LIMIT_S if command.text.endswith("&") else 0)
        while True:
            lost = missing(command.shown, said.texts())
            if not lost or time.monotonic() > wait_until:
                break
            time.sleep(.05)
        if said.status != 0 or lost:
            raise TutorialError(self._complaint(command, said, lost))
        self.at = Path(shell.run("pwd", COMMAND_LIMIT_S).output.read_text().strip())

    def _complaint(self, command: Command, said: Said, lost: List[str]) -> str:
        text = f"{self._page}:{command.line}: {command.text}\n"
        if said.status != 0:
            text += f"exit status {said.status}\n"
        if lost:
            text += "the page shows what is not printed:\n" + "".join(f"  {line}\n" for line in lost)
        for name, part in zip(("standard output", "standard error", "terminal"), said.texts()):
            text += f"--- {name}\n{part}\n"
        return text

    def _see(self, picture: Picture, see: Callable[[Picture, Path], None]) -> None:
        source = self.at / picture.source
        if not source.exists():
            raise TutorialError(f"{self._page}:{picture.line}: {picture.source}: no command of the page makes it")
        see(picture, source)
