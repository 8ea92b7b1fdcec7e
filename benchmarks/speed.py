# SPDX-License-Identifier: BSD-3-Clause
"""How fast it is: ours and the peers side by side, in alternating runs on one machine. Writes docs/performance.md.

    python -m benchmarks.speed            about ten minutes; the peers need `pip install swarmevo[bench]`
    python -m benchmarks.speed --rounds 1 --quick

Rates are simulated seconds for each second of CPU time (all threads of the process), medians over the rounds. Absolute
rates are this machine's; the ratios are what to quote. What cannot be run is listed with the reason.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cases import Case, random_networks
from swarmevo.config import Config
from swarmevo.simulator import library_info

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "performance.md"
PLOT = ROOT / "docs" / "performance"

OURS = [sys.executable, "-m", "benchmarks.cases"]
PEERS = ROOT / "benchmarks" / "peers"


def peer(script: str, *arguments: str) -> list[str]:
    """Return the command of a peer's script for one repetition."""
    return [sys.executable, str(PEERS / f"{script}_scene.py"), "--repeat", "1", *arguments]


# Name, what it is, command. The first of each group is ours.
SIDE_BY_SIDE: dict[str, list[tuple[str, list[str]]]] = {
    "five robots roaming": [
        ("swarmevo", [*OURS, "roaming", "--repeat", "1"]),
        ("swarmevo, articulated", [*OURS, "roaming-articulated", "--repeat", "1"]),
        ("MuJoCo tuned, 3-D", peer("mujoco", "--mode", "loop", "--config", "tuned", "--seconds", "60")),
        ("MuJoCo plain, 3-D", peer("mujoco", "--mode", "loop", "--config", "plain", "--seconds", "60")),
        ("MuJoCo, no wheels or floor", peer("mujoco", "--mode", "loop", "--config", "planar", "--seconds", "60")),
        ("PyBullet tuned, 3-D", peer("pybullet", "--config", "tuned", "--seconds", "30")),
        ("VMAS, 2-D, 256 worlds", peer("vmas", "--scene", "epuck", "--nsim", "256", "--seconds", "10")),
    ],
    "five robots pushing the box": [
        ("swarmevo", [*OURS, "pushing", "--repeat", "1"]),
        ("swarmevo, articulated", [*OURS, "pushing-articulated", "--repeat", "1"]),
        ("MuJoCo tuned, 3-D", peer("mujoco", "--mode", "step", "--push", "--config", "tuned", "--seconds", "20")),
        ("MuJoCo plain, 3-D", peer("mujoco", "--mode", "step", "--push", "--config", "plain", "--seconds", "20")),
    ],
    "five robots pressed on the box at the wall": [("swarmevo", [*OURS, "pressed", "--repeat", "1"])],
    "random genomes, mixed": [("swarmevo", [*OURS, "random", "--repeat", "1"])],
    "Python controller, 256 worlds in lockstep": [("swarmevo", [*OURS, "lockstep", "--repeat", "1"])],
}


def rate_of(command: Sequence[str]) -> float | str:
    """Run a command that prints one line of JSON; return its rate, or why there is none."""
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return "took longer than ten minutes"
    try:
        return float(json.loads(done.stdout.splitlines()[-1])["realtime_factor_per_cpu_s"])
    except (IndexError, KeyError, ValueError):
        return (done.stderr.strip().splitlines() or ["no output"])[-1]


def side_by_side(rounds: int) -> dict[str, list[tuple[str, list[float], str]]]:
    """Return for each group its runners: name, rates of all rounds, reason if there are none."""
    results = {}
    for group, runners in SIDE_BY_SIDE.items():
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


# ---- more of ours ----


def team_sizes(sizes: Sequence[int], rounds: int) -> dict[int, float]:
    """Return rates of avoiding robots in arenas that grow with the team."""
    return {
        n: statistics.median(float(rate_of([*OURS, f"robots-{n}", "--repeat", "1"])) for _ in range(rounds))
        for n in sizes
    }


def thread_gain(rounds: int) -> list[float]:
    """Return ratios of two threads to one, by the clock, in alternating runs of random genomes."""
    case = Case(Config(), random_networks(100), 100)
    ratios = []
    for _ in range(rounds):
        times = []
        for threads in (1, 2):
            start = time.perf_counter()
            case.run(threads)
            times.append(time.perf_counter() - start)
        ratios.append(times[0] / times[1])
    return ratios


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


def breakdown(case: str) -> dict[str, float] | str:
    """Return shares of instructions by what they are for, counted by callgrind; or why not."""
    if not shutil.which("valgrind"):
        return "valgrind is not installed"
    with tempfile.TemporaryDirectory() as folder:
        build = [
            [
                "cmake",
                "-S",
                str(ROOT),
                "-B",
                folder,
                "-DSWARMEVO_BENCHMARKS=ON",
                "-DCMAKE_CXX_FLAGS=-fno-inline-functions",
            ],
            ["cmake", "--build", folder, "--target", "episodes"],
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out", f"{folder}/episodes", case],
            ["callgrind_annotate", "--inclusive=yes", "--threshold=100", f"{folder}/out"],
        ]
        for command in build:
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                return f"{command[0]} failed"
    inclusive: dict[str, int] = {}
    for line in done.stdout.splitlines():
        match = re.match(r"\s*([\d,]+) \(.*?\)\s+\S*?:(.+?) \[", line)
        if match:
            name = match[2].replace("(anonymous namespace)::", "").split("(")[0]
            inclusive[name] = max(inclusive.get(name, 0), int(match[1].replace(",", "")))
    whole = inclusive["swarmevo::Batch::run"]
    ode = inclusive.get("dWorldStep", 0)
    step, observe = inclusive["swarmevo::World::step"], inclusive["swarmevo::Episode::observe"]
    network = inclusive.get("swarmevo::act", 0)
    return {
        "ODE: dWorldStep": ode / whole,
        "contacts, coasting, corrections": (step - ode) / whole,
        "sensing": observe / whole,
        "network": network / whole,
        "telemetry, hash, noise of the wheels, the rest": (whole - step - observe - network) / whole,
        "instructions for a simulated second": whole / {"roaming": 60.0, "pushing": 8.0, "random": 480.0}[case],
    }


