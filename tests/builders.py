"""All formulations, and configurations to write them for."""

from __future__ import annotations

from typing import Any

from bcut.formulations.chambers import chamber_formulation
from bcut.formulations.cocircuits import cocircuit_formulation
from bcut.formulations.face_sets import face_set_formulation
from bcut.formulations.formulation import Formulation
from bcut.formulations.stable_sets import stable_set_formulation
from bcut.instance import load_instance

BUILDERS: dict[str, Any] = {
    "0": stable_set_formulation,
    "1": face_set_formulation,
    "2": cocircuit_formulation,
    "chambers": chamber_formulation,
}
GENERAL = ["random:8,2,seed=1", "random:7,3,seed=1", "random:7,4,seed=2", "polygon:7", "cyclic:7,3"]
DEGENERATE = ["grid:3,3", "cube:3", "prism:4", "cross-polytope:4", "moae", "polygon:5,center"]


def built(name: str, instance: str, **options: Any) -> Formulation:
    return BUILDERS[name](load_instance(instance), **options)
