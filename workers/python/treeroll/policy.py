"""Policies, by libtreeroll_policy: the same bits as everywhere else in treeroll."""

from __future__ import annotations

import ctypes
import json
import os
from pathlib import Path
from typing import Any, Mapping, Optional, Sequence, Union

_LIBRARY = "libtreeroll_policy.so.0"


class PolicyError(ValueError):
    """A text that is no policy, or numbers that a policy does not take; says which rule."""


def _find_library() -> ctypes.CDLL:
    """TREEROLL_POLICY_LIBRARY names it; else it lies in the lib folder that this package is
    installed below, or where the system looks."""
    named = os.environ.get("TREEROLL_POLICY_LIBRARY")
    if named:
        return ctypes.CDLL(named)
    for folder in Path(__file__).resolve().parents[1:5]:
        for found in (*folder.glob(_LIBRARY), *folder.glob("*/" + _LIBRARY)):
            return ctypes.CDLL(str(found))
    return ctypes.CDLL(_LIBRARY)


def _load() -> ctypes.CDLL:
    library = _find_library()
    policy, size = ctypes.c_void_p, ctypes.c_size_t
    numbers = ctypes.POINTER(ctypes.c_double)
    for name, result, arguments in (
            ("last_error", ctypes.c_char_p, []),
            ("version", ctypes.c_char_p, []),
            ("load", policy, [ctypes.c_char_p]),
            ("free", None, [policy]),
            ("input_dim", size, [policy]),
            ("output_dim", size, [policy]),
            ("theta_dim", size, [policy]),
            ("input_name", ctypes.c_char_p, [policy, size]),
            ("output_name", ctypes.c_char_p, [policy, size]),
            ("get_theta", ctypes.c_int, [policy, numbers, size]),
            ("set_theta", ctypes.c_int, [policy, numbers, size]),
            ("start", ctypes.c_int, [policy]),
            ("act", ctypes.c_int, [policy, numbers, size, numbers, size]),
            ("text", size, [policy, ctypes.c_char_p, size])):
        function = getattr(library, "treeroll_policy_" + name)
        function.restype, function.argtypes = result, arguments
    return library


_library: Any = None


def _lib() -> Any:
    # Not when the package is imported: a Watcher needs no library.
    global _library
    if _library is None:
        _library = _load()
    return _library


class Policy:
    """What a task drives its plant with. Not to be shared between threads. A copy (``copy``, ``pickle``)
    is a policy of its own, which knows of no roll-out before :meth:`start`.

    :param text: a policy as JSON: the contents of a policy file, or what :class:`BestPolicy` holds;
        a ``dict`` is taken for the parsed JSON.
    :raises PolicyError: if it is none.
    """

    def __init__(self, text: Union[str, bytes, dict]):
        self._handle = None
        if isinstance(text, dict):
            text = json.dumps(text)
        if isinstance(text, str):
            text = text.encode()
        if b"\0" in text:
            raise PolicyError("a policy's text has no NUL character")
        self._handle = _lib().treeroll_policy_load(text)
        if not self._handle:
            raise PolicyError(_lib().treeroll_policy_last_error().decode("utf-8", "replace"))
        self._named: Optional[tuple[list[str], list[str]]] = None  # once asked for
        self._input = (ctypes.c_double * self.input_dim)()
        self._output = (ctypes.c_double * self.output_dim)()

    @classmethod
    def load(cls, path: Union[str, os.PathLike]) -> "Policy":
        """The policy of a policy file, such as ``policies/tree-0.json`` of a study."""
        return cls(Path(path).read_bytes())

    def __reduce__(self):
        # Each has a handle of its own: what is freed twice crashes the process.
        return type(self), (self.text,)

    def __del__(self):
        if self._handle and _library:  # none at the interpreter's end
            _library.treeroll_policy_free(self._handle)

    @property
    def input_dim(self) -> int:
        """How many numbers it acts on."""
        return _lib().treeroll_policy_input_dim(self._handle)

    @property
    def output_dim(self) -> int:
        """How many numbers it gives."""
        return _lib().treeroll_policy_output_dim(self._handle)

    @property
    def theta_dim(self) -> int:
        """How many numbers are learnt."""
        return _lib().treeroll_policy_theta_dim(self._handle)

    @property
    def input_names(self) -> list[str]:
        """What the task calls its inputs, the unit last, ``input_dim`` names; none if the policy's text
        has none."""
        return self._names(_lib().treeroll_policy_input_name, self.input_dim)

    @property
    def output_names(self) -> list[str]:
        """The same of its outputs."""
        return self._names(_lib().treeroll_policy_output_name, self.output_dim)

    def _names(self, name_at: Any, dim: int) -> list[str]:
        names = [name_at(self._handle, i).decode() for i in range(dim)]
        return [] if "" in names else names

    @property
    def theta(self) -> list[float]:
        """The numbers that are learnt, theta_dim of them. Setting them makes another policy of it;
        a theta so extreme that there is none leaves it as it was and raises PolicyError."""
        numbers = (ctypes.c_double * self.theta_dim)()
        self._check(_lib().treeroll_policy_get_theta(self._handle, numbers, len(numbers)))
        return list(numbers)

    @theta.setter
    def theta(self, theta: Sequence[float]) -> None:
        numbers = (ctypes.c_double * len(theta))(*theta)
        self._check(_lib().treeroll_policy_set_theta(self._handle, numbers, len(numbers)))

    def start(self) -> None:
        """To be called before each roll-out: a policy with a state of its own begins anew."""
        self._check(_lib().treeroll_policy_start(self._handle))

    def act(self, input: Sequence[float]) -> list[float]:
        """What the policy gives, in the units of its task.

        :param input: ``input_dim`` finite numbers; a list, a tuple or an array
        :return: ``output_dim`` finite numbers
        """
        if len(input) != len(self._input):
            raise PolicyError(f"input has {len(input)} numbers, must have {len(self._input)}")
        self._input[:] = input
        self._check(_lib().treeroll_policy_act(self._handle, self._input, len(self._input),
                                               self._output, len(self._output)))
        return self._output[:]

    def act_named(self, inputs: Mapping[str, float]) -> dict[str, float]:
        """The same by name, so that none takes the place of another::

            command = policy.act_named({"angle_rad": q, "rate_radps": dq})["torque_nm"]

        :param inputs: a finite number for each of ``input_names``, and nothing else
        :return: a number for each of ``output_names``
        :raises PolicyError: also if the policy's text names no signals
        """
        if self._named is None:
            self._named = self.input_names, self.output_names
        names, outputs = self._named
        if not names:
            raise PolicyError("this policy's text names no inputs and outputs: use act()")
        if inputs.keys() != set(names):
            raise PolicyError(f"inputs are {', '.join(sorted(map(str, inputs)))}, must be "
                              f"{', '.join(names)}")
        return dict(zip(outputs, self.act([inputs[name] for name in names])))

    def __call__(self, input: float) -> float:
        """The same for one input and one output: ``acceleration_mps2 = policy(time_s)``."""
        if len(self._output) != 1:
            raise PolicyError(f"this policy has {len(self._output)} outputs: use act()")
        return self.act((input,))[0]

    @property
    def text(self) -> str:
        """The policy as JSON, with its theta: what a policy file holds."""
        size = _lib().treeroll_policy_text(self._handle, None, 0)
        text = ctypes.create_string_buffer(size)
        _lib().treeroll_policy_text(self._handle, text, size)
        return text.value.decode()

    @staticmethod
    def _check(status: int) -> None:
        if status != 0:
            raise PolicyError(_lib().treeroll_policy_last_error().decode("utf-8", "replace"))
