"""Every error that a user can cause, as one class tree.

Each message says what is wrong, where (the instance, file or plug-in), and how to mend it. The command line
prints the message and exits with `exit_status`; it never shows a traceback for these, except a plug-in's own.
"""

from __future__ import annotations


class BcutError(Exception):
    """Base of all errors that `bcut` raises on purpose."""

    exit_status = 2


class InputError(BcutError):
    """An instance, a file or an option that cannot be used as given."""


class ConfigurationError(InputError):
    """Points that are no point configuration: duplicates, too small a dimension, not finite, not exact."""


class TooLargeError(InputError):
    """A configuration whose simplices are too many to be listed in memory."""


class ResultError(InputError):
    """A result file that cannot be read, or that belongs to another schema."""


class SeparatorLoadError(InputError):
    """A separator that cannot be found, imported or given these parameters."""


class SeparatorError(BcutError):
    """A separator that raised, or handed back something that is no cut.

    Attributes
    ----------
    separator : str
        The name of the family.
    trace : str
        The plug-in's own traceback, as text; empty when it returned a malformed cut.
    """

    exit_status = 5

    def __init__(self, separator: str, message: str, trace: str = "") -> None:
        super().__init__(f"separator '{separator}': {message}")
        self.separator = separator
        self.trace = trace


class SolverError(BcutError):
    """A solver that failed, or whose answer did not survive exact verification."""

    exit_status = 5


class VerificationError(BcutError):
    """A result that did not survive exact re-checking; the message is the reason."""
