"""Makes tasks a program that a worker runs: the lines of EVALUATOR.md."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import signal
import sys
import threading
import traceback
from typing import IO, Any, Callable, Optional, Type

from .policy import Policy
from .settings import Refused, Settings, plain
from .task import Description, Discarded, Failed, Task, Trial, _number, _Trace


def run(*tasks: Type[Task]) -> None:
    """Answers a worker until it has no more to ask: the last line of a task's file.

    Whatever the task, or a library below it, prints goes to standard error, and so to the worker's
    log; it reads nothing on standard input.

    A worker ends the program by SIGTERM, when a study is done too, and sends SIGKILL 2 s later. Here SIGTERM
    raises SystemExit, also out of this function. So ``finally:``, ``with`` and ``atexit`` of a driver stop its
    motors, whether it was opened in a task or around ``run()``. What merely follows ``run()`` is not
    reached. A handler of one's own that is set before is left alone. Outside of the main thread, where
    Python lets nobody set one, SIGTERM ends the program at once.

    :param tasks: classes; a study chooses among them by their names
    """
    questions = os.fdopen(os.dup(0), "rb")
    # Open to the last: a worker that sees it closed waits half a second for the end, no longer.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n", closefd=False)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _stop)
    converse(questions, answers, tasks)


def _stop(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once: what stops motors is not stopped
    # By this status a worker knows whose fault the end was: nobody's.
    raise SystemExit(128 + signal.SIGTERM)


def converse(questions: IO[bytes], answers: IO[str], tasks: tuple[Type[Task], ...]) -> None:
    """The same on any two streams."""
    program = _Program(tasks)
    for line in questions:
        request = json.loads(line)
        if "describe" in request:
            said = program.describe(request["describe"])
        elif "evaluate" in request:
            said = program.evaluate(request["evaluate"])
        else:
            said = {"refused": "this program knows describe and evaluate"}
        answers.write(json.dumps(said, allow_nan=False) + "\n")
        answers.flush()


def name_of(task: Type[Task]) -> str:
    """As a study calls it."""
    return task.name or task.__name__.lower()


def plain_fields(description: Description) -> dict[str, Any]:
    """As JSON takes them; what it does not take is named."""
    fields = {name: plain(x) for name, x in dataclasses.asdict(description).items()}
    for name, x in fields.items():
        try:
            json.dumps(x, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ValueError(f"its description has {name} = {x!r}: {error}") from error
    return fields


class _Program:
    def __init__(self, tasks: tuple[Type[Task], ...]):
        self._classes = {name_of(task): task for task in tasks}
        if len(self._classes) != len(tasks) or not tasks:
            raise ValueError("run() needs tasks, each with a name of its own")
        self._task: Optional[Task] = None

    def describe(self, asked: dict) -> dict:
        self._task = None
        try:
            if asked["name"] not in self._classes:
                raise Refused("name", "must be a task of this program: " + ", ".join(self._classes))
            settings = Settings(asked["settings"])
            task = self._classes[asked["name"]](settings)
            said: dict[str, Any] = plain_fields(task.describe())
            if said["repeatable"]:
                del said["repeatable"]
            for key in ("version", "inputs", "outputs"):
                if not said[key]:
                    del said[key]
            said["settings"] = settings.finish()
            self._task = task
            return said
        except Refused as error:
            return {"refused": str(error)}
        except MemoryError:
            raise  # a want of this host, not of the task
        except Exception as error:  # whatever a task raises
            traceback.print_exc()
            return {"refused": "the task cannot be made: " + in_words(error)}

    def evaluate(self, asked: dict) -> dict:
        task = self._task
        if task is None:
            return {"failed": "no task has been described"}
        task.terms = {}
        task.trial = Trial(asked["run"], asked["rollout"])
        task._trace = _Trace() if asked.get("trace") else None
        return self._outcome(lambda: self._said(task, asked))

    @classmethod
    def _said(cls, task: Task, asked: dict) -> dict:
        said: dict[str, Any] = {"reward": cls._reward(task, asked)}
        if task.terms:
            said["terms"] = {str(name): _number(x) for name, x in task.terms.items()}
        if task._trace is not None and task._trace.rows:
            said["trace"] = task._trace.said(task)
        return said

    @staticmethod
    def _reward(task: Task, asked: dict) -> float:
        policy = Policy(asked["policy"])
        policy.start()
        reward = float(task.evaluate(policy, asked["seed"]))
        if not math.isfinite(reward):
            raise Failed(f"the reward is {reward}")
        return reward

    @staticmethod
    def _outcome(said: Callable[[], dict]) -> dict:
        try:
            return said()
        except Discarded as error:
            return {"discarded": str(error)}
        except Failed as error:
            return {"failed": str(error)}
        except MemoryError:
            raise  # a want of this host, not of the policy: the process ends, and another tries
        except Exception as error:  # whatever a task raises
            traceback.print_exc()
            return {"failed": in_words(error)}


def in_words(error: BaseException) -> str:
    """What was raised and where: ``ZeroDivisionError: division by zero (reach.py, line 12)``."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({os.path.basename(where.filename)}, line {where.lineno})"
