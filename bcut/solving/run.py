"""One run of `solve` or `bound`: its checked input, its search, and the result made from it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bcut.errors import InputError, SeparatorLoadError
from bcut.geometry.configuration import PointConfiguration
from bcut.geometry.permutations import PermutationGroup
from bcut.geometry.restrictions import Restrictions
from bcut.geometry.symmetry import symmetry_group
from bcut.instance import load_instance
from bcut.objectives.invariance import symmetries_of_table
from bcut.objectives.measures import read_costs
from bcut.objectives.objective import objective_of
from bcut.objectives.syntax import read_level, read_objective
from bcut.result import Certificate, Question, Result
from bcut.separation.driver import check_names
from bcut.separation.resolve import resolve
from bcut.separation.seam import Separator
from bcut.solving.bottleneck import solve_bottleneck
from bcut.solving.by_elimination import empty_part, solve_by_elimination
from bcut.solving.by_fixing import bound_by_fixing, solve_by_fixing
from bcut.solving.by_orbits import bound_by_orbits, known_triangulation, solve_by_orbits, solve_invariant
from bcut.solving.capping import with_capped_costs
from bcut.solving.certificates import make_certificate, make_infeasibility_certificate
from bcut.solving.compact_part import begin_fixing, make_program, without_columns
from bcut.solving.embedding import costs_to_embed
from bcut.solving.groups import subgroups_to_try, symmetries_of
from bcut.solving.levels import Levels, solve_listed
from bcut.solving.memory import Watch, watched
from bcut.solving.methods import Traits, check_method, choose_method
from bcut.solving.options import (
    DEFAULT_SEPARATORS,
    SEPARATORS_FOR_DISSECTIONS,
    SEPARATORS_FOR_STABLE_SETS,
    InstanceLike,
    Options,
    SeparatorLike,
)
from bcut.solving.orbit_stage import OrbitStage, orbit_stage
from bcut.solving.programs import formulation_name, make_formulation
from bcut.solving.report import make_result
from bcut.solving.search import Part, Progress, Search, bound_at_root, place
from bcut.solving.strategies import solve_in_scip


class Run:
    """One run.

    Parameters
    ----------
    instance : str, path or PointConfiguration
    options : Options
    on_progress : callable, optional

    Raises
    ------
    BcutError
        For everything that a user can cause by what is asked for; nothing has been computed then.
    """

    def __init__(self, instance: InstanceLike, options: Options, on_progress: Progress | None = None) -> None:
        self.started = time.perf_counter()
        self.options = options
        options.check()
        self.formulation = formulation_name(options.formulation, dissection=options.dissection)
        self.name = read_objective(options.objective, options.sense)
        self.following = [read_level(text) for text in options.then]
        given = options.separators
        if given is None:
            given = _default_separators(self.formulation, options.dissection)
        self.separators = tuple(given)
        families = [_make(item) for item in self.separators]
        check_names(families)
        limit = options.time_limit
        deadline = None if limit is None else time.monotonic() + limit
        self.configuration = instance if isinstance(instance, PointConfiguration) else load_instance(instance)
        started = time.perf_counter()
        self.restrictions = Restrictions.of(
            self.configuration, require=options.require, forbid=options.forbid, star=options.star
        )
        self.link, self.only_link = self._link()
        self.method = self._method()
        self.group = self._group()
        self.subgroups: list[PermutationGroup] | None = None
        if self.group is not None and options.invariant_under is not None:
            self.subgroups = subgroups_to_try(
                self.configuration, self.group, options.invariant_under, seed=options.seed
            )
        self.families = families
        self.size = (0, 0)
        self.stage: OrbitStage | None = None
        self.levels: Levels | None = None
        self.search = Search(
            whole=self._beginning(),
            make_separators=lambda: [_make(item) for item in self.separators],
            deadline=deadline,
            seed=options.seed,
            on_progress=on_progress,
            restricted=bool(self.restrictions),
        )
        self.search.seconds["model"] = time.perf_counter() - started
        self.question = self._question()

    def _link(self) -> tuple[bool, bool]:
        """Tell whether link cuts are at work, and whether no other family is."""
        families = {_describe(item).split(":")[0] for item in self.separators}
        return "link" in families, families <= {"link"}

    def _method(self) -> str:
        """Return the method, chosen or checked."""
        options, method = self.options, self.options.method
        if options.symmetries is not None or options.invariant_under is not None:
            if method not in ("auto", "orbits"):
                raise InputError(f"method '{method}' does not work with symmetries; use the method orbits")
            method = "orbits"
        check_method(method, self.name, self.following)
        traits = Traits(
            self.configuration,
            self.name,
            spanning=options.spanning,
            whole_question=self.formulation == "2" and not self.restrictions,
            only_link=self.only_link,
            following=bool(self.following),
            symmetries=lambda: symmetry_group(self.configuration).order,
            only_bound=options.only_bound,
        )
        return choose_method(method, traits)

    def _group(self) -> PermutationGroup | None:
        """Return the symmetries to work with where orbits are the method."""
        if self.method != "orbits":
            return None
        options = self.options
        group = symmetries_of(self.configuration, options.symmetries)
        if options.objective != "cardinality":
            default, table = read_costs(Path(options.objective.partition(":")[2]), self.configuration)
            group = symmetries_of_table(group, default, table)
        return group

    def _beginning(self) -> Part:
        """Return what is known before limits are watched: at most a triangulation that takes no search."""
        if self.method == "fixing":
            return begin_fixing(self.configuration, self.name, spanning=self.options.spanning)
        if self.method == "elimination":
            return empty_part(self.configuration)
        return without_columns(self.configuration, self.name, spanning=self.options.spanning)

    def _make_model(self) -> None:
        """List simplices or their orbits, and write down the program that the search is about."""
        search, options = self.search, self.options
        if self.method == "fixing":
            self.size = make_program(search, self.name, only_link=self.only_link)
        elif self.group is not None:
            with search.timed("model"):
                self.stage = self._orbits(self.group)
                formulation = self.stage.formulation
                self.size = int(formulation.sizes.sum()), formulation.matrix.shape[0] + 1
                search.whole, search.unit = known_triangulation(self.stage), self.stage.objective.unit
        elif self.method != "elimination":
            with search.timed("model"):
                listed = make_formulation(
                    self.formulation,
                    self.configuration,
                    spanning=options.spanning,
                    dissection=options.dissection,
                    restrictions=self.restrictions,
                )
                if listed.dissection and not listed.chirotope.is_general:
                    _check_valid_for_dissections(self.families)
                self.size = listed.size
                search.whole = Part.whole(listed, objective_of(self.name, listed))
                self.levels = Levels(search, self.following) if self.following else None

    def _orbits(self, group: PermutationGroup) -> OrbitStage:
        return orbit_stage(
            self.configuration,
            self.options.objective,
            sense=self.name.sense,
            spanning=self.options.spanning,
            group=group,
            seconds=self.search.seconds_left,
        )

    def _question(self) -> Question:
        """Return what was asked, as it stands in the result file."""
        options = self.options
        invariant_under = None
        if self.subgroups is not None:
            invariant_under = [subgroup.generators.tolist() for subgroup in self.subgroups]
        return Question(
            objective=options.objective,
            sense=self.name.sense,
            spanning=options.spanning,
            formulation=self.formulation,
            separators=[_describe(item) for item in self.separators],
            seed=options.seed,
            limits={"time": options.time_limit, "memory": options.memory_limit},
            method=self.method,
            invariant_under=invariant_under,
            dissection=options.dissection,
            require=[list(face) for face in self.restrictions.require],
            forbid=[list(face) for face in self.restrictions.forbid],
            star=self.restrictions.star,
        )

    def within_limits(self, work: Callable[[], None]) -> None:
        """Do the work until it is done, a limit is reached, or Ctrl-C comes."""
        search = self.search
        watch = Watch()
        try:
            with watched(watch, memory=self.options.memory_limit, deadline=search.deadline):
                work()
        except KeyboardInterrupt:
            search.status = "interrupted"
        except MemoryError:
            search.status = "limit"
        if watch.reached and search.status == "interrupted":
            search.status = "limit"

    def solve(self) -> None:
        """Search for an optimum."""
        self._make_model()
        if self.stage is not None:
            if self.subgroups is None:
                solve_by_orbits(self.search, self.stage, cuts=self.link)
            else:
                solve_invariant(self.search, self.stage, self.subgroups, cuts=self.link)
        elif self.method == "scip":
            with_capped_costs(self.search, solve_in_scip)
        elif self.method == "fixing":
            solve_by_fixing(self.search)
        elif self.method == "elimination":
            self.size = solve_by_elimination(self.search).size
        elif self.levels is not None:
            self.levels.solve()
        else:
            solve_listed(self.search)

    def bound(self) -> None:
        """Bound at the root only."""
        search = self.search
        self._make_model()
        if self.stage is not None:
            bound_by_orbits(search, self.stage, cuts=self.link)
            search.status = "limit" if search.bound is None else "bound"
            return
        if self.method == "fixing":
            bound_by_fixing(search)
            return
        if self.name.is_bottleneck:
            solve_bottleneck(search, branching=False)
            return
        root = bound_at_root(search, search.whole, search.separation(search.whole))
        if root.status == "infeasible" or root.status == "limit":
            search.status = root.status

    def hand_out(self) -> None:
        """Have some triangulation where the search has none: it costs next to nothing."""
        search = self.search
        if search.columns is not None or search.status == "infeasible" or self.subgroups is not None:
            return
        if len(search.whole.columns) or self.restrictions:
            place(search)
            return
        # Before the simplices were listed.
        search.whole = begin_fixing(self.configuration, self.name, spanning=self.options.spanning)
        search.offer(search.whole.columns)

    def finish(self) -> Result:
        """Verify what was found and write it down."""
        certificate = self.certificate()
        if self.levels is None and self.following:
            self.levels = Levels(self.search, self.following)
        if self.levels is not None:
            self.levels.conclude()
        self.question.costs = costs_to_embed(
            self.name, self.search.whole.objective, self.configuration, self.search
        )
        if self.levels is not None:
            self.question.then = self.levels.questions(self.configuration)
        result = make_result(
            self.configuration,
            self.question,
            self.search,
            size=self.size,
            certificate=certificate,
            started=self.started,
        )
        if self.levels is not None:
            result.then = self.levels.records()
        return result

    def certificate(self) -> Certificate:
        """Write out the multipliers of the exact bound without cuts."""
        exact = self.search.exact
        if self.search.certificate is not None:
            return self.search.certificate
        if self.search.status == "infeasible" and not self.question.dissection:
            return self._proof_of_infeasibility()
        if exact is None:
            return Certificate(reason="no relaxation was solved to optimality outside SCIP")
        whole, refutation = self.search.whole, self.search.refutation
        return make_certificate(whole.formulation, whole.objective, exact, refutation)

    def _proof_of_infeasibility(self) -> Certificate:
        program = self.search.whole.formulation
        if program.name != "2":
            program = make_formulation(
                "2", self.configuration, spanning=program.spanning, restrictions=self.restrictions
            )
        return make_infeasibility_certificate(program)


def _default_separators(formulation: str, dissection: bool) -> tuple[str, ...]:
    if dissection:
        return SEPARATORS_FOR_DISSECTIONS
    return SEPARATORS_FOR_STABLE_SETS if formulation in ("0", "1") else DEFAULT_SEPARATORS


def _check_valid_for_dissections(separators: Sequence[Separator]) -> None:
    for separator in separators:
        if not separator.dissections:
            raise InputError(
                f"separator '{separator.name}' makes cuts that triangulations satisfy, but dissections need not; leave "
                "it out (families for dissections set 'dissections = True')"
            )


def _make(item: SeparatorLike) -> Separator:
    if isinstance(item, str):
        return resolve(item)
    made: Any = item() if isinstance(item, type) else item
    if not isinstance(made, Separator):
        raise SeparatorLoadError(f"{item!r} is no separator: give a name, a file, or a bcut.Separator")
    return made


def _describe(item: SeparatorLike) -> str:
    return item if isinstance(item, str) else item.name
