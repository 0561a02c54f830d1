"""LCM's event logs (lcm-logger): what was said on the network, as rows and lines."""

from __future__ import annotations

import csv
import json
import struct
from pathlib import Path
from typing import IO, Any, Iterator, NamedTuple, Optional, Union

from .lcm_types import MessageError, Types

_SYNC = 0xEDA1DA01
_HEAD = struct.Struct(">IQQII")
_CHANNEL_BYTES_MOST = 1 << 10
_DATA_BYTES_MOST = 1 << 30
_CHANNELS_MOST = 100  # that are counted one by one: a log may have any number


class LogError(ValueError):
    """A file that is no log, or is damaged: says at which byte."""


class Event(NamedTuple):
    """A message as the log holds it."""

    number: int
    time_s: float
    """since 1970, when it was written down"""
    channel: str
    data: bytes


def read_events(path: Union[str, Path]) -> Iterator[Event]:
    """The messages of a log, in its order.

    :raises LogError: at the first byte that no log has there, or where the file ends within a
        message; what came before has been given
    """
    with open(path, "rb") as file:
        at = 0
        while head := file.read(_HEAD.size):
            if len(head) < _HEAD.size:
                raise LogError(f"{path}: ends within a message, at byte {at}")
            sync, number, time_us, channel_size, data_size = _HEAD.unpack(head)
            if (sync != _SYNC or channel_size > _CHANNEL_BYTES_MOST
                    or data_size > _DATA_BYTES_MOST):
                raise LogError(f"{path}: no LCM log, or damaged, at byte {at}")
            channel, data = file.read(channel_size), file.read(data_size)
            if len(channel) < channel_size or len(data) < data_size:
                raise LogError(f"{path}: ends within a message, at byte {at}")
            at += _HEAD.size + channel_size + data_size
            yield Event(number, time_us / 1e6, channel.decode("utf-8", "replace"), data)


class Reader:
    """Messages of treeroll's types out of a log.

    :param types: theirs; others are counted in ``unknown`` by channel and left out
    """

    def __init__(self, path: Union[str, Path], types: Optional[Types] = None):
        self.unknown: dict[str, int] = {}
        self._path, self._types = path, types or Types()

    def messages(self, channel: Optional[str] = None) -> Iterator[tuple[Event, dict]]:
        """Each message with its fields by name, of one channel or of all."""
        for event in read_events(self._path):
            if channel is not None and event.channel != channel:
                continue
            try:
                kind = self._types.kind_of(event.data)
                yield event, self._types.decode(kind, event.data)
            except MessageError:
                known = event.channel in self.unknown or len(self.unknown) < _CHANNELS_MOST
                name = event.channel if known else "other channels"
                self.unknown[name] = self.unknown.get(name, 0) + 1


def write_lines(reader: Reader, channel: Optional[str], out: IO[str]) -> None:
    """A JSON object a message: time_s, channel, then its fields."""
    for event, fields in reader.messages(channel):
        line = {"time_s": event.time_s, "channel": event.channel, **_plain(fields)}
        out.write(json.dumps(line) + "\n")


def write_csv(reader: Reader, channel: str, out: IO[str]) -> None:
    """A row a message of one channel; a field that is a list stands there as JSON."""
    rows = csv.writer(out, lineterminator="\n")
    columns: Optional[list[str]] = None
    for event, fields in reader.messages(channel):
        plain = _plain(fields)
        if columns is None:
            columns = list(plain)
            rows.writerow(["time_s", *columns])
        rows.writerow([event.time_s, *(json.dumps(x) if isinstance(x, (list, dict)) else x
                                       for x in plain.values())])


def _plain(value: Any) -> Any:
    """As JSON has it: bytes in hexadecimal digits, what is not finite as a word."""
    if isinstance(value, dict):
        return {name: _plain(x) for name, x in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(x) for x in value]
    if isinstance(value, (bytes, bytearray)):
        return value.hex()
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return str(value)
    return value
