# SPDX-License-Identifier: BSD-3-Clause
"""How fast it is: ours and the peers side by side, in alternating runs on one machine. Writes docs/performance.md.

    python -m benchmarks.speed            about half an hour; the peers need `pip install swarmevo[bench]`,
                                          Box2D's needs g++ and Debian's libbox2d-dev
    python -m benchmarks.speed --rounds 1 --quick

Rates are simulated seconds for each second of CPU time (all threads of the process), medians over the rounds. Absolute
rates are this machine's; the ratios are what to quote. What cannot be run is listed with the reason.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import assumptions, lockstep
from benchmarks.cases import CASES, DEEPEST_OVERLAP, Case, changed, random_networks, write_networks
from swarmevo.config import Config, seeded
from swarmevo.runs import driver
from swarmevo.runs.store import Store
from swarmevo.simulation import library_info

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "performance.md"
PLOT = ROOT / "docs" / "performance"

OURS = [sys.executable, "-m", "benchmarks.cases"]
PEERS = ROOT / "benchmarks" / "peers"


def peer(script: str, *arguments: str) -> list[str]:
    """Return the command of a peer's script for one repetition."""
    return [sys.executable, str(PEERS / f"{script}_scene.py"), "--repeat", "1", *arguments]


@dataclass(frozen=True)
class Planar:
    """A case of a 2-D peer; :func:`prepare` finds out how to run it."""

    peer: str
    case: str
    episodes: int


# Name, command. The first of each group is ours.
SIDE_BY_SIDE: dict[str, list[tuple[str, list[str] | Planar]]] = {
    "five robots roaming": [
        ("swarmevo", [*OURS, "roaming", "--repeat", "1"]),
        ("swarmevo, articulated", [*OURS, "roaming-articulated", "--repeat", "1"]),
        ("MuJoCo tuned, 3-D", peer("mujoco", "--mode", "loop", "--config", "tuned", "--seconds", "60")),
        ("MuJoCo plain, 3-D", peer("mujoco", "--mode", "loop", "--config", "plain", "--seconds", "60")),
        ("MuJoCo, no wheels or floor", peer("mujoco", "--mode", "loop", "--config", "planar", "--seconds", "60")),
        ("PyBullet tuned, 3-D", peer("pybullet", "--config", "tuned", "--seconds", "30")),
        ("VMAS, 2-D, 256 worlds", peer("vmas", "--scene", "epuck", "--nsim", "256", "--seconds", "10")),
        ("Box2D, 2-D", Planar("Box2D", "roaming", 20)),
        ("Chipmunk by pymunk, 2-D", Planar("Chipmunk", "roaming", 2)),
    ],
    "five robots pushing the box": [
        ("swarmevo", [*OURS, "pushing", "--repeat", "1"]),
        ("swarmevo, articulated", [*OURS, "pushing-articulated", "--repeat", "1"]),
        ("MuJoCo tuned, 3-D", peer("mujoco", "--mode", "step", "--push", "--config", "tuned", "--seconds", "20")),
        ("MuJoCo plain, 3-D", peer("mujoco", "--mode", "step", "--push", "--config", "plain", "--seconds", "20")),
        ("Box2D, 2-D", Planar("Box2D", "pushing", 40)),
        ("Chipmunk by pymunk, 2-D", Planar("Chipmunk", "pushing", 10)),
    ],
    "five robots pressed on the box at the wall": [("swarmevo", [*OURS, "pressed", "--repeat", "1"])],
    "random genomes, mixed": [
        ("swarmevo", [*OURS, "random", "--repeat", "1"]),
        ("Box2D, 2-D", Planar("Box2D", "random", 40)),
        ("Chipmunk by pymunk, 2-D", Planar("Chipmunk", "random", 40)),
    ],
    "Python controller, 256 worlds in lockstep": [("swarmevo", [*OURS, "lockstep", "--repeat", "1"])],
}


