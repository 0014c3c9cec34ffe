"""From what a user writes to a separator: a built-in name, a file, or an entry point, with parameters.

``clique``, ``odd-cycle:max_cuts=40,backend=networkx``, ``./my_cuts.py``, ``./my_cuts.py:MyCuts``,
``./my_cuts.py:MyCuts:depth=3``. An installed package offers separators through the entry-point group
``bcut.separators``.
"""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import inspect
import pkgutil
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from bcut.errors import SeparatorError, SeparatorLoadError
from bcut.files.plugins import guarded, import_file
from bcut.separation.seam import Separator

GROUP = "bcut.separators"

Result = TypeVar("Result")


@dataclass(frozen=True)
class Specification:
    """A separator as written by a user: where it comes from, which class, which parameters."""

    source: str
    class_name: str | None = None
    parameters: dict[str, str] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> Specification:
        """Split ``source[:Class][:name=value,...]``."""
        # A path may hold colons itself, behind a drive for one, so it ends where ".py" does.
        path = re.match(r".+?\.py(?=:|$)", text)
        source = path.group() if path else text.partition(":")[0]
        rest = text[len(source) + 1 :].split(":") if len(text) > len(source) else []
        class_name: str | None = None
        parameters: dict[str, str] = {}
        for part in rest:
            if "=" not in part:
                if class_name is not None or not part.isidentifier():
                    raise SeparatorLoadError(
                        f"separator '{text}': cannot read '{part}'; write NAME:parameter=value,... or FILE.py:Class"
                    )
                class_name = part
                continue
            for item in part.split(","):
                name, equals, value = item.partition("=")
                if not equals or not name.strip().isidentifier():
                    raise SeparatorLoadError(
                        f"separator '{text}': cannot read the parameter '{item}'; write parameter=value"
                    )
                if name.strip() in parameters:
                    raise SeparatorLoadError(f"separator '{text}': parameter '{name.strip()}' is given twice")
                parameters[name.strip()] = value.strip()
        return cls(source, class_name, parameters)

    @property
    def is_file(self) -> bool:
        """Whether the source is a path rather than a name."""
        return self.source.endswith(".py") or "/" in self.source or "\\" in self.source


def resolve(text: str) -> Separator:
    """Make the separator that a user wrote.

    Raises
    ------
    SeparatorLoadError
        If there is no such separator, the file holds none, or a parameter does not exist or does not fit.
    SeparatorError
        If the plug-in's own code raises while it is imported or constructed.
    """
    specification = Specification.parse(text)
    if specification.is_file:
        family = _class_from_file(specification)
    else:
        family = _class_by_name(specification)
    return _construct(family, specification, text)


def built_in_names() -> list[str]:
    """Return the names of the built-in families: one for each file of `bcut.separators`."""
    package = importlib.import_module("bcut.separators")
    return sorted(
        module.name.replace("_", "-")
        for module in pkgutil.iter_modules(package.__path__)
        if module.name[0] != "_"
    )


def is_built_in(text: str) -> bool:
    """Tell whether a text names a built-in family, whose cuts can be checked again."""
    specification = Specification.parse(text)
    return not specification.is_file and specification.source in built_in_names()


def available() -> dict[str, type[Separator]]:
    """Return every separator that can be called by name, built-in ones first."""
    found = {name: _built_in(name) for name in built_in_names()}
    for entry in importlib.metadata.entry_points(group=GROUP):
        found.setdefault(entry.name, _from_entry_point(entry))
    return found


