"""Feed every reader with damaged input, one after the other, each in a process of its own."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.fuzz import NAMES

LONGEST_INPUT = 8192
"""Most bytes of an input; what is read of a format fits in a few hundred."""

SLOWEST_S = 10
"""Longest time for one of them, on a busy machine."""

MOST_MIB = 2048
"""Most memory of a process."""


def main() -> int:
    """Run all targets, or those that are named; 1 if one of them failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("target", nargs="*", help="one or more of " + ", ".join(NAMES))
    parser.add_argument("--minutes", type=float, default=10.0, help="for all of them together (10)")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers (1)")
    parser.add_argument("--findings", type=Path, default=Path("fuzz-findings"), help="folder for inputs that fail")
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    names = arguments.target or list(NAMES)
    seconds = max(1, round(60 * arguments.minutes / len(names)))
    if arguments.alone:
        _fuzz(names[0], seconds, arguments.seed, arguments.findings)
    arguments.findings.mkdir(parents=True, exist_ok=True)
    failed = [name for name in names if not _passes(name, arguments)]
    print(f"{len(names) - len(failed)} of {len(names)} targets without a finding, {seconds} s each")
    return 1 if failed else 0


def _passes(name: str, arguments: argparse.Namespace) -> bool:
    minutes = arguments.minutes / len(arguments.target or NAMES)
    done = subprocess.run(
        [sys.executable, "-m", "tests.fuzz", name, "--alone", "--minutes", f"{minutes}",
         "--seed", f"{arguments.seed}", "--findings", f"{arguments.findings}"],
        capture_output=True, text=True,
    )  # fmt: skip
    said = done.stderr.splitlines()
    runs = next((line for line in reversed(said) if line.startswith(("Done", "stat::number_of_executed"))), "")
    print(f"{name}: {'a finding' if done.returncode else runs or 'done'}", flush=True)
    if done.returncode:
        print("\n".join(done.stdout.splitlines()[-40:] + said[-40:]), flush=True)
    return done.returncode == 0


def _fuzz(name: str, seconds: int, seed: int, findings: Path) -> None:
    """Run one target under atheris, which ends the process."""
    import atheris

    import renderer.pipeline  # noqa: F401 (what it imports is compiled from its own bytecode, which stays as it is)

    with atheris.instrument_imports(include=["clients", "renderer", "service"]):
        from tests.fuzz.targets import strict, targets
    target, seeds = targets()[name]
    for data in seeds:
        strict(target, data)  # what it takes to compile kernels is not the input's time
    with tempfile.TemporaryDirectory() as corpus:
        for number, data in enumerate(seeds):
            (Path(corpus) / f"{number}").write_bytes(data)
        atheris.Setup(
            [
                sys.argv[0], corpus, f"-max_total_time={seconds}", f"-seed={seed}", f"-max_len={LONGEST_INPUT}",
                f"-timeout={SLOWEST_S}", f"-rss_limit_mb={MOST_MIB}", f"-artifact_prefix={findings}/",
                "-print_final_stats=1", "-verbosity=0",
            ],
            lambda data: strict(target, data),
            internal_libfuzzer=True,
        )  # fmt: skip
        atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
