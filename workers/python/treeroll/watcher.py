"""What is learnt, while it is learnt: from LCM's messages, as lcm-spy sees them."""

from __future__ import annotations

import dataclasses
import hashlib
import time
from typing import Any, Iterator, Optional

from .authentication import Authenticator, KeyRing
from .lcm_bus import UdpmBus
from .lcm_types import MessageError, Types
from .policy import Policy

_KINDS = {"TREEROLL_LEARNER": "learner_status_t", "TREEROLL_RUNS": "run_status_t",
          "TREEROLL_BEST": "best_policy_t"}
_PIECE_BYTES = 1024
_GONE_S = 4.0  # a learner speaks once a second
_POLICY_BYTES_MAX = 1 << 20


@dataclasses.dataclass(frozen=True)
class BestPolicy:
    """The best policy of a run so far."""

    study: str
    condition: str
    repetition: int
    rollout: int
    """number of the roll-out that showed it"""
    reward: float
    text: str
    """the policy as JSON, what a policy file holds"""

    def policy(self) -> Policy:
        """To act with."""
        return Policy(self.text)


class Watcher:
    """Follows the learner of a study::

        with treeroll.Watcher("my_study") as watcher:
            best = watcher.wait_for_best(timeout_s=10)
            robot.execute(best.policy())

    :param study: its name; None: the first that is heard
    :param lcm_url: a udpm URL; None: LCM_DEFAULT_URL, else LCM's own, this host
    :param key_file: of ``treeroll-keygen``: only what a learner has signed is taken. Without one
        anybody on the network may have said what is heard: ``verified`` is False then.
    """

    def __init__(self, study: Optional[str] = None, lcm_url: Optional[str] = None,
                 key_file: Optional[str] = None):
        self._authenticator = Authenticator(KeyRing(key_file)) if key_file else None
        self._study = study
        self._types = Types()
        self._learner: Optional[int] = None
        self._heard = 0.0
        self._status: Optional[dict] = None
        self._runs: dict[int, dict] = {}
        self._best: dict[int, tuple[dict, str]] = {}
        # Of the incarnation before, until this one has told its own.
        self._best_before: dict[int, tuple[dict, str]] = {}
        self._pieces: dict[int, dict[str, Any]] = {}
        self._bus = UdpmBus(lcm_url, set(_KINDS))

    def __enter__(self) -> "Watcher":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Leaves the network."""
        self._bus.close()

    def poll(self, timeout_s: float = 0.0) -> bool:
        """Takes the next message of this study, waiting so long at most, and says whether there was
        one."""
        deadline = time.monotonic() + timeout_s
        while True:
            received = self._bus.receive(max(0.0, deadline - time.monotonic()))
            if received is None:
                return False
            try:
                if self._take_bytes(*received):
                    return True
            except (MessageError, UnicodeDecodeError):
                pass  # of another version, or nobody's

    @property
    def verified(self) -> bool:
        """Whether what is heard is signed with a key of ours.

        Learners sign what they say to all with a key that each worker's host has too. So a holder of any
        worker's key may have said it.
        """
        return self._authenticator is not None

    def _take_bytes(self, channel: str, data: bytes) -> bool:
        signed = self._authenticator
        if signed and not signed.is_signed(channel, data):
            return False
        message = self._types.decode(_KINDS[channel], data)
        if signed and not signed.admit(channel, data, message):
            return False
        return self._take(channel, message)

    def updates(self, silence_s: float) -> Iterator[None]:
        """After each message, until nothing has come for so long."""
        while self.poll(silence_s):
            yield

    @property
    def status(self) -> Optional[dict]:
        """The latest ``learner_status_t``, by the names of its fields; None before the first."""
        return self._status

    @property
    def runs(self) -> dict[int, dict]:
        """The latest ``run_status_t`` of each run, by its index."""
        return self._runs

    def is_done(self) -> bool:
        """Whether all runs of the study have ended and their best policies are here."""
        status = self._status
        if status is None or not status["num_runs_done"] == status["num_runs"] == len(self._runs):
            return False
        return all(run["done"] and (run["best_reward"] <= 0 or self._reward(i) == run["best_reward"])
                   for i, run in self._runs.items())

    def _reward(self, run: int) -> Optional[float]:
        return self._best[run][0]["reward"] if run in self._best else None

    def best(self, condition: Optional[str] = None) -> Optional[BestPolicy]:
        """The best policy so far, of one condition or of all; None as long as none is known."""
        found = [b for b in self.all_best() if condition in (None, b.condition)]
        return max(found, key=lambda b: b.reward, default=None)

    def all_best(self) -> list[BestPolicy]:
        """That of each run of which one is known. After a resume, what was known before stands until the
        learner has told of every run again: they take turns."""
        study = self._status["study"] if self._status else ""
        return [BestPolicy(study, m["condition"], m["repetition"], m["rollout"], m["reward"], text)
                for m, text in {**self._best_before, **self._best}.values()]

    def wait_for_best(self, timeout_s: float, condition: Optional[str] = None) -> BestPolicy:
        """The same, waiting for it. Raises TimeoutError."""
        deadline = time.monotonic() + timeout_s
        while (best := self.best(condition)) is None:
            if not self.poll(max(0.0, deadline - time.monotonic())):
                raise TimeoutError(f"no policy of {self._study or 'any study'} was heard")
        return best

    def _take(self, channel: str, message: dict) -> bool:
        learner = message["learner_id"]
        if channel == "TREEROLL_LEARNER":
            if self._study not in (None, message["study"]):
                return False
            if self._learner not in (None, learner) and time.monotonic() < self._heard + _GONE_S:
                return False  # another of the same name: the first is followed while it is there
            self._heard = time.monotonic()
            if self._learner != learner:
                # Another incarnation, after a resume: its runs tell what there is again.
                self._learner, self._study = learner, message["study"]
                self._best_before.update(self._best)
                self._runs, self._best, self._pieces = {}, {}, {}
            self._status = message
            self._forget_before()
            return True
        if learner != self._learner:
            return False
        if channel == "TREEROLL_RUNS":
            self._runs[message["run"]] = message
            self._forget_before()
            return True
        return self._take_piece(message)

    def _forget_before(self) -> None:
        """What was known before, once each run has told of itself and its best policy, if it has one."""
        status = self._status
        if not self._best_before or status is None or len(self._runs) < status["num_runs"]:
            return
        if all(run["best_reward"] <= 0 or i in self._best for i, run in self._runs.items()):
            self._best_before = {}

    def _take_piece(self, message: dict) -> bool:
        total, index = message["total_bytes"], message["index"]
        num_pieces = -(-total // _PIECE_BYTES)
        whole = _PIECE_BYTES if index < num_pieces - 1 else total - (num_pieces - 1) * _PIECE_BYTES
        if not 0 < total <= _POLICY_BYTES_MAX or not 0 <= index < num_pieces or (
                len(message["piece"]) != whole):
            return False
        name = (message["policy_id"], total)
        parts = self._pieces.get(message["run"])
        if parts is None or parts["name"] != name:
            parts = self._pieces[message["run"]] = {"name": name, "pieces": {}}
        parts["pieces"][index] = message["piece"]
        if len(parts["pieces"]) < num_pieces:
            return False
        content = b"".join(parts["pieces"][i] for i in range(num_pieces))
        if hashlib.blake2b(content, digest_size=16).digest() != message["policy_id"]:
            del self._pieces[message["run"]]
            return False
        self._best[message["run"]] = (message, content.decode())
        self._forget_before()
        return True
