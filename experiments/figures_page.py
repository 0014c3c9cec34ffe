"""Write docs/figures.md, its pictures and docs/figures.csv from the runs of `figure-5.toml`.

    bcut experiment run experiments/figure-5.toml --output results/figures --workers 1
    python experiments/figures_page.py results/figures

Every number on the page, those between words included, is computed from the records of the runs.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from statistics import fmean, median
from textwrap import fill
from typing import Any

import numpy as np

from bcut.experiments.plan import read_plan
from bcut.experiments.reporting.measures import figures, measures_table
from bcut.experiments.reporting.runs import Experiment, load_experiment
from bcut.geometry.boundary import lie_in_boundary
from bcut.geometry.chirotope import Chirotope
from bcut.geometry.simplices import candidate_simplices
from bcut.geometry.subsets import without
from bcut.instance import load_instance
from bcut.objectives.measures import measured

ROOT = Path(__file__).resolve().parent.parent
PLANS = {number: ROOT / "experiments" / f"figure-{number}.toml" for number in (5, 6, 7)}
SIZE, WEIGHT, WORST = "cardinality", "weight", "min-max:aspect-ratio"
MEASURES = {5: SIZE, 6: WEIGHT, 7: WORST}
POINTS = (10, 20, 30)
SEEDS = range(10)
VARIANTS = ("D", "W", "C", "AR")

PAGE = """# Figures 5 to 7 of the paper

Ten random sets each of 10, 20 and 30 points in the unit cube, and four triangulations of each with all points as
vertices: Delaunay's (D), of minimum weight (W), of minimum cardinality (C), and with the smallest largest aspect
ratio (AR, circumradius over inradius). The paper draws their cardinality, their weight (the total area of their
triangles) and their largest aspect ratio.

```sh
bcut experiment run experiments/figure-5.toml --output results/figures --workers 1
bcut experiment report results/figures
```

`figure-6.toml` and `figure-7.toml` draw the other two from the same runs: with the same folder nothing is solved
twice. This page is written by `python experiments/figures_page.py results/figures`, numbers in sentences included;
[figures.csv](figures.csv) has each run.

The sets are `random:N,3,seed=S` with S = 0, ..., 9; those with the same seed begin with the same points. **{proven}
of the {solved} optima of W, C and AR are proven**; the {given} Delaunay triangulations are checked exactly: they
are triangulations, and no point is inside the sphere through a tetrahedron. All runs together took {total:.0f} s of
processor time, the longest {longest:.0f} s ({longest_run}), with bcut {bcut}, SCIP {scip}, HiGHS {highs} on a
shared {machine}. In the figures a line joins the triangulations of one set, and bars are medians.

Optima are not unique: of several triangulations of least cardinality or with the same worst tetrahedron one is
shown, so the weight of C and the cardinality of AR could be others.

## Cardinality

![Cardinality of D, W, C and AR, a panel for each number of points]({picture5})

{table5}

**"Delaunay triangulation tends to contain more tetrahedra than the other triangulations": confirmed.** D has more
than each of W, C and AR in {d_most} of the {sets} sets, and never fewer than any of them. It has {d_w_size} as many
as W, {d_c_size} as many as C and {d_ar_size} as many as AR (means for 10, 20 and 30 points).

## Weight

![Weight of D, W, C and AR, a panel for each number of points]({picture6})

{table6}

**"Delaunay triangulation is not at all close to the minimum weight triangulation": confirmed.** D is heavier than W
in all sets, by {d_w_weight} on average, by {d_w_least} at least and {d_w_most} at most. But it is not the worst
choice: AR comes closer to W on average ({ar_w_weight} above), and so does C for few points, but it is {c_w_weight}
above W and heavier than D in {c_over_d} sets of ten: its few tetrahedra are large ones.

## Largest aspect ratio

![Largest aspect ratio of D, W, C and AR, a panel for each number of points, logarithmic]({picture7})

{table7}

**"Delaunay triangulation avoids flat tetrahedra": mostly for 20 and 30 points, not for 10.** The worst tetrahedron
of D is better than that of W in {d_better_w} sets of ten, and better than that of C in {d_better_c}; the medians of
the ratio D to W are {d_w_worst}. D has the same worst tetrahedron as AR, the best possible one, in {d_is_ar} sets
of ten.

**"There is still a gap" to the optimum: confirmed,** in the other {gap_sets} of {sets} sets. The median ratio of D
to AR is {d_ar_worst}, the largest {d_ar_most:,.0f}.