def answer_of(command: Sequence[str]) -> dict[str, Any] | str:
    """Run a command that prints one line of JSON; return what it says, or why it says nothing."""
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return "took longer than ten minutes"
    try:
        return dict(json.loads(done.stdout.splitlines()[-1]))
    except (IndexError, ValueError):
        return (done.stderr.strip().splitlines() or ["no output"])[-1]


def rate_of(command: Sequence[str] | str) -> float | str:
    """Run a command, unless it is the reason why there is none; return its rate, or why there is none."""
    answer = command if isinstance(command, str) else answer_of(command)
    return answer if isinstance(answer, str) else float(answer["realtime_factor_per_cpu_s"])


def side_by_side(rounds: int, prepared: Mapping[str, Prepared | str]) -> dict[str, list[tuple[str, list[float], str]]]:
    """Return for each group its runners: name, rates of all rounds, reason if there are none."""
    results = {}
    for group, entries in SIDE_BY_SIDE.items():
        runners = [runner(name, what, prepared) for name, what in entries]
        rates: dict[str, list[float]] = {name: [] for name, _ in runners}
        reasons = dict.fromkeys(rates, "")
        for _ in range(rounds):  # alternating: what slows the machine down slows all of them down
            for name, command in runners:
                rate = rate_of(command)
                if isinstance(rate, str):
                    reasons[name] = rate
                else:
                    rates[name].append(rate)
                print(f"  {group}: {name}: {rate}", file=sys.stderr)
        results[group] = [(name, rates[name], reasons[name]) for name in rates]
    return results


# ---- the 2-D peers ----

STEPS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.025, 0.05)  # [s]; each divides the control period
WAY_TOLERANCE = 0.02  # of the box's way at the smallest step


@dataclass(frozen=True)
class Trial:
    """What became of the box that is pushed without noise, at one step."""

    way: float  # [m]
    overlap: float  # the deepest, there and in the crowds of random genomes [mm]


@dataclass(frozen=True)
class Prepared:
    """A 2-D peer that can be run."""

    program: list[str]
    folder: Path  # of the cases' networks
    trials: dict[float, Trial]  # by step [s]

    @property
    def step(self) -> float:
        """The largest valid step [s]."""
        return valid_steps(self.trials)[-1]


def valid_steps(trials: Mapping[float, Trial]) -> list[float]:
    """Return the steps [s], from the smallest on, that are as true as ours must be.

    There the way of the box is near that at the smallest step, and nothing overlaps deeper than ``cases.sound`` allows
    ours. A step behind one that is not valid is not valid either, however near its way comes by chance. Raises
    ``ValueError`` if the box does not move at the smallest step.
    """
    smallest, *larger = sorted(trials)
    reference = trials[smallest].way
    if not reference > 0:
        raise ValueError(f"expected a box that is pushed at the step of {smallest:g} s, got a way of {reference:g} m")

    def is_true(step: float) -> bool:
        way, overlap = trials[step].way, trials[step].overlap
        return abs(way - reference) <= WAY_TOLERANCE * reference and overlap <= DEEPEST_OVERLAP

    return [smallest, *takewhile(is_true, larger)]


def planar_command(program: Sequence[str], folder: Path, name: str, step: float, episodes: int) -> list[str]:
    """Return the command that runs a case of ours with a 2-D peer."""
    ours = planar_case(name)
    options = {
        "networks": folder / f"{name}.csv",
        "dt": step,
        "seconds": ours.config.episode.horizon,
        "episodes": episodes,
        "box-friction": ours.config.physics.box_friction,
    }
    return [*program, name, *(str(word) for key, value in options.items() for word in (f"--{key}", value))]


def planar_case(name: str) -> Case:
    """Return a case of ours that 2-D peers run too."""
    ours = CASES[name]()
    assert isinstance(ours, Case)
    return ours


def runner(name: str, what: list[str] | Planar, prepared: Mapping[str, Prepared | str]) -> tuple[str, list[str] | str]:
    """Return the name of a runner and its command, or why there is none."""
    if not isinstance(what, Planar):
        return name, what
    found = prepared[what.peer]
    if isinstance(found, str):
        return name, found
    command = planar_command(found.program, found.folder, what.case, found.step, what.episodes)
    return f"{name}, at {1000 * found.step:g} ms", command


