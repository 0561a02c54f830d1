"""Settings of a task, read strictly: a key nobody asks for is refused, as is a value of a wrong kind."""

from __future__ import annotations

import math
from typing import Any, Optional, Sequence


class Refused(ValueError):
    """A setting that a task does not take.

    :param key: its name, as ``[task]`` of the study has it
    :param rule: what would be right: ``"must be positive"``
    """

    def __init__(self, key: str, rule: str):
        super().__init__(f"{key}: {rule}")
        self.key = key
        self.rule = rule


def plain(value: Any) -> Any:
    """A number or an array of numpy's as Python has it, also within a list: JSON knows no other."""
    if isinstance(value, (list, tuple)):
        return [plain(x) for x in value]
    return value.tolist() if hasattr(value, "tolist") else value


class Settings:
    """The ``[task]`` table of a study without its name. What is read, defaults included, is the
    study's from then on, so that it can be repeated after a default has changed.

    A setting without a default is required.
    """

    def __init__(self, given: dict):
        self._given = given
        self._resolved: dict[str, Any] = {}

    def number(self, key: str, default: Optional[float] = None, *, least: float = -math.inf,
               most: float = math.inf, above: float = -math.inf) -> float:
        """A finite number from ``least`` to ``most`` and greater than ``above``."""
        value = self._get(key, default)
        rule = "must be a finite number"
        if least > -math.inf:
            rule += f", at least {least:g}"
        if above > -math.inf:
            rule += f", greater than {above:g}"
        if most < math.inf:
            rule += f", at most {most:g}"
        if (isinstance(value, bool) or not isinstance(value, (int, float))
                or not math.isfinite(value) or not least <= value <= most or value <= above):
            raise Refused(key, rule)
        return self._keep(key, value)

    def integer(self, key: str, default: Optional[int] = None, *, least: int = -(2**63),
                most: int = 2**63 - 1) -> int:
        """An integer from ``least`` to ``most``."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise Refused(key, f"must be an integer from {least} to {most}")
        return self._keep(key, value)

    def boolean(self, key: str, default: Optional[bool] = None) -> bool:
        """True or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise Refused(key, "must be true or false")
        return self._keep(key, value)

    def string(self, key: str, default: Optional[str] = None, *,
               words: Optional[Sequence[str]] = None) -> str:
        """A text; one of ``words``, if they are given."""
        value = self._get(key, default)
        if not isinstance(value, str) or (words is not None and value not in words):
            raise Refused(key, "must be a text" if words is None else "must be one of " + ", ".join(words))
        return self._keep(key, value)

    def numbers(self, key: str, default: Optional[Sequence[float]] = None, *,
                size: Optional[int] = None) -> list[float]:
        """A list of finite numbers; ``size`` of them, if it is given."""
        value = self._get(key, list(default) if default is not None else None)
        good = isinstance(value, list) and all(
            isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x)
            for x in value) and (size is None or len(value) == size)
        if not good:
            raise Refused(key, f"must be a list of {'' if size is None else f'{size} '}finite numbers")
        return self._keep(key, value)

    def finish(self) -> dict:
        """What has been read. Raises Refused for a key that nobody has asked for; :func:`run` calls
        it after the task's ``__init__``."""
        for key in self._given:
            if key not in self._resolved:
                known = ", ".join(sorted(self._resolved)) or "none"
                raise Refused(key, "is no setting of this task; it knows " + known)
        return self._resolved

    def _get(self, key: str, default: Any) -> Any:
        if key in self._given:
            return self._given[key]
        if default is None:
            raise Refused(key, "must be given")
        return plain(default)

    def _keep(self, key: str, value: Any) -> Any:
        self._resolved[key] = value
        return value