**Where flat tetrahedra are.** In {at_hull} of {sets} sets the worst tetrahedron of D has a facet on the boundary of
the hull, in {two_at_hull} of them two: such tetrahedra lie between two facets that are nearly in one plane, AR does
without them where it can, and D, whose empty spheres can be huge there, does not. Without the tetrahedra at the
boundary the median of the largest aspect ratio of D would be {inner} instead of {whole}. Even for AR the
boundary often decides: in {forced} of {sets} sets the optimum is exactly what a single boundary facet enforces, a
triangle on which even the best of all tetrahedra is that bad.
"""


class Runs:
    """The records of the runs, by points, seed and variant."""

    def __init__(self, experiment: Experiment) -> None:
        self.records = {(run.entry["instance"], run.variant): run.record for run in experiment.runs}
        wanted = {(name_of(n, s), v) for n in POINTS for s in SEEDS for v in VARIANTS}
        missing = wanted - set(self.records)
        if missing:
            raise SystemExit(f"{len(missing)} runs are missing, such as {min(missing)}: run the plan first")

    def measure(self, measure: str, n: int, seed: int, variant: str) -> float:
        """Return a measure of one triangulation."""
        value: float = self.records[name_of(n, seed), variant]["measures"][measure]
        return value

    def ratios(self, measure: str, first: str, second: str, n: int) -> list[float]:
        """Return the ratios of two variants for the ten sets of a size."""
        return [self.measure(measure, n, s, first) / self.measure(measure, n, s, second) for s in SEEDS]

    def counted(self, test: Callable[[float], bool], measure: str, first: str, second: str) -> list[int]:
        """Count the sets, for each size, whose ratio of two variants passes a test."""
        return [sum(map(test, self.ratios(measure, first, second, n))) for n in POINTS]


def name_of(n: int, seed: int) -> str:
    """Return the name of an instance."""
    return f"random:{n},3,seed={seed}"


def listed(values: list[Any], form: str = "{}") -> str:
    """Write one value for each size: "a, b and c"."""
    texts = [form.format(value) for value in values]
    return f"{', '.join(texts[:-1])} and {texts[-1]}"


def means(runs: Runs, measure: str, first: str, second: str) -> list[float]:
    """Return the mean ratio of two variants for each size."""
    return [fmean(runs.ratios(measure, first, second, n)) for n in POINTS]


def boundary(runs: Runs, n: int, seed: int) -> dict[str, Any]:
    """Look at the tetrahedra at the boundary of the hull.

    Returns
    -------
    dict
        "facets": how many of the worst tetrahedron of D are in the boundary; "inner": the largest aspect ratio of D's
        tetrahedra without one; "forced": the largest aspect ratio that a single boundary facet enforces.
    """
    configuration = load_instance(name_of(n, seed))

    def at_boundary(simplices: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        sides = [lie_in_boundary(configuration, without(simplices, position)) for position in range(4)]
        return np.column_stack(sides)

    def ratios(simplices: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return np.asarray(measured("aspect-ratio", configuration, simplices))

    own = np.array(runs.records[name_of(n, seed), "D"]["triangulation"])
    counts, values = at_boundary(own).sum(axis=1), ratios(own)
    everything = candidate_simplices(Chirotope.of(configuration), spanning=True)
    all_values, sides = ratios(everything), at_boundary(everything)
    best: dict[tuple[int, ...], float] = {}
    for index, position in np.argwhere(sides).tolist():
        facet = tuple(np.delete(everything[index], position).tolist())
        best[facet] = min(best.get(facet, np.inf), float(all_values[index]))
    return {
        "facets": int(counts[values.argmax()]),
        "inner": float(values[counts == 0].max(initial=0.0)),
        "forced": max(best.values()),
    }


def table(experiment: Experiment, measure: str) -> str:
    """Write the table of a measure."""
    lines = ["| points | | mean | median | smallest | largest | proven |", "|--:|---|--:|--:|--:|--:|---|"]
    average, single = {SIZE: ("{:.1f}", "{}"), WEIGHT: ("{:.3f}", "{:.3f}"), WORST: ("{:,.1f}", "{:,.1f}")}[
        measure
    ]
    for row in measures_table(experiment):
        if row["measure"] == measure:
            values = [average.format(row[key]) for key in ("mean", "median")]
            values += [single.format(row[key]) for key in ("smallest", "largest")]
            proven = "" if row["proven"] is None else f"{row['proven']} of {row['runs']}"
            lines.append(
                f"| {row['class'].split()[0]} | {row['variant']} | {' | '.join(values)} | {proven} |"
            )
    return "\n".join(lines)


def numbers(runs: Runs) -> dict[str, Any]:
    """Return the numbers between the words of the page."""
    pairs = [(n, s) for n in POINTS for s in SEEDS]
    others = [v for v in VARIANTS if v != "D"]
    looks = [boundary(runs, n, s) for n, s in pairs]
    over_w = [ratio for n in POINTS for ratio in runs.ratios(WEIGHT, "D", "W", n)]
    is_ar = runs.counted(lambda ratio: ratio == 1, WORST, "D", "AR")
    to_ar = [ratio for n in POINTS for ratio in runs.ratios(WORST, "D", "AR", n)]
    whole = [median(runs.measure(WORST, n, s, "D") for s in SEEDS) for n in POINTS]
    inner = [
        median(look["inner"] for look, (m, _) in zip(looks, pairs, strict=True) if m == n) for n in POINTS
    ]
    if min(over_w) <= 1 or any(
        ratio < 1 for v in others for n in POINTS for ratio in runs.ratios(SIZE, "D", v, n)
    ):
        raise SystemExit("the words of the page do not fit these runs any more")
    return {
        "sets": len(pairs),
        "d_most": sum(
            runs.measure(SIZE, n, s, "D") > max(runs.measure(SIZE, n, s, v) for v in others) for n, s in pairs
        ),
        "d_w_size": listed(means(runs, SIZE, "D", "W"), "{:.2f}"),
        "d_c_size": listed(means(runs, SIZE, "D", "C"), "{:.2f}"),
        "d_ar_size": listed(means(runs, SIZE, "D", "AR"), "{:.2f}"),
        "d_w_weight": percent([ratio - 1 for ratio in means(runs, WEIGHT, "D", "W")]),
        "ar_w_weight": percent([ratio - 1 for ratio in means(runs, WEIGHT, "AR", "W")]),
        "c_w_weight": percent([ratio - 1 for ratio in means(runs, WEIGHT, "C", "W")]),
        "d_w_least": f"{100 * (min(over_w) - 1):.0f} %",
        "d_w_most": f"{100 * (max(over_w) - 1):.0f} %",
        "c_over_d": listed(runs.counted(lambda ratio: ratio > 1, WEIGHT, "C", "D")),
        "d_better_w": listed(runs.counted(lambda ratio: ratio < 1, WORST, "D", "W")),
        "d_better_c": listed(runs.counted(lambda ratio: ratio < 1, WORST, "D", "C")),
        "d_w_worst": listed([median(runs.ratios(WORST, "D", "W", n)) for n in POINTS], "{:.2f}"),
        "d_is_ar": listed(is_ar),
        "gap_sets": len(pairs) - sum(is_ar),
        "d_ar_worst": listed([median(runs.ratios(WORST, "D", "AR", n)) for n in POINTS], "{:.2f}"),
        "d_ar_most": max(to_ar),
        "at_hull": sum(look["facets"] > 0 for look in looks),
        "two_at_hull": sum(look["facets"] > 1 for look in looks),
        "inner": listed(inner, "{:,.0f}"),
        "whole": listed(whole, "{:,.0f}"),
        "forced": sum(
            look["forced"] == runs.measure(WORST, n, s, "AR")
            for look, (n, s) in zip(looks, pairs, strict=True)
        ),
    }


def percent(values: list[float]) -> str:
    """Write one share for each size."""
    return listed([100 * value for value in values], "{:.0f}") + " %"


def filled(page: str) -> str:
    """Break the lines of paragraphs again, now that their numbers are in them."""
    blocks = page.rstrip("\n").split("\n\n")
    kept = ("#", "```", "![", "|")
    wrapped = [
        block if block.startswith(kept) else fill(block, 120, break_long_words=False, break_on_hyphens=False)
        for block in blocks
    ]
    return "\n\n".join(wrapped) + "\n"


def circumstances(experiment: Experiment) -> dict[str, Any]:
    """Return what is proven, the time, the versions and the machine."""
    solved = [run for run in experiment.runs if run.variant != "D"]
    longest = max(solved, key=lambda run: run.processor_seconds)
    machine, code = experiment.runs[0].record["machine"], experiment.manifest["code"]
    return {
        "proven": sum(run.outcome["status"] == "optimal" for run in solved),
        "solved": len(solved),
        "given": len(experiment.runs) - len(solved),
        "total": sum(run.processor_seconds for run in experiment.runs),
        "longest": longest.processor_seconds,
        "longest_run": f"{longest.variant} of `{longest.entry['instance']}`",
        "machine": f"{machine['processor']} with {machine['cores']} cores, Python {machine['python']}",
        **{key: code[key] for key in ("bcut", "scip", "highs")},
    }


def write_csv(experiment: Experiment, path: Path) -> None:
    """Write one line for each run."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("instance", "variant", "status", "bound", *MEASURES.values()))
        for run in experiment.runs:
            outcome, values = run.outcome, [run.measures[measure] for measure in MEASURES.values()]
            writer.writerow(
                (run.entry["instance"], run.variant, outcome["status"], outcome["bound"], *values)
            )


def main() -> None:
    """Read the runs, and write the page with what belongs to it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="of the experiment")
    parser.add_argument("--output", type=Path, default=ROOT / "docs")
    arguments = parser.parse_args()
    experiment = load_experiment(arguments.folder)
    runs = Runs(experiment)
    entries: dict[str, Any] = {**circumstances(experiment), **numbers(runs)}
    for number, plan in PLANS.items():
        wanted = [asdict(drawing) for drawing in read_plan(plan).drawings]
        (figure,) = figures(replace(experiment, manifest={**experiment.manifest, "figures": wanted}))
        (arguments.output / f"{figure.name}.svg").write_text(figure.svg, encoding="utf-8")
        entries[f"picture{number}"] = f"{figure.name}.svg"
        entries[f"table{number}"] = table(experiment, MEASURES[number])
    (arguments.output / "figures.md").write_text(filled(PAGE.format(**entries)), encoding="utf-8")
    write_csv(experiment, arguments.output / "figures.csv")


if __name__ == "__main__":
    main()