def compiled_box2d(folder: Path) -> list[str] | str:
    """Return the program of Box2D's scene, or why there is none."""
    if not shutil.which("g++"):
        return "g++ is not installed"
    program = str(folder / "box2d_scene")
    source = str(PEERS / "box2d_scene.cpp")
    done = subprocess.run(
        ["g++", "-std=c++17", "-O2", source, "-lbox2d", "-o", program], capture_output=True, text=True
    )
    if done.returncode:
        reason = re.search(r"(?<=error: ).*|cannot find .*", done.stderr)
        return reason[0] if reason else "g++ failed"
    return [program]


def prepare(folder: Path) -> dict[str, Prepared | str]:
    """Return the 2-D peers with their trials, or why they cannot be run; ``folder`` keeps what they need."""
    for name in {what.case for group in SIDE_BY_SIDE.values() for _, what in group if isinstance(what, Planar)}:
        write_networks(folder / f"{name}.csv", planar_case(name).networks)
    programs = {
        "Box2D": compiled_box2d(folder),
        "Chipmunk": [sys.executable, str(PEERS / "pymunk_scene.py")],
    }
    return {name: tried(name, program, folder) for name, program in programs.items()}


def tried(name: str, program: list[str] | str, folder: Path) -> Prepared | str:
    """Return a 2-D peer with its trials, or why it cannot be run."""
    if isinstance(program, str):
        return program
    trials = {}
    for step in STEPS:
        command = planar_command(program, folder, "pushing", step, episodes=1)
        answer = answer_of([*command, "--noise", "0", "--overlap", "1"])
        if isinstance(answer, str):
            return answer
        crowd = answer_of([*planar_command(program, folder, "random", step, episodes=4), "--overlap", "1"])
        if isinstance(crowd, str):
            return crowd
        trials[step] = Trial(answer["box_way_m"], max(answer["deepest_overlap_mm"], crowd["deepest_overlap_mm"]))
    prepared = Prepared(program, folder, trials)
    print(f"  {name}: valid up to {1000 * prepared.step:g} ms: {trials}", file=sys.stderr)
    return prepared


# ---- more of ours ----


def team_sizes(sizes: Sequence[int], rounds: int) -> dict[int, float]:
    """Return rates of avoiding robots in arenas that grow with the team."""
    return {
        n: statistics.median(float(rate_of([*OURS, f"robots-{n}", "--repeat", "1"])) for _ in range(rounds))
        for n in sizes
    }


def run_random(threads: int) -> None:
    """Simulate what :func:`thread_gain` times."""
    Case(Config(), random_networks(100), 100).run(threads)


def thread_gain(rounds: int) -> dict[str, list[float]]:
    """Return how much more a second of the clock does than with one thread, in alternating runs of random genomes.

    With two threads, and with two processes that share nothing and do the same work each: what the machine has to give.
    """
    gains: dict[str, list[float]] = {"two threads": [], "two processes": []}
    with multiprocessing.get_context("spawn").Pool(2) as processes:
        processes.map(run_random, [1, 1], chunksize=1)  # once to warm up
        for _ in range(rounds):
            times = []
            for threads, two in ((1, False), (2, False), (1, True)):
                start = time.perf_counter()
                if two:
                    processes.map(run_random, [threads, threads], chunksize=1)
                else:
                    run_random(threads)
                times.append(time.perf_counter() - start)
            gains["two threads"].append(times[0] / times[1])
            gains["two processes"].append(2 * times[0] / times[2])
    return gains


