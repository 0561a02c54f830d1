"""What is signed, and what is believed: lcmtypes/PROTOCOL.md, for workers and for who watches."""

from __future__ import annotations

import hashlib
import hmac
import os
import stat
import struct
from pathlib import Path
from typing import Optional, Union

MAC_BYTES = 16
SIGNATURE_BYTES = 8 + 8 + MAC_BYTES
#: Fields of a message that nobody has signed yet.
UNSIGNED = {"key_id": 0, "signed_index": 0, "mac": bytes(MAC_BYTES)}
_WINDOW = 1024
_KEYS_MAX = 4
_FILE_BYTES_MAX = 4096
#: Learners whose messages are remembered: names cost nothing to make up for who holds a worker's key.
_LEARNERS_MAX = 1024


class KeyFileError(ValueError):
    """A key file that cannot be used, and why."""


def _hash(key: bytes, data: bytes, size: int) -> bytes:
    return hashlib.blake2b(data, key=key, digest_size=size).digest()


def announcement_key(learner: bytes) -> bytes:
    return _hash(learner, b"treeroll announcements", 32)


def announcement_id(announcements: bytes) -> int:
    return int.from_bytes(_hash(announcements, b"treeroll key", 32)[:8], "big") >> 1 | 1


def worker_key(learner: bytes, worker: int) -> bytes:
    return _hash(learner, b"treeroll worker" + struct.pack(">q", worker), 32)


def _is_credential(path: Union[str, Path], status: os.stat_result) -> bool:
    """Of a service of systemd, in a folder that is the service's alone: an access list lets it read
    what belongs to root, and shows as the group's bits."""
    folder = os.environ.get("CREDENTIALS_DIRECTORY")
    if not folder or status.st_uid != 0 or status.st_mode & 0o007:
        return False
    try:
        return os.path.samefile(Path(path).parent, folder)
    except OSError:
        return False


def _check_secret(path: Union[str, Path], status: os.stat_result) -> None:
    """The rule of the daemons."""
    if not stat.S_ISREG(status.st_mode):
        raise KeyFileError(f"{path}: must be a regular file")
    if status.st_mode & 0o077 and not _is_credential(path, status):
        raise KeyFileError(f"{path}: must be readable by its owner alone: chmod 600")
    if status.st_uid not in (os.geteuid(), 0):
        raise KeyFileError(f"{path}: must belong to the user of this process, or to root")


class KeyRing:
    """The keys of a file of ``treeroll-keygen``, newest first."""

    def __init__(self, path: Union[str, Path]):
        with open(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOCTTY | os.O_NONBLOCK), "rb") as file:
            _check_secret(path, os.fstat(file.fileno()))
            text = file.read(_FILE_BYTES_MAX + 1)
        if len(text) > _FILE_BYTES_MAX:
            raise KeyFileError(f"{path}: must have at most {_FILE_BYTES_MAX} bytes")
        self.learner_keys: list[bytes] = []
        self.worker_keys: list[tuple[int, bytes, bytes]] = []  # id, its own, that of announcements
        for number, line in enumerate(text.decode("ascii", "replace").splitlines(), 1):
            words = line.partition("#")[0].split()
            if words and not self._take(words):
                raise KeyFileError(f"{path}: line {number}: must be \"learner KEY\" or \"worker ID KEY "
                                "KEY\", as treeroll-keygen writes them")
        count = len(self.learner_keys) + len(self.worker_keys)
        if not 0 < count <= _KEYS_MAX or (self.learner_keys and self.worker_keys):
            raise KeyFileError(f"{path}: must hold 1 to {_KEYS_MAX} keys, of a learner or of a worker")
        if len({number for number, _, _ in self.worker_keys}) > 1:
            raise KeyFileError(f"{path}: holds keys of two workers: must be those of one "
                               "(--same-worker-as)")

    def _take(self, words: list[str]) -> bool:
        try:
            parts = [bytes.fromhex(word) for word in words[1:]]
        except ValueError:
            return False
        sizes = [len(part) for part in parts]
        if words[0] == "learner" and sizes == [32]:
            self.learner_keys.append(parts[0])
        elif words[0] == "worker" and sizes == [8, 32, 32] and 0 < int.from_bytes(parts[0], "big") < 2**63:
            self.worker_keys.append((int.from_bytes(parts[0], "big"), parts[1], parts[2]))
        else:
            return False
        return True

    def announcements(self) -> dict[int, bytes]:
        """By their ids."""
        keys = [announcement_key(key) for key in self.learner_keys]
        keys += [key for _, _, key in self.worker_keys]
        return {announcement_id(key): key for key in keys}

    def worker_id(self, random: int) -> int:
        """The name that a worker with this ring may take: what it shares with its key, and `random`.
        """
        if self.learner_keys:
            return random
        return self.worker_keys[0][0] >> 39 << 39 | random & (1 << 39) - 1

    def of_worker(self, worker: int) -> list[tuple[int, bytes]]:
        """Ids and keys of a worker with this ring: the first signs."""
        if self.worker_keys:
            return [(number, own) for number, own, _ in self.worker_keys]
        return [(worker, worker_key(key, worker)) for key in self.learner_keys]


