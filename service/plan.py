"""What to render for a configuration and a gaze: first a quick frame, then more and more samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

from renderer.acuity import MAX_SCALE
from renderer.frame import FrameCost, FrameRequest
from renderer.gaze import Gaze, GazeBucket
from renderer.prepared import PreparedScene
from renderer.quality import Quality
from renderer.steady_gaze import slack_deg, steady_bucket, within
from service.conditioning import Attention
from service.protocol import FramePhase
from service.rendering import Order
from service.request import StreamBody, gaze_on

DEADLINE_MS = 33.0
"""Time for the first frame after a move, rendered and encoded, where the quality states none."""

MOVING_QUALITY_DROP = 15
"""How much lower the quality of JPEG and WebP is while the gaze moves."""

LOWEST_QUALITY = 30

SACCADE_SCALE = 2.0
"""Cells are so much wider while the eye is on its way and sees little."""

UNCHANGED_FORMATS = ("png", "raw")
"""Formats that lose nothing, so that the last frame needs no other."""

EVERYWHERE_DEG = 90.0
"""Margin of a gaze that may be anywhere on the screen: all cells are as small as at the gaze."""


@dataclass(frozen=True, slots=True)
class Configuration:
    """What a session shows.

    Attributes:
        id: the client's number for it.
        body: as it was asked for.
        prepared: its scene.
        order: the same in the renderer's terms; its gaze means nothing.
    """

    id: int
    body: StreamBody
    prepared: PreparedScene
    order: Order


@dataclass(frozen=True, slots=True)
class Look:
    """What decides a picture besides its samples: equal looks refine one picture, another look begins anew.

    Attributes:
        bucket: the gazes it is for; None for the whole screen.
        margin_deg: error of the gaze to allow for.
        saccade: True for wider cells, and no refinement.
    """

    bucket: GazeBucket | None
    margin_deg: float
    saccade: bool


@dataclass(frozen=True, slots=True)
class Step:
    """One frame on the way to the best one.

    Attributes:
        request: what to render.
        phase: what to call it.
        format, image_quality: how to encode it.
    """

    request: FrameRequest
    phase: FramePhase
    format: str
    image_quality: int


def gaze_px(configuration: Configuration, attention: Attention) -> Gaze | None:
    """The newest good gaze on the configuration's display; None where there was none."""
    sample = attention.sample
    if sample is None or sample.x is None or sample.y is None:
        return None
    return gaze_on(configuration.order.request.display, sample.x, sample.y, sample.unit)


def look_at(configuration: Configuration, attention: Attention, margin_deg: float, before: Look | None) -> Look:
    """What to look at now.

    Args:
        configuration: in force.
        attention: of the eye.
        margin_deg: how far off the trackers say they may be.
        before: the look so far, with the same configuration; it stays while the gaze stays about its bucket.
    """
    quality = configuration.order.request.quality
    gaze = gaze_px(configuration, attention)
    if quality.map == "full" or gaze is None or attention.state == "lost":
        return Look(None, 0.0, saccade=False)
    side_px = quality.gaze_bucket_px
    bucket = steady_bucket(before.bucket if before is not None else None, gaze, side_px)
    display = configuration.order.request.display
    slack = slack_deg(side_px, max(display.pitch_x_cm, display.pitch_y_cm), display.distance_cm)
    margin = min(max(quality.acuity.margin_deg, margin_deg) + slack, EVERYWHERE_DEG)
    return Look(bucket, margin, attention.saccade)


def steps_of(configuration: Configuration, look: Look) -> int:
    """How many steps a look takes at most: a quick one, then 1, 2, 4, ... samples up to all of them."""
    samples = configuration.order.request.quality.samples_per_cell
    return 1 if look.saccade else 2 + (samples - 1).bit_length()


def step_of(configuration: Configuration, look: Look, attention: Attention, index: int, encode_ms: float) -> Step:
    """The step number `index` of a look, from 0.

    The first has one sample a cell, and cells so coarse that it fits the deadline; those after it take the time
    that they take.

    Args:
        configuration: in force.
        look: what to show.
        attention: of the eye.
        index: of the step.
        encode_ms: how long encoding will take, which the deadline has to leave room for [ms].
    """
    order = configuration.order
    gaze = gaze_px(configuration, attention)
    if look.bucket is not None and gaze is not None:
        gaze = within(look.bucket, gaze)
    quality, moving = _quality(order.request.quality, look), index == 0
    stated_ms = DEADLINE_MS if quality.deadline_ms is None else quality.deadline_ms
    deadline_ms = max(stated_ms - encode_ms, stated_ms / 2) if moving else None
    request = replace(
        order.request,
        gaze=gaze or order.request.gaze,
        quality=replace(quality, deadline_ms=deadline_ms),
        samples=1 if moving else min(2 ** (index - 1), quality.samples_per_cell),
    )
    drop = min(MOVING_QUALITY_DROP, max(0, order.image_quality - LOWEST_QUALITY)) if moving else 0
    return Step(request, "moving" if moving else "still", order.format, order.image_quality - drop)


def steps_done(step: Step, cost: FrameCost, index: int, steps: int) -> int:
    """How many of a look's steps need not be taken any more after number `index`."""
    if cost.acuity_scale > step.request.quality.acuity.scale:
        return index + 1
    if cost.error_met or cost.mean_samples >= step.request.quality.samples_per_cell:
        return steps
    return max(index + 1, 2)


def _quality(quality: Quality, look: Look) -> Quality:
    if quality.map == "full":
        return quality
    if look.bucket is None:
        return replace(quality, map="aligned", acuity=replace(quality.acuity, margin_deg=EVERYWHERE_DEG))
    scale = min(quality.acuity.scale * SACCADE_SCALE, MAX_SCALE) if look.saccade else quality.acuity.scale
    return replace(quality, acuity=replace(quality.acuity, margin_deg=look.margin_deg, scale=scale))
