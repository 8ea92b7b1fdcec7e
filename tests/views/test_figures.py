# SPDX-License-Identifier: BSD-3-Clause
"""Figures: what they draw of a run, that nothing global is touched, and what they are written as."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, FancyArrowPatch

import small_runs
from swarmevo.analysis import assessment, fronts
from swarmevo.analysis.networks import network_of
from swarmevo.config import Config
from swarmevo.errors import StoreError
from swarmevo.plugins.team import Team
from swarmevo.protocols import Compiled, NativePolicies, Objective, Recurrent
from swarmevo.runs.store import Store
from swarmevo.views import figures
from swarmevo.views.figures import behaviour, networks, style, writing
from swarmevo.views.figures import objectives as objective_figures
from swarmevo.views.replay import scene as replay_scene


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_runs.make(tmp_path_factory.mktemp("runs") / "run")


def test_fronts_have_a_marker_for_each_point_and_a_line_for_all(run: Path) -> None:
    picture = figures.fronts(run)
    (axes,) = picture.axes
    with Store.open(run) as store:
        for trial, line in enumerate(axes.lines[:2]):
            points = [(p.objectives["hidden_neurons"], p.objectives["box_pushing"]) for p in fronts.front(store, trial)]
            assert np.allclose(line.get_xydata(), points)
    assert axes.get_xlabel() == "hidden neurons (less is better)"
    assert axes.get_ylabel() == "box pushing (more is better)"
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["trial 0", "trial 1", "global front"]


def test_a_third_objective_is_said_not_to_be_drawn(run: Path, tmp_path: Path) -> None:
    three = small_runs.make(tmp_path / "run", "fitness={box_pushing: {}, hidden_neurons: {}, coverage: {}}")
    for picture, is_told in (
        (figures.fronts(three), True), (figures.fronts_of_runs({"three": three}), True), (figures.fronts(run), False),
    ):  # fmt: skip
        told = " ".join(picture.axes[0].get_title(loc="left").split())
        assert told == ("not drawn: coverage, in which a point may be better" if is_told else "")
        held(picture)


def test_names_of_objectives_are_no_formulas(run: Path) -> None:
    """Case 24: a name with an unfinished formula is drawn as it is; ticks are whole where the values are."""
    with Store.open(run) as store:
        for name, points in (("$\\frac{x$", [0.5, 0.75]), ("loss", [0.5, 0.75]), ("counts", [1.0, 2.0])):
            store.objectives = (store.objectives[0], Objective(name, "minimise", (0.0, 2.0)))
            with style.picture() as picture:
                axes = picture.add_subplot()
                objective_figures._plane_axes(axes, store.objectives, np.array([points, [0.0, 1.0]]).T)
            picture.canvas.draw()
            assert axes.xaxis.get_label().get_text() == f"{name} (less is better)"
            assert not axes.xaxis.get_label().get_parse_math()
            axes.set_xlim(0.0, 2.0)
            assert all(tick == round(tick) for tick in axes.get_xticks()) == (points[0] == 1.0)


def test_hypervolume_is_that_of_analysis(run: Path) -> None:
    (axes,) = figures.hypervolume(run).axes
    with Store.open(run) as store:
        expected = [[step.hypervolume for step in fronts.history(store, trial)] for trial in (0, 1)]
    assert np.allclose([line.get_ydata() for line in axes.lines[:2]], expected)
    assert np.allclose(axes.lines[2].get_ydata(), np.median(expected, axis=0))


def test_evolution_shows_every_individual_once(run: Path) -> None:
    (axes,) = figures.evolution(run, trial=1).axes
    assert sum(len(cloud.get_offsets()) for cloud in axes.collections) == 2 * 4
    assert axes.get_xlabel() == "generation"


def test_the_flat_evolution_has_the_same_individuals_and_says_which_colour_is_which_generation(run: Path) -> None:
    axes, bar = figures.evolution(run, trial=1, flat=True).axes
    with Store.open(run) as store:
        means = np.concatenate([store.over_worlds(one.means)[:, 1::-1] for one in store.summaries(1)])
    shown = np.concatenate([cloud.get_offsets() for cloud in axes.collections])
    assert sorted(map(tuple, shown.tolist())) == sorted(map(tuple, means.tolist()))
    assert sorted(np.concatenate([cloud.get_array() for cloud in axes.collections])) == [0] * 4 + [1] * 4
    assert bar.get_ylabel() == "generation"


def test_hypervolume_says_its_unit_and_its_reference(run: Path) -> None:
    (axes,) = figures.hypervolume(run).axes
    assert axes.get_ylabel() == "hypervolume\n(box pushing \N{MULTIPLICATION SIGN} hidden neurons)"
    assert axes.get_title(loc="left") == "reference point: box pushing 0, hidden neurons 15"


def test_one_generation_is_a_point_at_whole_numbers(tmp_path: Path) -> None:
    run = small_runs.make(tmp_path / "run", "evolution.generations=1")
    (alone,), (overlaid,) = figures.hypervolume(run).axes, figures.hypervolume_of_runs({"run": run}).axes
    for axes, curves in ((alone, alone.lines[:2]), (overlaid, overlaid.lines[-1:])):
        assert [len(curve.get_ydata()) for curve in curves] == [1] * len(curves)
        assert {curve.get_marker() for curve in curves} == {"o"}
        assert shown_ticks(axes.xaxis) == [0]
    _, bar = figures.evolution(run, flat=True).axes
    assert shown_ticks(bar.yaxis) == [0]
    (space,) = figures.evolution(run).axes
    assert shown_ticks(space.xaxis) == [0]


def test_who_all_have_one_hidden_neuron_have_one_tick() -> None:
    objectives = [Objective("score", "maximise", (0, 1)), Objective("neurons", "minimise", (0, 15))]
    with style.picture() as picture:
        axes = picture.add_subplot()
        objective_figures._plane_axes(axes, objectives, np.array([[1.0, 0.3], [1.0, 0.4]]))
    assert shown_ticks(axes.xaxis) == [1]
    assert len(shown_ticks(axes.yaxis)) > 2


def shown_ticks(axis: Axis) -> list[float]:
    """Return where an axis has ticks that are seen."""
    low, high = sorted(axis.get_view_interval())
    return [float(tick) for tick in axis.get_majorticklocs() if low <= tick <= high]


@pytest.mark.parametrize("width", [figures.COLUMN, figures.PAGE])
def test_figures_are_as_wide_as_a_column_or_a_page_and_hold_all_that_is_in_them(run: Path, width: float) -> None:
    """Nothing, legends with it, is beyond the figure's edges."""
    with Store.open(run) as store:
        seen = assessment.watch(store)
    made = [
        figures.fronts(run, width),
        figures.hypervolume(run, width),
        figures.evolution(run, flat=True, width=width),
        figures.attainment(run, width),
        figures.paths(seen, width=width),
        figures.occupancy(seen, width=width),
        figures.network(run, width=width),
    ]
    for picture in made:
        assert picture.get_figwidth() == width
        held(picture)


