"""Tasks that a person watches: a robot moves only when the operator says so, and a trial counts only
if the operator accepts it."""

from __future__ import annotations

import dataclasses
import fcntl
import functools
import math
import os
import select
import termios
import time
from pathlib import Path
from typing import Optional, Type

from .policy import Policy
from .program import name_of
from .settings import Refused, Settings
from .task import Description, Discarded, Failed, Task

TERMINAL_VARIABLE = "TREEROLL_OPERATOR_TERMINAL"
_TIME_LIMIT_MOST_S = 86400.0
_PATIENCE_S = 3600.0
# A learner asks again, without a limit, what is void for this reason: EVALUATOR.md, rule 13.
_NOBODY_ANSWERED = "nobody answered"
# What a worker takes of terms: EVALUATOR.md.
_TERMS_MAX = 64
_TERM_NAME_BYTES_MAX = 64


def with_operator(task: Type[Task], patience_s: float = _PATIENCE_S) -> Type[Task]:
    """The task with an operator at the terminal that the worker was started in::

        treeroll.run(treeroll.with_operator(Reach))

    Before each trial the operator is asked whether to begin, and after it whether it counts:

    - ``Enter`` begins; ``a`` accepts what came of it, a failure too;
    - ``r`` rejects it: it is void and costs no budget, and the same policy is tried again, at most
      ``study.discards_max`` times;
    - ``p`` pauses until the next ``Enter``. Whoever says nothing pauses as well. A trial that nobody has begun
      is asked for again, for days if need be.

    Several evaluators of one terminal take turns. Without the terminal nothing moves. Another one
    than the worker's is named by the environment: ``TREEROLL_OPERATOR_TERMINAL=/dev/pts/3``.

    :param patience_s: how long a trial may wait to begin, and how long to be accepted; at most a day
        in all. One that has waited so long to begin is void, and asked for again. One that has moved and
        waits longer hangs, as any roll-out past its limit. More than an hour makes another task of it for a
        study that has begun
    """

    class WithOperator(task):  # type: ignore[misc, valid-type]
        name = name_of(task)
        __doc__ = task.__doc__

        def __init__(self, settings: Settings):
            super().__init__(settings)
            self._desk = _Desk()

        def describe(self) -> Description:
            said = super().describe()
            # Once before the trial and once after it: a robot is not stopped in the midst of one.
            self._patience_s = min(patience_s, (_TIME_LIMIT_MOST_S - said.time_limit_s) / 2)
            # A person's comfort up to an hour: a study is resumed with more or less of it.
            waiting_s = 2 * max(self._patience_s, _PATIENCE_S)
            self._rewards = said.reward_min, said.reward_max
            return dataclasses.replace(said, deterministic=False, repeatable=False,
                                       time_limit_s=min(said.time_limit_s + waiting_s, _TIME_LIMIT_MOST_S))

        def evaluate(self, policy: Policy, seed: int) -> float:
            # Waiting for the terminal counts too. So a trial that begins has its time before it.
            begin_until = time.monotonic() + self._patience_s
            with self._desk as desk:
                desk.ask(f"{self.name}, {self.trial}, seed {seed}: Enter begins, r rejects, p pauses", "",
                         until=begin_until)
                try:
                    reward = float(super().evaluate(policy, seed))
                    words = self._in_words(reward)
                except (Discarded, MemoryError):
                    raise
                except Exception as error:  # of the task, of the robot, of the policy's bounds
                    what = str(error) or type(error).__name__
                    desk.ask(f"failed: {what}. a accepts that, r tries again, p pauses", "a")
                    raise
                desk.ask(f"{words}. a accepts, r tries again, p pauses", "a")
                return reward

        def _in_words(self, reward: float) -> str:
            """What a worker would not take fails here, where the operator sees it and may try again."""
            least, most = self._rewards
            if not math.isfinite(reward):
                raise Failed(f"the reward is {reward}")
            if not least <= reward <= most:
                raise Failed(f"the reward {reward} is outside its range {least} .. {most}")
            self.terms = {str(name): float(x) for name, x in self.terms.items()}
            if (len(self.terms) > _TERMS_MAX
                    or not all(1 <= len(name.encode()) <= _TERM_NAME_BYTES_MAX for name in self.terms)):
                raise Failed(f"terms must be at most {_TERMS_MAX}, with names of 1 to {_TERM_NAME_BYTES_MAX} bytes")
            return f"reward {reward:.4g}" + "".join(f", {name} {x:.4g}" for name, x in self.terms.items())

    WithOperator.__name__ = task.__name__
    return WithOperator


