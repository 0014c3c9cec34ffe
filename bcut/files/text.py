"""Reading files, with errors that name the file."""

from __future__ import annotations

from pathlib import Path

from bcut.errors import InputError


def read_bytes(path: Path) -> bytes:
    """Contents of a file that is not empty.

    Raises
    ------
    InputError
        There is no such file, it is a directory, empty, or cannot be read.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; check the path") from None
    except IsADirectoryError:
        raise InputError(f"{path}: this is a directory; give a file of points in it") from None
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror or error}); check its permissions"
        ) from None
    except ValueError as error:  # a null character in the path
        raise InputError(f"{str(path)!r}: no valid path ({error})") from None
    if not content.strip():
        raise InputError(f"{path}: the file is empty; it should hold points")
    return content


def read_text(path: Path) -> str:
    """Contents of a UTF-8 text file, without a byte-order mark.

    Raises
    ------
    InputError
        As `read_bytes`, or the file is not UTF-8 text.
    """
    return decoded(read_bytes(path), str(path))


def decoded(content: bytes, origin: str) -> str:
    """Return UTF-8 text without a byte-order mark; `origin` is what messages call it.

    Raises
    ------
    InputError
        It is not UTF-8 text.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{origin}: not UTF-8 text (byte {error.start}); save it as UTF-8") from None
    if "\0" in text:
        raise InputError(f"{origin}: binary data where text is expected; does the suffix fit the contents?")
    return text