def held(picture: figures.Picture) -> None:
    """Check that nothing of a figure is cut off."""
    picture.draw_without_rendering()
    box = picture.get_tightbbox()
    assert box.x0 >= -0.02
    assert box.y0 >= -0.02
    assert box.x1 <= picture.get_figwidth() + 0.02
    assert box.y1 <= picture.get_figheight() + 0.02


def test_a_long_legend_stands_below_within_the_figure(run: Path) -> None:
    with style.picture(3.5, entries=11) as picture:
        axes = picture.add_subplot()
        for trial in range(11):
            axes.plot([0, 1], [0, trial], label=f"trial {trial}")
        axes.set_xlabel("generation")
        style.legend(axes, 11, 3.5)
        held(picture)
        assert axes.get_legend().get_window_extent().y1 < axes.xaxis.label.get_window_extent().y0


def test_paths_say_in_the_figure_what_is_what(run: Path) -> None:
    (axes,) = figures.paths(run).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "robot at the start", "robot at the end", "box at the start", "box at the end", "source and its range",
        "target wall",
    ]  # fmt: skip


def test_each_channel_of_emitters_has_its_colour(tmp_path: Path) -> None:
    emitters = "scene.emitters=[{}, {channel: prey, reach: arena, position: [0.3, 0, 0.03]}, {channel: light}]"
    run = small_runs.make(tmp_path / "run", emitters)
    (axes,) = figures.paths(run).axes
    names = ("source and its range", "prey", "light and its range")
    marks = {str(mark.get_label()): mark.get_color() for mark in axes.get_legend().get_lines()}
    assert set(names) <= marks.keys()
    assert len({marks[name] for name in names}) == 3
    stars = [line.get_color() for line in axes.lines if line.get_marker() == "*"]
    assert stars == [marks[name] for name in names]
    circles = [one.get_edgecolor() for one in axes.patches if isinstance(one, Circle) and one.get_linestyle() == ":"]
    assert circles == [to_rgba(marks[name]) for name in names if "range" in name]


