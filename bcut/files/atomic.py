"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from bcut.errors import InputError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`, which takes its place when the block ends without an error.

    A symbolic link stays, and the file behind it is replaced.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be written to, or the disk is full.
    """
    try:
        target = Path(os.path.realpath(path))
        temporary = _empty_file_beside(target)
        try:
            yield temporary
            # mkstemp gives owner-only permissions; a new file gets what the user's umask says.
            umask = os.umask(0)
            os.umask(umask)
            os.chmod(temporary, 0o666 & ~umask)
            os.replace(temporary, target)
        finally:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(temporary)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from None


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_new(path: Path, text: str) -> None:
    """Write a text file that does not exist yet.

    Raises
    ------
    InputError
        If it exists, or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{path}: exists already; take another name, or move the file away") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


def check_writable(path: Path) -> None:
    """Refuse a place that cannot be written to, before any work is done for it.

    Raises
    ------
    InputError
        If `path` is a folder or a device, or its folder does not exist or cannot be written to.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = os.stat(target).st_mode
    except FileNotFoundError:
        mode = None
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from None
    if mode is not None and stat.S_ISDIR(mode):
        raise InputError(f"{path}: is a folder; name a file")
    if mode is not None and not stat.S_ISREG(mode):
        raise InputError(f"{path}: is no regular file; name a file, or use the standard output")
    if not target.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")
    if mode is not None and not os.access(target, os.W_OK):
        raise InputError(f"{path}: is write-protected; choose another place")
    try:
        # Permissions do not tell everything, a read-only disk for instance: try it.
        os.unlink(_empty_file_beside(target))
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from None


def _empty_file_beside(target: Path) -> Path:
    """Make an empty file of the same suffix in the same folder; its name is short whatever that of `target` is."""
    handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=".bcut-", suffix=target.suffix)
    os.close(handle)
    return Path(temporary)
