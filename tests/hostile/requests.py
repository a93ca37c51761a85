"""Requests that the service's own OpenAPI document allows, or just does not: every reply must be one it promises."""

from __future__ import annotations

import warnings
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable
from schemathesis.checks import CHECKS
from schemathesis.core.failures import FailureGroup
from schemathesis.generation import GenerationMode

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

SCENES = (None, "matte", "spheres")
"""Put in place of a name made up, which hardly ever is a scene's."""

SMALL_PX = 48
"""Sides are brought below this, so that most frames are within the limits and take milliseconds."""

TIMEOUT_S = 60.0


@dataclass
class Asked:
    """What was asked, and what came: requests by operation, replies by status, and what was wrong with some."""

    operations: Counter[str] = field(default_factory=Counter)
    statuses: Counter[int] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def ask(address: str, cases: int, number: int = 1) -> Asked:
    """Ask `cases` times, spread over all operations that say anything, half of them against the document.

    Args:
        address: of a service.
        cases: requests, at least.
        number: another one makes up other requests.
    """
    document = schemathesis.openapi.from_url(f"{address}/openapi.json")
    operations = [_operation(found) for found in document.get_all_operations()]
    stating = [each for each in operations if each.body or each.query or each.path_parameters]
    asked = Asked()
    share = -(-cases // (2 * len(stating)))
    for operation in operations:
        for mode in (GenerationMode.POSITIVE, GenerationMode.NEGATIVE):
            if operation in stating or mode is GenerationMode.POSITIVE:
                try:
                    _ask_operation(operation, mode, share, number, asked)
                except FailureGroup as failures:
                    asked.wrong.append(str(failures))
                except Unsatisfiable:
                    continue  # any text at all is a name of a scene: nothing is against the document
    return asked


def _operation(found: Any) -> Any:
    """An operation of the document, which must be one that can be read."""
    return found.ok()


def _ask_operation(operation: Any, mode: GenerationMode, cases: int, number: int, asked: Asked) -> None:
    checks = [CHECKS.get_one(name) for name in PROMISES]

    @seed(number)
    @settings(
        max_examples=cases,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    @given(operation.as_strategy(generation_mode=mode), st.sampled_from(SCENES))
    def each(case: Any, scene: str | None) -> None:
        _bring_within_reach(case, scene)
        reply = case.call(timeout=TIMEOUT_S)
        asked.operations[f"{operation.method.upper()} {operation.path}"] += 1
        asked.statuses[reply.status_code] += 1
        case.validate_response(reply, checks=checks)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        each()


def _bring_within_reach(case: Any, scene: str | None) -> None:
    """Make a request one that a small service can answer, where it states sizes and scenes in the right form."""
    if scene is not None and "scene_id" in (case.path_parameters or {}):
        case.path_parameters["scene_id"] = scene
    sized = [case.query]
    if isinstance(case.body, dict):
        if scene is not None and isinstance(case.body.get("scene"), str):
            case.body["scene"] = scene
        sized.append(case.body.get("display"))
    for sizes in sized:
        if isinstance(sizes, dict):
            for side in ("width_px", "height_px"):
                if type(sizes.get(side)) is int and sizes[side] > 0:
                    sizes[side] = 1 + sizes[side] % SMALL_PX