def test_a_network_without_inputs_is_drawn(tmp_path: Path) -> None:
    blind = ["robot.sensors=[]", "controller={elman: {bias: false}}", "fitness=[aggregation]"]
    with Store.open(small_runs.make(tmp_path / "run", *blind)) as store:
        held(figures.network(store, fronts.front(store)[0].genome))


def test_a_plate_has_the_papers_figures(run: Path) -> None:
    import swarmevo as se

    picture = se.figures.paper(se.open(run))
    assert picture.get_figwidth() == 7
    letters = [text.get_text() for axes in picture.axes for text in axes.texts if text.get_fontweight() == "bold"]
    assert letters == ["a", "b", "c"]
    assert [axes.get_xlabel() for axes in picture.axes[:3]] == ["hidden neurons (less is better)"] * 2 + ["x (m)"]
    held(picture)


def test_runs_are_laid_over_each_other(run: Path) -> None:
    runs = {"one": run, "two": run}
    (axes,) = figures.fronts_of_runs(runs).axes
    with Store.open(run) as store:
        front = [(p.objectives["hidden_neurons"], p.objectives["box_pushing"]) for p in fronts.front(store)]
        expected = [[step.hypervolume for step in fronts.history(store, trial)] for trial in (0, 1)]
    shown = [line.get_xydata() for line in axes.lines if line.get_label() in runs]
    assert [points.tolist() for points in shown] == [[list(point) for point in front]] * 2
    (axes,) = figures.hypervolume_of_runs(runs).axes
    medians = [line.get_ydata() for line in axes.lines if line.get_label() in runs]
    assert np.allclose(medians, [np.median(expected, axis=0)] * 2)


def test_runs_of_other_objectives_are_not_laid_over_each_other(run: Path, tmp_path: Path) -> None:
    with Store.create(tmp_path / "run", "{}", {}, [Objective("a", "maximise", (0, 1))], 1, 1) as other:
        for overlaid in (figures.fronts_of_runs, figures.hypervolume_of_runs):
            with pytest.raises(ValueError, match="expected runs of the same objectives"):
                overlaid({"run": run, "other": other})


def test_attainment_of_all_trials_is_dominated_by_that_of_any(run: Path) -> None:
    (axes,) = figures.attainment(run).axes
    curves = {line.get_label(): line.get_xydata() for line in axes.lines}
    assert list(curves) == ["any trial", "half of the trials", "all trials"]
    best, worst = (float(np.max(curves[name][:, 1])) for name in ("any trial", "all trials"))
    assert best >= worst


def test_paths_and_occupancy_are_of_the_tests(run: Path) -> None:
    with Store.open(run) as store:
        seen = assessment.watch(store)
    (axes,) = figures.paths(seen, test=1).axes
    assert len(axes.collections) == 3  # one path for each robot
    last = axes.collections[0].get_paths()[-1].vertices[-1]
    assert np.allclose(last, seen.telemetry.pose[1, -1, 0, :2])
    axes = figures.occupancy(seen).axes[0]
    assert np.isclose(axes.images[0].get_array().sum(), 100)


