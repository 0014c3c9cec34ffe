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


class SurfaceError(InputError):
    """Triangles that bound no region: not closed, crossing each other, or wrongly oriented."""


class TooLargeError(InputError):
    """A configuration whose simplices are too many to be listed in memory."""


class ResultError(InputError):
    """A result file that cannot be read, or that belongs to another schema."""


class SeparatorLoadError(InputError):
    """A separator that cannot be found, imported or given these parameters."""


class PlanError(InputError):
    """A plan of an experiment, or a collection of instances, that cannot be used as written."""


class ExperimentError(InputError):
    """A folder of an experiment that cannot be used: nothing in it, or another process at work there."""


class LedgerError(InputError):
    """A ledger of cuts that cannot be read, or that belongs to another schema."""


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


class ObjectiveLoadError(InputError):
    """A user's objective that cannot be found."""


class ObjectiveError(BcutError):
    """A user's objective that raised, or handed back something else than a finite cost for each simplex.

    Attributes
    ----------
    objective : str
        As the user wrote it.
    trace : str
        The function's own traceback, as text; empty when it returned something malformed.
    """

    exit_status = 5

    def __init__(self, objective: str, message: str, trace: str = "") -> None:
        super().__init__(f"objective '{objective}': {message}")
        self.objective = objective
        self.trace = trace


class SolverError(BcutError):
    """A solver that failed, or whose answer did not survive exact verification."""

    exit_status = 5


class VerificationError(BcutError):
    """A result that did not survive exact re-checking; the message is the reason."""