def python_side(populations: Sequence[int]) -> list[tuple[int, float, float]]:
    """Return for each population the seconds that one generation costs beside simulation: ask and tell; the store.

    With PDE on the paper's genome; the front has at most 16 points, so nearly all of a generation are new children.
    """
    from swarmevo.protocols import SceneInfo
    from swarmevo_paper.network import FeedForwardNetwork
    from swarmevo_paper.pde import PDE

    space = FeedForwardNetwork().space(SceneInfo(5, 1800, 0.1))
    rows = []
    for population in populations:
        rng = np.random.default_rng(1)
        pde = PDE(space, population, 2, rng)
        start = time.process_time()
        for _ in range(3):
            genomes = pde.ask()
            pde.tell(genomes, np.column_stack([rng.random(len(genomes)), rng.integers(0, 16, len(genomes))]))
        rows.append((population, (time.process_time() - start) / 3, store_seconds(genomes)))
    return rows


def store_seconds(genomes: Any) -> float:
    """Return how long a generation's rows and genomes take to be written by SQLite, as the store writes them."""
    import sqlite3

    with tempfile.TemporaryDirectory() as folder:
        connection = sqlite3.connect(f"{folder}/run.sqlite")
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("CREATE TABLE genome (id INTEGER PRIMARY KEY, bytes BLOB)")
        connection.execute("CREATE TABLE episode (genome, repeat, a, b, push, homing, hash)")
        start = time.process_time()
        with connection:
            connection.executemany("INSERT INTO genome (bytes) VALUES (?)", ((g.tobytes(),) for g in genomes))
            connection.executemany(
                "INSERT INTO episode VALUES (?, ?, ?, ?, ?, ?, ?)",
                ((i, r, 1.0, 2.0, 3.0, b"0" * 40, i) for i in range(len(genomes)) for r in range(3)),
            )
        return time.process_time() - start


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
    right.loglog(list(sizes), [1e6 / (rate * n) for n, rate in sizes.items()], "o-", color="#0072B2")
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
    results = side_by_side(rounds)
    sizes = team_sizes([5, 20] if quick else [1, 2, 5, 10, 20, 40, 64], 1 if quick else rounds)
    gains = thread_gain(2 if quick else 2 * rounds)
    lasting = endurance(500 if quick else 10_000)
    shares = {case: breakdown(case) for case in ("roaming", "pushing", "random")}
    python = python_side([100, 1000] if quick else [30, 100, 1000, 10_000])
    plot(results, sizes)
    text = (ROOT / "benchmarks" / "performance_head.md").read_text()
    text += f"Library: {library_info()['build']}. Rounds: {rounds}.\n\n"
    text += "![Rates and cost per robot](performance/speed.svg)\n\n"
    text += "## Side by side\n\n" + compared(results)
    text += "\n## Teams\n\nAvoiding robots, random starts, the same floor for each robot.\n\n"
    cost = {n: 1e6 / (rate * n) for n, rate in sizes.items()}
    text += table(
        ["robots", "simulated s per CPU s", "CPU us per robot and s", "over five robots"],
        [[n, f"{rate:,.0f}", f"{cost[n]:.1f}", f"{cost[n] / cost[5]:.2f}"] for n, rate in sizes.items()],
    )
    text += "\n## Threads\n\n"
    text += f"Two threads over one, by the clock, random genomes: median {statistics.median(gains):.2f}, "
    text += f"range {min(gains):.2f} to {max(gains):.2f} in {len(gains)} pairs.\n"
    text += "\n## Endurance\n\n" + table(["", ""], [[k, f"{v:,.2f}".removesuffix(".00")] for k, v in lasting.items()])
    text += "\n## Where the time goes\n\nShares of instructions in whole episodes, counted by callgrind.\n\n"
    names = list(next((s for s in shares.values() if isinstance(s, dict)), {}))
    columns = [s if isinstance(s, dict) else {} for s in shares.values()]
    text += table(
        ["", *shares],
        [
            [name, *(f"{c[name]:,.0f}" if "instructions" in name else f"{c[name]:.1%}" for c in columns if name in c)]
            for name in names
        ],
    )
    text += (
        "\n## The Python side\n\nSeconds of CPU for a generation, beside its episodes (three for each individual).\n\n"
    )
    random_rate = statistics.median(results["random genomes, mixed"][0][1])
    text += table(
        ["population", "ask and tell", "SQLite", "share beside 3 episodes of 180 s each"],
        [[p, f"{a:.3f}", f"{s:.3f}", f"{(a + s) / (p * 540 / random_rate):.2%}"] for p, a, s in python],
    )
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