def test_a_path_ends_when_the_box_is_there(run: Path) -> None:
    with Store.open(run) as store:
        seen = assessment.watch(store)
    seen.telemetry.push_time[0] = -1.5  # [s]: 2 s later is 0.5 s after the start
    assert behaviour._shown_steps(seen, 0) == 5
    assert behaviour._shown_steps(seen, 1) == 20
    assert seen.best == 0


def test_the_network_has_what_is_switched_on(run: Path) -> None:
    with Store.open(run) as store:
        point = max(fronts.front(store, 0), key=lambda point: point.objectives["hidden_neurons"])
    hidden = int(point.objectives["hidden_neurons"])
    (axes,) = figures.network(run, point.genome).axes
    names = [text.get_text() for text in axes.texts]
    assert len(names) == 14 + hidden + 2
    assert {"infrared_0", "infrared_7", "touch_0", "rf", "bias", "left", "right"} < set(names)
    assert axes.get_title(loc="left").startswith(f"{hidden} hidden neuron")


def drawn(controller: str, **options: Any) -> tuple[Axes, NativePolicies]:
    """Return the figure of a network whose weights are 1, -2, 3, ...; hidden neuron 0 is off."""
    fitness = {"hidden_neurons": {}}
    team = Team(Config.model_validate({"controller": {controller: options}, "fitness": fitness}))
    genes = np.where(np.arange(team.space.size) % 2, -1.0, 1.0) * np.arange(1.0, team.space.size + 1)
    switches = np.flatnonzero(team.space.is_switch)
    genes[switches] = np.arange(len(switches)) > 0
    policies, info = team.policies(genes), team.scene.info
    assert policies is not None
    (axes,) = networks._picture(network_of(policies, info), (*info.observation_names, "bias"), info, 3.5).axes
    return axes, policies


def lines(axes: Axes) -> int:
    """Return how many weights are drawn as straight lines."""
    return sum(len(line.get_xdata()) == 2 for line in axes.lines)


def rings(axes: Axes) -> int:
    return sum(line.get_markersize() == 14 for line in axes.lines)


@pytest.mark.parametrize(
    ("controller", "weights", "arrows", "own"),
    [
        ("linear", 2 * 14, 0, 0),
        ("elman", 14 * 2 + 2 * 2 + 2, 2, 2),
        ("jordan", 14 * 2 + 2 * 2 + 2, 4, 0),
        ("ctrnn", 14 * 2 + 2 * 2 + 2, 2, 2),
    ],
)
def test_each_network_has_its_links(controller: str, weights: int, arrows: int, own: int) -> None:
    """Of three hidden neurons two are on; what they remember is an arrow, or a ring at its own neuron."""
    axes, policies = drawn(controller, **({} if controller == "linear" else {"hidden": 3}))
    assert (lines(axes), len(axes.patches), rings(axes)) == (weights, arrows, own)
    names = [text.get_text() for text in axes.texts][14:-2]
    if isinstance(policies, Recurrent) and policies.time_constants is not None:
        assert names == [f"{i}: {policies.time_constants[0, i]:.2g} s" for i in (1, 2)]
    else:
        assert names == ([] if controller == "linear" else ["1", "2"])


def test_a_recurrent_link_leads_from_who_is_remembered() -> None:
    """The strongest of Elman's: its ends, and who is at them."""
    axes, policies = drawn("elman", hidden=3)
    assert isinstance(policies, Recurrent)
    weights = policies.context_hidden[0][1:, 1:] * (1 - np.eye(2))
    to, by = np.unravel_index(np.abs(weights).argmax(), (2, 2))
    strongest = max(axes.patches, key=lambda patch: patch.get_linewidth())
    heights = networks._column(2)
    assert isinstance(strongest, FancyArrowPatch)
    assert strongest._posA_posB == [(1, heights[by]), (1, heights[to])]