def parameters_of(family: type[Separator]) -> dict[str, Any]:
    """Return the parameters of a family with their defaults."""
    signature = inspect.signature(family)
    return {
        name: None if parameter.default is inspect.Parameter.empty else parameter.default
        for name, parameter in signature.parameters.items()
        if parameter.kind in (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    }


def _class_by_name(specification: Specification) -> type[Separator]:
    name = specification.source
    if specification.class_name is not None:
        raise SeparatorLoadError(
            f"separator '{name}:{specification.class_name}': a class is chosen in a file; "
            "after a name write parameter=value,..."
        )
    if name in built_in_names():
        return _built_in(name)
    entries = importlib.metadata.entry_points(group=GROUP)
    for entry in entries:
        if entry.name == name:
            return _from_entry_point(entry)
    known = [*built_in_names(), *(entry.name for entry in entries)]
    near = difflib.get_close_matches(name, known, n=1)
    hint = (
        f"did you mean '{near[0]}'?"
        if near
        else f"known are {', '.join(known)}; a file is given by its path."
    )
    raise SeparatorLoadError(f"unknown separator '{name}': {hint}")


def _built_in(name: str) -> type[Separator]:
    module = _guarded(name, lambda: importlib.import_module(f"bcut.separators.{name.replace('-', '_')}"))
    return _only_class(module, name)


def _from_entry_point(entry: importlib.metadata.EntryPoint) -> type[Separator]:
    family = _guarded(entry.name, entry.load)
    if not (inspect.isclass(family) and issubclass(family, Separator)):
        raise SeparatorLoadError(
            f"entry point '{entry.name}' ({entry.value}) is no subclass of bcut.Separator"
        )
    return family


def _class_from_file(specification: Specification) -> type[Separator]:
    path = Path(specification.source)
    module = import_file(path, "separator", SeparatorLoadError, lambda load: _guarded(str(path), load))
    if specification.class_name is None:
        return _only_class(module, str(path))
    family = getattr(module, specification.class_name, None)
    if not (inspect.isclass(family) and issubclass(family, Separator)):
        raise SeparatorLoadError(
            f"separator file {path}: it has no class '{specification.class_name}' of bcut.Separator"
        )
    return family


def _only_class(module: ModuleType, source: str) -> type[Separator]:
    """Return the one concrete separator that a module defines."""
    families = [
        value
        for value in vars(module).values()
        if inspect.isclass(value)
        and issubclass(value, Separator)
        and value.__module__ == module.__name__
        and not inspect.isabstract(value)
    ]
    if len(families) == 1:
        return families[0]
    if not families:
        raise SeparatorLoadError(
            f"separator file {source}: it defines no separator; "
            "derive a class from bcut.Separator and give it separate()"
        )
    names = ", ".join(family.__name__ for family in families)
    raise SeparatorLoadError(f"separator file {source}: it defines {names}; say which by {source}:CLASS")


def _construct(family: type[Separator], specification: Specification, text: str) -> Separator:
    known = parameters_of(family)
    values: dict[str, Any] = {}
    for name, value in specification.parameters.items():
        if name not in known:
            listed = ", ".join(known) or "none"
            raise SeparatorLoadError(
                f"separator '{text}': no parameter '{name}'; its parameters are: {listed}"
            )
        values[name] = _convert(value, known[name], f"separator '{text}': parameter {name}")
    try:
        separator = _guarded(text, lambda: family(**values))
    except SeparatorError as error:
        # A constructor refuses a value by ValueError: the user's mistake, not the plug-in's.
        if isinstance(error.__cause__, ValueError):
            raise SeparatorLoadError(f"separator '{text}': {error.__cause__}") from error
        raise
    if not separator.name:
        raise SeparatorLoadError(
            f"separator '{text}': class {family.__name__} has no name; set `name = \"my-cuts\"`"
        )
    return separator


def _convert(text: str, default: Any, what: str) -> Any:
    """Read a parameter as the type of its default."""
    kind = type(default)
    if default is None or kind is str:
        return text
    if kind is bool:
        if text.lower() in ("true", "yes", "1", "on"):
            return True
        if text.lower() in ("false", "no", "0", "off"):
            return False
        raise SeparatorLoadError(f"{what} is true or false, not '{text}'")
    try:
        return kind(text)
    except (TypeError, ValueError):
        raise SeparatorLoadError(f"{what} is of type {kind.__name__}, not '{text}'") from None


def _guarded(source: str, action: Callable[[], Result]) -> Result:
    """Run a plug-in's own code; what it raises becomes a `SeparatorError` with its traceback."""
    return guarded(action, SeparatorError, source, "loading it")
