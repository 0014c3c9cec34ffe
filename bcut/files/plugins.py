"""A user's own Python file as a module: what separators and objectives have in common."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from bcut.errors import BcutError, InputError

Result = TypeVar("Result")


def import_file(
    path: Path, kind: str, refuse: type[InputError], run: Callable[[Callable[[], None]], None]
) -> ModuleType:
    """Import a file that a user wrote.

    Parameters
    ----------
    path : Path
    kind : str
        "separator" or "objective": for messages, and for the name of the module.
    refuse : type of InputError
        What is raised where there is no such file.
    run : callable
        Carries out the file's own code; see `guarded`.

    Raises
    ------
    InputError
        Of the class `refuse`: there is no such file, or Python cannot import it.
    """
    if not path.is_file():
        raise refuse(f"{kind} file {path}: there is no such file")
    if path.suffix != ".py":
        raise refuse(f"{kind} file {path}: not a Python file; its name must end in .py")
    name = f"bcut_user_{kind}_{abs(hash(path.resolve()))}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise refuse(f"{kind} file {path}: Python cannot import it")
    module = importlib.util.module_from_spec(spec)
    loader = spec.loader
    sys.modules[name] = module  # dataclasses and pickling look their module up
    run(lambda: loader.exec_module(module))
    return module


def guarded(
    action: Callable[[], Result], error: Callable[[str, str, str], BcutError], source: str, what: str
) -> Result:
    """Run a plug-in's own code; what it raises becomes an error that names it and has its traceback.

    Parameters
    ----------
    action : callable
    error : callable
        Makes the error of its source, message and traceback.
    source : str
        The plug-in, as the user wrote it.
    what : str
        What was done with it, such as ``"loading it"``.
    """
    try:
        return action()
    except (Exception, SystemExit) as raised:  # a script that is no plug-in may well call sys.exit()
        trace = "".join(traceback.format_exception(raised))
        raise error(source, f"{what} raised {type(raised).__name__}: {raised}", trace) from raised
