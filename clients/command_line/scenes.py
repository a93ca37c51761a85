"""`gazetrace scenes`: what there is to render, and what each scene calls for."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from clients.command_line.errors import OK
from clients.command_line.progress import working
from clients.command_line.scene_argument import add_scenes_folder, load_scene, open_library
from renderer.errors import RenderError

if TYPE_CHECKING:
    from renderer.library import SceneLibrary
    from renderer.prepared import PreparedScene

DESCRIPTION = """\
List the scenes, or show one: its size, its view, and each effect it calls for with the reason.

An effect that a scene does not call for is never simulated: no rays, no time."""

EXAMPLES = """\
examples:
  gazetrace scenes
      All scenes: the built-in ones, then those of the scenes folder.

  gazetrace scenes --effects
      The same with title, size and effects, which means loading every scene.

  gazetrace scenes spheres
      One scene, and why it needs each of its effects.

  gazetrace scenes --scenes-folder my-scenes --json
      For a program to read."""


def add(commands: argparse._SubParsersAction[Any]) -> None:
    """Describe the command to argparse."""
    parser = commands.add_parser(
        "scenes",
        help="list the scenes, or show one",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="show this one; a path as for `render` will do too")
    parser.add_argument("--effects", action="store_true", help="list the effects that each scene calls for")
    parser.add_argument("--json", action="store_true", help="print JSON")
    add_scenes_folder(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """List all scenes or show one."""
    if arguments.scene is not None:
        record = scene_record(arguments.scene, load_scene(arguments.scene, arguments.scenes_folder))
        print(json.dumps(record, indent=2) if arguments.json else scene_text(record))
        return OK
    library = open_library(arguments.scenes_folder)
    if arguments.effects:
        records = [_loaded(library, scene_id) for scene_id in library.ids()]
    else:
        records = [{"id": scene_id} for scene_id in library.ids()]
    print(json.dumps(records, indent=2) if arguments.json else list_text(records))
    if not arguments.effects and sys.stdout.isatty():
        print("\n`gazetrace scenes NAME` shows one; `gazetrace scenes --effects` loads all and says what each holds.")
    return OK


def scene_record(name: str, prepared: PreparedScene) -> dict[str, Any]:
    """A scene as `--json` prints it."""
    scene, camera = prepared.scene, prepared.scene.camera
    return {
        "id": name,
        "title": scene.title,
        "triangles": scene.triangles,
        "spheres": len(scene.spheres),
        "lights": len(scene.lights),
        "effects": [{"name": effect.name, "reason": effect.reason} for effect in prepared.plan.effects],
        "camera": {
            "position": list(camera.position),
            "look_at": list(camera.look_at),
            "up": list(camera.up),
            "vertical_fov_deg": camera.vertical_fov_deg,
        },
    }


def scene_text(record: dict[str, Any]) -> str:
    """A scene for people."""
    camera = record["camera"]
    position, look_at = (", ".join(f"{part:g}" for part in camera[name]) for name in ("position", "look_at"))
    lines = [
        ("scene", " - ".join(part for part in (record["id"], record["title"]) if part)),
        ("size", f"{record['triangles']:,} triangles, {record['spheres']} spheres, {record['lights']} lights"),
        ("camera", f"at ({position}) looking at ({look_at}), {camera['vertical_fov_deg']:g} deg high"),
    ]
    reasons = [f"{effect['name']}: {effect['reason']}" for effect in record["effects"]]
    for index, reason in enumerate(reasons or ["none: primary rays only"]):
        lines.append(("effects" if index == 0 else "", reason))
    return "\n".join(f"{name:<8}{text}" for name, text in lines)


def list_text(records: list[dict[str, Any]]) -> str:
    """Each scene with what is known of it; one that cannot be loaded says why."""
    width = max((len(record["id"]) for record in records), default=0) + 2
    lines = []
    for record in records:
        about = [""]
        if "error" in record:
            about = [f"cannot be loaded: {record['error']}"]
        elif "effects" in record:
            effects = ", ".join(effect["name"] for effect in record["effects"]) or "no effects"
            about = [record["title"], f"{record['triangles']:,} triangles, {record['spheres']} spheres; {effects}"]
        for name, text in zip((record["id"], ""), about, strict=False):
            lines.append(f"{name:<{width}}{text}".rstrip())
    return "\n".join(lines)


def _loaded(library: SceneLibrary, scene_id: str) -> dict[str, Any]:
    """The scene's record, or its complaint: one broken scene must not hide the others."""
    try:
        with working(f"loading {scene_id}"):
            return scene_record(scene_id, library.load(scene_id))
    except RenderError as error:
        return {"id": scene_id, "error": str(error)}