class _Desk:
    """The operator's terminal. Who has entered it has it alone."""

    def __init__(self) -> None:
        self._path = os.environ.get(TERMINAL_VARIABLE) or _own_terminal()
        if self._path is None:
            raise Refused("name", "needs a terminal for its operator: start the worker in one, or "
                                  f"name one, {TERMINAL_VARIABLE}=/dev/pts/N")
        self._terminal: Optional[int] = None
        self._until = math.inf
        _leave_job_control()
        os.close(self._opened())  # what cannot be opened is told now, not at the first trial

    def __enter__(self) -> "_Desk":
        self._terminal = self._opened()
        fcntl.flock(self._terminal, fcntl.LOCK_EX)
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def ask(self, question: str, answer: str, until: float = math.inf) -> None:
        """Returns at this answer. Raises Discarded where the operator rejects, or has not given it
        by then on the monotonic clock."""
        self._until = until
        asked = question
        while True:
            said = self._line(f"treeroll: {asked} > ")
            asked = question
            if said is None:
                self._wait_for_terminal()
            elif said == "r":
                raise Discarded("operator")
            elif said == answer:
                return
            elif said == "p":
                asked = "paused. Enter goes on"
                while self._line(f"treeroll: {asked} > ") not in ("", None):
                    pass
                asked = question

    def _line(self, prompt: str) -> Optional[str]:
        """What the operator types; None if the terminal is gone."""
        typed = b""
        try:
            # What was typed before the question is no answer to it: a robot might move.
            termios.tcflush(self._terminal, termios.TCIFLUSH)
            os.write(self._terminal, prompt.encode("utf-8", "replace"))
            while not typed.endswith(b"\n"):
                left_s = None if self._until == math.inf else max(self._until - time.monotonic(), 0)
                if not select.select([self._terminal], [], [], left_s)[0]:
                    raise Discarded(_NOBODY_ANSWERED)
                part = os.read(self._terminal, 4096)
                if not part:
                    return None
                typed += part
        except (OSError, termios.error):
            return None
        return typed.decode("utf-8", "replace").strip().lower()

    def _wait_for_terminal(self) -> None:
        self._close()
        while self._terminal is None:
            if time.monotonic() > self._until:
                raise Discarded(_NOBODY_ANSWERED + ": the operator's terminal is gone")
            time.sleep(1)
            try:
                self.__enter__()
            except Refused:
                self._close()

    def _opened(self) -> int:
        try:
            terminal = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_CLOEXEC)
        except OSError as error:
            raise Refused("name", f"cannot open the operator's terminal {self._path}: "
                                  f"{error.strerror}") from error
        if not os.isatty(terminal):
            os.close(terminal)
            raise Refused("name", f"{self._path} must be a terminal")
        return terminal

    def _close(self) -> None:
        if self._terminal is not None:
            os.close(self._terminal)
            self._terminal = None


@functools.lru_cache(maxsize=None)
def _own_terminal() -> Optional[str]:
    """The path of the terminal this process was started in. /dev/tty is none that outlives
    _leave_job_control(), after which a process has none: so it is found once, whatever tasks come."""
    number = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[4])
    device = os.makedev((number >> 8) & 0xFFF, (number & 0xFF) | ((number >> 12) & 0xFFF00))
    for path in (*Path("/dev/pts").glob("*"), *Path("/dev").glob("tty*")):
        try:
            if number and path.stat().st_rdev == device:
                return str(path)
        except FileNotFoundError:
            continue  # another terminal that has just ended
    return None


def _leave_job_control() -> None:
    """A worker that a learner has started is no foreground job: reading its terminal would stop it.
    In a session of its own a process reads what it has opened."""
    try:
        os.setsid()
    except PermissionError:
        pass  # it leads a group, so it is a job of its own, started by hand
