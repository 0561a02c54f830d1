"""What a task is."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Optional, Sequence

from .settings import plain

if TYPE_CHECKING:
    from .policy import Policy
    from .settings import Settings


@dataclasses.dataclass(frozen=True)
class Description:
    """What a task says of itself before any roll-out."""

    input_dim: int
    """numbers a policy acts on: 1 for a policy of time, more for a state"""
    output_dim: int
    """numbers a policy gives"""
    time_limit_s: float
    """processor time after which an evaluation hangs, s; of one that sleeps or waits, 1.5 to 2 times
    as much time on the clock"""
    reward_min: float = 0.0
    """rewards are finite and from reward_min, not negative, to reward_max; more is better"""
    reward_max: float = 1.0
    deterministic: bool = True
    """the same policy gives the same reward, to the bit, whatever the seed"""
    repeatable: bool = True
    """the same roll-out may run twice at once; False for what moves a real robot: it is neither tried beforehand nor
    ended for a learner that is gone"""
    version: str = ""
    """of the task's code; to be changed whenever rewards change"""
    inputs: Sequence[str] = ()
    """what the task calls them, the unit last: ``["time_s"]``. Learnt policies carry the names, figures
    show them, and :meth:`Policy.act_named` goes by them. Both lists, or none."""
    outputs: Sequence[str] = ()
    """the same of what a policy gives: ``["cart_acceleration_mps2"]``"""


@dataclasses.dataclass(frozen=True)
class Trial:
    """Which roll-out it is, as ``rollouts.csv`` and ``treeroll-replay`` count them."""

    run: int = 0
    rollout: int = 0
    """negative: an evaluation of the start policy, -2, or of the final one"""

    def __str__(self) -> str:
        if self.rollout >= 0:
            return f"run {self.run}, roll-out {self.rollout}"
        return f"run {self.run}, the {'start' if self.rollout == -2 else 'final'} policy"


class Failed(Exception):
    """Raised by ``evaluate``: this policy cannot be evaluated, and its reward is 0. Says why."""


class Discarded(Exception):
    """Raised by ``evaluate``: the trial says nothing of the policy (an operator has stopped it). It is
    made again with another seed. Says why."""


class Task:
    """A task of one's own derives from this. One instance lives in each evaluator process, is made
    once for some settings and is asked again and again, from one thread."""

    name: Optional[str] = None
    """as ``[task] name`` of a study has it; None: that of the class in lower case"""
    trace_inputs: Sequence[str] = ()
    """columns that record() is given and that are the policy's inputs, in its order"""
    trace_outputs: Sequence[str] = ()
    """columns that are its outputs"""

    terms: dict[str, float]
    """what the reward of this roll-out is made of, by name, for people; empty before each"""
    trial: Trial = Trial()
    """which one this is, for people: a reward goes by the policy and the seed"""

    def __init__(self, settings: "Settings"):
        """Reads the settings: ``self.goal_m = settings.number("goal_m", 0.5)``."""

    def describe(self) -> Description:
        """What the task is."""
        raise NotImplementedError

    def evaluate(self, policy: "Policy", seed: int) -> float:
        """Executes the policy once.

        :param policy: with the dimensions of the description, started
        :param seed: what a task that is not deterministic draws its random numbers from: an integer from
            0 to 2**64 - 1, which ``numpy.random.default_rng(seed)`` takes
        :return: the reward
        :raises Failed: or any other exception: reward 0, with the reason
        :raises Discarded: to be tried again
        """
        raise NotImplementedError

    def record(self, pose: Optional[Sequence[Sequence[float]]] = None, **columns: float) -> None:
        """Of one instant, what is to be shown: ``self.record(time_s=t, angle_rad=q)``. Each call has
        the same columns, the unit last in their names; the first is what the others are drawn over.
        Learning asks for no trace, and then this does nothing.

        :param pose: what would be seen, lines ``[x, y, x, y, ...]`` in m, y upwards
        """
        if self._trace is not None:
            self._trace.add(pose, columns)

    _trace: Optional["_Trace"] = None


class _Trace:
    def __init__(self):
        self.columns: list[str] = []
        self.rows: list[list[Any]] = []
        self.poses: list[Any] = []

    def add(self, pose: Optional[Sequence[Sequence[float]]], columns: dict[str, float]) -> None:
        if not self.columns:
            self.columns = list(columns)
        if list(columns) != self.columns:
            raise ValueError(f"record() had the columns {self.columns} before, not {list(columns)}")
        self.rows.append([_number(x) for x in columns.values()])
        if pose is not None:
            self.poses.append([[_number(x) for x in line] for line in pose])
        if self.poses and len(self.poses) != len(self.rows):
            raise ValueError("every record() has a pose, or none has")

    def said(self, task: Task) -> dict:
        said: dict[str, Any] = {"columns": self.columns, "rows": self.rows}
        if len(task.trace_inputs):
            said["policy_inputs"] = plain(task.trace_inputs)
        if len(task.trace_outputs):
            said["policy_outputs"] = plain(task.trace_outputs)
        if self.poses:
            said["poses"] = self.poses
        return said


def _number(x: float) -> Optional[float]:
    # JSON has no word for what is not finite.
    x = float(x)
    return x if math.isfinite(x) else None
