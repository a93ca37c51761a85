"""Requests that the service's own OpenAPI document allows, or just does not: every reply must be one it promises."""

from __future__ import annotations

import functools
import multiprocessing
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import requests
import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable
from schemathesis.checks import CHECKS
from schemathesis.core.failures import FailureGroup
from schemathesis.generation import GenerationMode

from renderer.display import MAX_SIDE_PX
from renderer.quality import MAX_SAMPLES

PROMISES = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "negative_data_rejection",
    "unsupported_method",
)
"""What each reply is held to. That all the document allows is accepted is not among them: limits refuse some of it."""

SCENES = (None, "matte", "spheres", "../../etc/passwd")
"""Put in place of a name made up, which hardly ever is a scene's; None leaves it."""

LONGEST_SCENE = 64
"""Of what the document allows as a scene's name."""

SMALL_PX = 48
FEW_SAMPLES = 8
"""Sides and samples are brought below these, so that most frames are within the limits and take milliseconds."""

TIMEOUT_S = 240.0
CHUNK = 100
"""Requests made up at once."""


class Wrong(NamedTuple):
    """A reply that was not promised."""

    operation: str
    found: str


@dataclass
class Asked:
    """What was asked, and what came: replies by operation and status, and what was wrong with some."""

    replies: Counter[tuple[str, int]] = field(default_factory=Counter)
    wrong: list[Wrong] = field(default_factory=list)

    @property
    def total(self) -> int:
        """Requests."""
        return self.replies.total()

    def add(self, other: Asked) -> None:
        """Take in what came of others."""
        self.replies += other.replies
        self.wrong += other.wrong


@dataclass(frozen=True, slots=True)
class Task:
    """Some requests to make up.

    Attributes:
        address: of the service.
        operation: its place in the document.
        mode: for the document, or against it.
        cases: how many, unless there are not so many.
        number: another one makes up others.
    """

    address: str
    operation: int
    mode: GenerationMode
    cases: int
    number: int


def ask(address: str, cases: int, number: int = 1, workers: int = 1, asked: Asked | None = None) -> Asked:
    """Ask `cases` times or more, spread over all operations that say anything, half of them against the document.

    Args:
        address: of a service.
        cases: requests.
        number: another one makes up other requests.
        workers: processes that ask at once; 1: this one alone.
        asked: counted up meanwhile.
    """
    asked, round_number = asked or Asked(), 0
    with _mapping(workers) as mapped:
        while asked.total < cases and not asked.wrong:
            for found in mapped(_ask, list(_tasks(address, cases - asked.total, 1000 * number + round_number))):
                asked.add(found)
            round_number += 1
    return asked


@contextmanager
def _mapping(workers: int) -> Iterator[Callable[..., Any]]:
    """`map`, by so many processes."""
    if workers == 1:
        yield map
        return
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool.map


def _tasks(address: str, cases: int, number: int) -> Iterator[Task]:
    """What to ask so that some `cases` come together, in chunks, all operations in turn."""
    operations = _operations(address)
    stating = [i for i, each in enumerate(operations) if each.body or each.query or each.path_parameters]
    share = -(-cases // (2 * len(stating)))
    for begun in range(0, share, CHUNK):
        for i in range(len(operations)):
            for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
                if i in stating or (mode is GenerationMode.POSITIVE and begun == 0):
                    yield Task(address, i, mode, min(CHUNK, share - begun), 1000 * number + begun // CHUNK)


@functools.cache
def _operations(address: str) -> list[Any]:
    """The operations of the service's document, which must all be such that can be read."""
    document = schemathesis.openapi.from_url(f"{address}/openapi.json")
    return [_operation(found) for found in document.get_all_operations()]


def _operation(found: Any) -> Any:
    return found.ok()


def _ask(task: Task) -> Asked:
    """Ask some of it; the first wrong reply ends it."""
    asked, operation = Asked(), _operations(task.address)[task.operation]
    name = f"{operation.method.upper()} {operation.path}"
    checks = [CHECKS.get_one(name) for name in PROMISES]

    @seed(task.number)
    @settings(
        max_examples=task.cases,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    @given(operation.as_strategy(generation_mode=task.mode), st.sampled_from(SCENES))
    def each(case: Any, scene: str | None) -> None:
        _bring_within_reach(case, scene)
        reply = case.call(session=session, timeout=TIMEOUT_S)
        asked.replies[name, reply.status_code] += 1
        case.validate_response(reply, checks=checks)

    with warnings.catch_warnings(), requests.Session() as session:
        warnings.simplefilter("ignore")
        try:
            each()
        except FailureGroup as failures:
            asked.wrong.append(Wrong(name, "\n".join(map(str, failures.exceptions))))
        except Unsatisfiable:
            pass  # any text at all is a name of a scene: nothing is against the document
    return asked


def _bring_within_reach(case: Any, scene: str | None) -> None:
    """Make a request one that a small service can answer, where it states scenes, sizes and samples in the right form.

    What is against the document stays so.
    """
    if scene is not None and "/" not in scene and "scene_id" in (case.path_parameters or {}):
        case.path_parameters["scene_id"] = scene
    if isinstance(case.query, dict) and "width_px" in case.operation.query:
        _bring_sizes(case.query)
        _bring_samples(case.query)
    if isinstance(case.body, dict):
        stated = case.body.get("scene")
        if scene is not None and isinstance(stated, str) and len(stated) <= LONGEST_SCENE:
            case.body["scene"] = scene
        for name, bring in (("display", _bring_sizes), ("quality", _bring_samples)):
            if isinstance(part := case.body.setdefault(name, {}), dict):
                bring(part)


def _bring_sizes(display: dict[str, Any]) -> None:
    for side in ("width_px", "height_px"):
        stated = display.setdefault(side, SMALL_PX)
        if type(stated) is int and 0 < stated <= MAX_SIDE_PX:
            display[side] = 1 + stated % SMALL_PX


def _bring_samples(quality: dict[str, Any]) -> None:
    for samples in ("samples_per_cell", "shadow_samples"):
        stated = quality.get(samples)
        if type(stated) is int and 0 < stated <= MAX_SAMPLES:
            quality[samples] = 1 + stated % FEW_SAMPLES
