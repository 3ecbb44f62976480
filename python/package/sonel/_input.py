"""What users give, as the numbers and objects that it stands for; or an `Error` that names the argument and says what is right."""

from __future__ import annotations

import inspect
import json
import os
import re
import shlex
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ._sonel import Error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_Kind = TypeVar("_Kind")

# The largest seed.
SEED = 2**64 - 1
# Longest time of a run that states none [s].
USUAL_TIME = 600.0


def shown(value: Any) -> str:
    """A value as messages have it."""
    return cut(repr(value))


def cut(text: str) -> str:
    """Without the middle of a long text."""
    return text if len(text) <= 240 else f"{text[:160]} … {text[-60:]}"


def in_python(text: str) -> str:
    """A message in which functions of this package stand for commands of the programs."""
    for command, function in (("`sonel-trace materials WORD`", "sonel.library()"), ("sonel-trace check", "sonel.check")):
        text = text.replace(command, function)
    return re.sub(r"sonel-trace SCENE\.toml -o .*", _call, text)


def _call(command: re.Match[str]) -> str:
    """`sonel-trace SCENE.toml -o FILE --for NAME=VALUES …` as a call of `sonel.trace`."""
    arguments, variants = ["scene"], {}
    try:
        words = shlex.split(command.group())[4:]
        for option, value in zip(words[::2], words[1::2]):
            if option == "--for":
                name, _, values = value.rpartition("=")
                numbers = re.findall(r"\[[^]]*\]|[^,]+", values)
                variants[name] = [json.loads(number) for number in numbers]
            elif option == "--extend":
                arguments.append("extend=map")
            else:
                arguments.append(f"{option[2:]}={value if value[0].isdigit() else repr(value)}")
    except ValueError:
        # The middle of a long line is left out.
        return command.group()
    return f"sonel.trace({', '.join([*arguments, *([f'variants={variants}'] if variants else [])])})"


def usable_memory() -> float | None:
    """Three quarters of the memory of this machine [bytes]; None where the system does not say it."""
    try:
        return 0.75 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None


def whole(value: Any, name: str, low: int = 0, high: int | None = None, unit: str = "") -> int:
    """A whole number, also of numpy or as a float."""
    is_whole = isinstance(value, (int, np.integer)) or (isinstance(value, (float, np.floating)) and float(value).is_integer())
    if isinstance(value, bool) or not is_whole or not low <= value <= (np.inf if high is None else high):
        allowed = f"of at least {low}{unit}" if high is None else f"from {low} to {high}{unit}"
        raise Error(f"{name} is {shown(value)}: give a whole number {allowed}")
    return int(value)


def numbers(value: ArrayLike, name: str, right: str, shape: tuple[int, ...] | None = None) -> NDArray[np.float64]:
    """Finite numbers, of a `shape` where one is given; `right` says what they should be."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        found = np.full((), np.nan)
    if not np.all(np.isfinite(found)) or shape not in (None, found.shape):
        raise Error(f"{name} is {shown(value)}: give {right}")
    return found


def span(value: ArrayLike, name: str, right: str) -> tuple[float, float]:
    """Two numbers, the smaller one first."""
    low, high = numbers(value, name, right, (2,))
    if low > high:
        raise Error(f"{name} is {shown(value)}: give {right}")
    return float(low), float(high)


def counts(value: ArrayLike, name: str, right: str, most: int) -> tuple[int, int]:
    """Two whole numbers of at most `most`, the smaller one first."""
    low, high = span(value, name, right)
    return whole(low, name, 0, most), whole(high, name, 0, most)


def of_kind(value: Any, kind: type[_Kind], name: str, right: str) -> _Kind:
    """An object of a class."""
    if not isinstance(value, kind):
        raise Error(f"{name} is {shown(value)}: give {right}")
    return value


def check_keywords(given: Iterable[str], function: Callable[..., Any], name: str, taken: set[str]) -> None:
    """Refuses what is not a keyword argument of a function, or is `taken`."""
    known = [key for key, kind in inspect.signature(function).parameters.items() if kind.default is not kind.empty and key not in taken]
    for key in given:
        if key not in known:
            raise Error(f"{name} has no option {shown(key)}: give those of {', '.join(known)}")


def output(path: str, name: str, is_earlier: Callable[[bytes], bool], source: str | os.PathLike[str] | None = None) -> str:
    """A path that may be written: where a file is, it is an earlier one of its kind or empty, and not the `source`."""
    if not os.path.lexists(path):
        return path
    if source is not None and os.path.exists(source) and os.path.samefile(path, source):
        raise Error(f"{path} is an input of this object: choose another output")
    if not os.path.isfile(path):
        raise Error(f"{path} is not a regular file: choose another output")
    with open(path, "rb") as file:
        begin = file.read(64)
    if begin and not is_earlier(begin):
        raise Error(f"{path} exists and is not {name}: delete it first, or choose another output")
    return path