def endurance(episodes: int) -> dict[str, float]:
    """Return how memory and time per episode change over many episodes of 18 s."""
    config = Config()
    config = config.model_copy(update={"episode": config.episode.model_copy(update={"horizon": 18.0})})
    case = Case(config, random_networks(100), 100)
    memory, seconds = [], []
    for _ in range(episodes // 100):
        start = time.process_time()
        case.run()
        seconds.append(time.process_time() - start)
        memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    tenth = max(1, len(seconds) // 10)
    return {
        "episodes": episodes,
        "memory after the first tenth [MiB]": memory[tenth - 1],
        "memory at the end [MiB]": memory[-1],
        "time of the last tenth over the first": statistics.median(seconds[-tenth:])
        / statistics.median(seconds[:tenth]),
    }


NEWTON = "swarmevo::CompliantStep::solve"


def breakdown(case: str) -> dict[str, float] | str:
    """Return shares of instructions by what they are for, and counts of them, by callgrind; or why not."""
    if not shutil.which("valgrind"):
        return "valgrind is not installed"
    with tempfile.TemporaryDirectory() as folder:
        # Functions are not inlined, so that they can be told apart.
        apart = ["-DCMAKE_CXX_FLAGS=-fno-inline-functions", "-DCMAKE_INTERPROCEDURAL_OPTIMIZATION=OFF"]
        said = ""
        for command in (
            ["cmake", "-S", str(ROOT), "-B", folder, "-DSWARMEVO_BENCHMARKS=ON", *apart],
            ["cmake", "--build", folder, "--target", "episodes"],
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out", f"{folder}/episodes", case],
            ["callgrind_annotate", "--inclusive=yes", "--threshold=100", f"{folder}/out"],
        ):
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                return f"{command[0]} failed"
            said += done.stdout
        profile = Path(folder, "out").read_text()
    seconds = float(re.findall(r"([\d.]+) simulated seconds", said)[0])
    inclusive: dict[str, int] = {}
    for line in said.splitlines():
        match = re.match(r"\s*([\d,]+) \(.*?\)\s+\S*?:(.+?) \[", line)
        if match:
            name = match[2].replace("(anonymous namespace)::", "").split("(")[0]
            inclusive[name] = max(inclusive.get(name, 0), int(match[1].replace(",", "")))
    total = inclusive["swarmevo::Batch::run"]
    newton, ode = inclusive.get(NEWTON, 0), inclusive.get("dWorldStep", 0)
    step, observe = inclusive["swarmevo::World::step"], inclusive["swarmevo::Episode::observe"]
    network = inclusive.get("swarmevo::act", 0)
    return {
        "Newton's method": newton / total,
        "ODE: dWorldStep": ode / total,
        "what meets, coasting, moving": (step - newton - ode) / total,
        "sensing": observe / total,
        "network": network / total,
        "telemetry, hash, noise of the wheels, the rest": (total - step - observe - network) / total,
        "instructions for a simulated second": total / seconds,
        "instructions for a second in Newton's method": newton / seconds,
        "solutions for a simulated second": calls_of(rf"{re.escape(NEWTON)}\(\)", profile) / seconds,
        "dWorldSteps for a simulated second": calls_of("dWorldStep", profile) / seconds,
    }


def calls_of(function: str, profile: str) -> int:
    """Return how often a function was called, from callgrind's output, which spells a name out where it first comes."""
    match = re.search(rf"^c?fn=\((\d+)\) {function}$", profile, re.MULTILINE)
    if not match:
        return 0
    calls = re.findall(rf"^cfn=\({match[1]}\).*\ncalls=(\d+)", profile, re.MULTILINE)
    return sum(map(int, calls))


def evolution_of(population: int, repeats: int, generations: int) -> list[float]:
    """Return the CPU seconds of each generation of a real run with next to no simulation: one robot, 0.1 s episodes.

    Ask, jobs, results, fitness, tell and the store, on the paper's genome.
    """
    config = changed(
        seeded(Config()),
        evolution={"population": population, "repeats": repeats, "generations": generations, "trials": 1},
        episode={"horizon": 0.1},
        team={"robots": 1},
    )
    with tempfile.TemporaryDirectory() as folder:
        driver.begin(f"{folder}/run", config)
        with Store.open(f"{folder}/run", readonly=False) as store:
            marks = [time.process_time()]
            driver.evolve(store, 1, lambda _: marks.append(time.process_time()))
    return list(np.diff(marks))


def python_side(populations: Sequence[int]) -> dict[int, float]:
    """Return for each population the CPU seconds of a generation beside its simulation.

    Not of the first: its jobs are small, since nobody knows yet how long an episode takes.
    """
    return {n: statistics.median(evolution_of(n, repeats=3, generations=4)[1:]) for n in populations}


# ---- the page ----


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [" | ".join(map(str, row)) for row in (head, ["---"] * len(head), *rows)]
    return "\n".join(f"| {line} |" for line in lines) + "\n"


def compared(results: dict[str, list[tuple[str, list[float], str]]]) -> str:
    """Return the side-by-side tables."""
    rows = []
    for group, runners in results.items():
        ours = runners[0][1]
        for name, rates, reason in runners:
            if not rates:
                rows.append([group, name, f"not run: {reason}", "", ""])
                continue
            median = statistics.median(rates)
            ratio = (
                ""
                if name == runners[0][0]
                else f"{statistics.median(a / b for a, b in zip(ours, rates, strict=False)):.1f}"
            )
            rows.append([group, name, f"{median:,.0f}", f"{min(rates):,.0f} to {max(rates):,.0f}", ratio])
    return table(["case", "simulator", "simulated s per CPU s", "range", "ours is faster by"], rows)


def steps_compared(prepared: Mapping[str, Prepared | str]) -> str:
    """Return the table of the 2-D peers' steps."""
    rows = [
        [name, f"{1000 * step:g} ms", f"{trial.way:.4f}", f"{trial.overlap:.2f}", "yes" if step <= peer.step else "no"]
        for name, peer in prepared.items()
        if isinstance(peer, Prepared)
        for step, trial in peer.trials.items()
    ]
    return table(["peer", "step", "way of the box [m]", "deepest overlap [mm]", "valid"], rows)


def plot(results: dict[str, list[tuple[str, list[float], str]]], sizes: dict[int, float]) -> None:
    """Draw the rates and the cost of a robot."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), gridspec_kw={"width_ratios": [3, 2]})
    bars = [
        (f"{name} ({group})", statistics.median(rates), name.startswith("swarmevo"))
        for group, runners in results.items()
        for name, rates, _ in runners
        if rates
    ]
    for y, (_, rate, ours) in enumerate(reversed(bars)):
        left.barh(y, rate, color="#0072B2" if ours else "#999999")
        left.text(rate * 1.1, y, f"{rate:,.0f}", va="center", fontsize=8)
    left.set_yticks(range(len(bars)), [name for name, *_ in reversed(bars)], fontsize=8)
    left.set_xscale("log")
    left.set_xlim(right=max(rate for _, rate, _ in bars) * 4)
    left.set_xlabel("simulated seconds per CPU second")
    right.plot(list(sizes), [1e6 / (rate * n) for n, rate in sizes.items()], "o-", color="#0072B2")
    right.set_xscale("log")
    right.set_xticks(list(sizes), [str(n) for n in sizes])
    right.minorticks_off()
    right.set_ylim(bottom=0)
    right.set_xlabel("robots, arena scaled")
    right.set_ylabel("CPU us per robot and simulated s")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    PLOT.mkdir(parents=True, exist_ok=True)
    figure.savefig(PLOT / "speed.svg")
    figure.savefig(PLOT / "speed.png", dpi=120)


def write_page(rounds: int, quick: bool) -> None:
    """Measure everything and write the page."""
    with tempfile.TemporaryDirectory() as folder:
        prepared = prepare(Path(folder))
        results = side_by_side(rounds, prepared)
    sizes = team_sizes([5, 20] if quick else [1, 2, 5, 10, 20, 40, 64], 1 if quick else rounds)
    pushers = {n: float(rate_of([*OURS, f"pushers-{n}", "--repeat", "3"])) for n in ([5] if quick else range(1, 6))}
    gains = thread_gain(2 if quick else 10)
    lasting = endurance(500 if quick else 10_000)
    shares = {case: breakdown(case) for case in ("roaming", "pushing", "random")}
    undone = assumptions.rows()
    python = python_side([100, 1000] if quick else [30, 100, 1000, 10_000])
    stepped = lockstep.rows(2 if quick else 11)
    many = evolution_of(20, repeats=1, generations=100 if quick else 1000)
    plot(results, sizes)
    text = (ROOT / "benchmarks" / "performance_head.md").read_text()
    text += f"Library: {library_info()['build']}. Rounds: {rounds}.\n\n"
    text += "![Rates and cost per robot](performance/speed.svg)\n\n"
    text += "## Side by side\n\n" + compared(results)
    text += "\n## Steps of the 2-D peers\n\nFive robots push the box for 8 s without noise. Overlaps are also those of "
    text += "random genomes.\n\n"
    text += steps_compared(prepared)
    text += "\n## Teams\n\nAvoiding robots, random starts, the same floor for each robot.\n\n"
    cost = {n: 1e6 / (rate * n) for n, rate in sizes.items()}
    text += table(
        ["robots", "simulated s per CPU s", "CPU us per robot and s", "over five robots"],
        [[n, f"{rate:,.0f}", f"{cost[n]:.1f}", f"{cost[n] / cost[5]:.2f}"] for n, rate in sizes.items()],
    )
    text += "\n## Contacts of the box\n\nTeams that push the box, all of them; one or two push in vain.\n\n"
    text += table(
        ["robots that push", "simulated s per CPU s", "CPU us for a simulated s"],
        [[n, f"{rate:,.0f}", f"{1e6 / rate:,.0f}"] for n, rate in pushers.items()],
    )
    text += "\n## Threads\n\n"
    text += "Random genomes, by the clock, over one thread. Two processes share nothing: what the machine gives.\n\n"
    text += table(
        ["", "median", "range", "runs"],
        [
            [name, f"{statistics.median(gain):.2f}", f"{min(gain):.2f} to {max(gain):.2f}", len(gain)]
            for name, gain in gains.items()
        ],
    )
    text += "\n## Endurance\n\n" + table(["", ""], [[k, f"{v:,.2f}".removesuffix(".00")] for k, v in lasting.items()])
    text += "\n## Where the time goes\n\nShares of instructions in whole episodes, counted by callgrind.\n\n"
    names = list(next((s for s in shares.values() if isinstance(s, dict)), {}))
    columns = [s for s in shares.values() if isinstance(s, dict)]
    text += table(
        ["", *shares],
        [
            [
                name,
                *(
                    f"{c[name]:,.4g}"
                    if name.startswith("dWorld")
                    else f"{c[name]:,.0f}"
                    if " for a " in name
                    else f"{c[name]:.1%}"
                    for c in columns
                ),
            ]
            for name in names
        ],
    )
    text += "\n## What assumptions are worth\n\nA step rests on what is checked after it. How many times as many "
    text += "instructions whole episodes take without one of these. What is not checked makes steps cheaper, and wrong "
    text += "where it does not hold:\n\n"
    text += table(["assumption", *assumptions.CASES], undone)
    text += "\n## The Python side\n\n"
    text += "A generation of a real run without its simulation: ask, jobs, results, fitness, tell, store.\n\n"
    random_rate = statistics.median(results["random genomes, mixed"][0][1])
    text += table(
        ["population", "CPU s for a generation", "over its 3 episodes of 180 s each", "cores it can feed"],
        [
            [n, f"{seconds:.3f}", f"{seconds / (n * 540 / random_rate):.2%}", f"{n * 540 / random_rate / seconds:.0f}"]
            for n, seconds in python.items()
        ],
    )
    tenth = len(many) // 10
    growth = statistics.median(many[-tenth:]) / statistics.median(many[1 : tenth + 1])
    text += f"\nThe last tenth of {len(many):,} generations of 20 took {growth:.2f} times as long as the first.\n"
    text += "\n" + lockstep.section(stepped)
    PAGE.write_text(text + (ROOT / "benchmarks" / "performance_tail.md").read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="alternating runs of each")
    parser.add_argument("--quick", action="store_true", help="fewer sizes and episodes")
    arguments = parser.parse_args()
    write_page(arguments.rounds, arguments.quick)
    print(PAGE)


if __name__ == "__main__":
    main()