class _Window:
    """Which of a sender's numbered messages have come."""

    def __init__(self, first: int):
        self._first, self._highest, self._seen = first, first - 1, 0

    @property
    def highest(self) -> int:
        return self._highest

    def take(self, index: int) -> bool:
        if index < self._first or index <= self._highest - _WINDOW:
            return False
        if index > self._highest:
            self._seen = self._seen << min(index - self._highest, _WINDOW) & ((1 << _WINDOW) - 1)
            self._highest = index
        bit = 1 << (self._highest - index)
        if self._seen & bit:
            return False
        self._seen |= bit
        return True


class Authenticator:
    """Signs what a worker says, and tells what learners say from what strangers do.

    :param keys: those of this process
    :param worker: its id; None: it only watches, and takes whatever is signed, once
    """

    def __init__(self, keys: KeyRing, worker: Optional[int] = None):
        self._worker = worker
        self._own = keys.of_worker(worker) if worker is not None else []
        self._announcements = keys.announcements()
        self._windows: dict[int, _Window] = {}
        # Of words to us: no other holder of the key of announcements can run ahead of these.
        self._words: dict[int, _Window] = {}
        self._last_index = 0

    def sign(self, channel: str, data: bytes) -> bytes:
        """:param data: an encoded message of this worker, unsigned"""
        key_id, key = self._own[0]
        self._last_index += 1
        body = data[:-SIGNATURE_BYTES] + struct.pack(">qq", key_id, self._last_index)
        return body + _hash(key, channel.encode() + b"\0" + body, MAC_BYTES)

    def is_signed(self, channel: str, data: bytes) -> bool:
        """Whether a learner has signed these bytes; to be asked before they are decoded."""
        if len(data) < 16 + SIGNATURE_BYTES:
            return False
        key_id, index = struct.unpack(">qq", data[-SIGNATURE_BYTES:-MAC_BYTES])
        key = self._announcements.get(key_id)
        if key is None or index <= 0:
            return False
        return hmac.compare_digest(
            data[-MAC_BYTES:], _hash(key, channel.encode() + b"\0" + data[:-MAC_BYTES], MAC_BYTES))

    def admit(self, channel: str, data: bytes, message: dict) -> bool:
        """Whether a signed message is to be taken: it is new, and its sender has shown that it lives.
        """
        named = {part["worker_id"] for list_of in ("rollouts", "acknowledgements")
                 for part in message.get(list_of, ())}
        learner, index = message["learner_id"], message["signed_index"]
        if self._worker is not None and learner == self._worker:
            return False  # no learner has a worker's name
        if self._worker in named:
            return (self._word_is_right(channel, data, message, sorted(named))
                    and self._admit_word(learner, index))
        if learner not in self._windows and self._worker is not None:
            return channel == "TREEROLL_LEARNER"
        return self._window_of(learner, index).take(index)

    def _window_of(self, learner: int, index: int) -> _Window:
        """Its own; a new one takes the place of that of who has been silent longest. Who has said a
        word to us stays while there are others."""
        window = self._windows.pop(learner, None) or _Window(index)
        self._windows[learner] = window  # the last one
        if len(self._windows) > _LEARNERS_MAX:
            silent = next((name for name in self._windows if name not in self._words),
                          next(iter(self._windows)))
            del self._windows[silent]
            self._words.pop(silent, None)
        return window

    def _admit_word(self, learner: int, index: int) -> bool:
        if not self._words.setdefault(learner, _Window(index)).take(index):
            return False
        if self._window_of(learner, index).highest >= index + _WINDOW:
            self._windows[learner] = _Window(index)
        self._windows[learner].take(index)
        return True

    def _word_is_right(self, channel: str, data: bytes, message: dict, named: list[int]) -> bool:
        words = message["word_macs"]
        if len(words) != len(named):
            return False
        before = len(data) - SIGNATURE_BYTES - MAC_BYTES * len(words) - 4
        digest = hashlib.blake2b(channel.encode() + b"\0" + data[:before] +
                                 struct.pack(">q", message["signed_index"]), digest_size=32).digest()
        word = words[named.index(self._worker)]
        return any(hmac.compare_digest(word, _hash(key, digest, MAC_BYTES)) for _, key in self._own)