@pytest.mark.parametrize("policies", [None, Compiled(1, np.zeros((1, 1)))], ids=["Python", "compiled"])
def test_a_controller_that_is_no_network_has_no_figure(
    policies: NativePolicies | None, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever writes all figures leaves it out; whoever asks for it is told what was wanted."""
    monkeypatch.setattr(Team, "policies", lambda *_: policies)
    with Store.open(run) as store:
        assert not figures.has_network(store.config, np.zeros(1))
    with pytest.raises(ValueError, match="expected a controller that makes networks for the library"):
        figures.network(run)


def test_two_positions_of_a_staircase() -> None:
    objectives = (Objective("score", "maximise", (0, 9)), Objective("neurons", "minimise", (0, 9)))
    axes = figures.Picture().add_subplot()
    axes.set(xlim=(0.5, 6), ylim=(1, 3.5))
    objective_figures.staircase(axes, objectives, np.array([[4.0, 3.0], [1.0, 2.0]]))
    assert axes.lines[0].get_xydata().tolist() == [[1, 1], [1, 2], [4, 3], [6, 3]]  # from end to end of the axes
    others = (Objective("cost", "minimise", (0, 9)), Objective("reach", "maximise", (0, 9)))
    objective_figures.staircase(axes, others, np.array([[4.0, 3.0], [1.0, 2.0]]))
    assert axes.lines[1].get_xydata().tolist() == [[4, 3.5], [4, 3], [1, 2], [0.5, 2]]


def test_a_run_without_a_generation_has_no_figures(tmp_path: Path) -> None:
    with (
        Store.create(tmp_path / "run", "{}", {}, [Objective("a", "maximise", (0, 1))], 1, 1) as store,
        pytest.raises(StoreError, match="none is stored yet"),
    ):
        figures.paths(store)


def test_robots_have_the_colours_of_their_replays() -> None:
    assert tuple(figures.CYCLE) == tuple(replay_scene.COLOURS)


def test_trials_can_be_told_apart() -> None:
    pairs = {(i % len(figures.CYCLE), i % len(figures.MARKERS)) for i in range(50)}
    assert len(pairs) == 50


def test_the_page_has_as_many_shapes_as_the_figures() -> None:
    page = (Path(figures.__file__).parents[1] / "report" / "assets" / "charts.js").read_text()
    shapes = page.partition("const SHAPES = [")[2].partition("];")[0]
    assert shapes.count('"M') == len(figures.MARKERS)


def test_a_run_shows_all_that_it_can(run: Path) -> None:
    names = [name for name, _ in figures.every(run)]
    assert names == [
        *("fronts", "hypervolume", "evolution", "evolution_flat", "attainment", "paths", "occupancy", "network"),
        "paper",
    ]


def test_figures_are_written_the_same_each_time(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "every", lambda run, width: iter([("hypervolume", figures.hypervolume(run, width))]))
    first, again = figures.write(run, tmp_path / "first"), figures.write(run, tmp_path / "again")
    assert [path.name for path in first] == ["hypervolume.pdf", "hypervolume.png"]
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]
    assert first[0].read_bytes().startswith(b"%PDF")


def test_svg_takes_the_ink_of_its_page(run: Path) -> None:
    drawn = figures.svg(figures.hypervolume(run))
    assert drawn.startswith("<svg")
    assert "currentColor" in drawn
    assert figures.INK not in drawn
    assert "<style" not in drawn  # it would be the whole page's


def test_text_in_svg_is_escaped() -> None:
    picture = figures.Picture()
    picture.suptitle("<script>alert(1)</script>")
    drawn = figures.svg(picture)
    assert "<script" not in drawn
    assert "&lt;script&gt;" in drawn


def test_a_figure_shows_itself_in_a_notebook(run: Path) -> None:
    assert figures.hypervolume(run)._repr_png_().startswith(b"\x89PNG")


def test_nothing_global_is_touched(run: Path) -> None:
    code = (
        "import matplotlib\nbefore = dict(matplotlib.rcParams)\nfrom swarmevo.views import figures\n"
        f"figures.fronts({str(run)!r})\nassert dict(matplotlib.rcParams) == before\n"
        "import matplotlib.pyplot\nassert matplotlib.pyplot.get_fignums() == []"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
