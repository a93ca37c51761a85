"""Effects that a request forces on or off, for those who ask what an effect costs."""

from __future__ import annotations

from renderer.errors import SettingsError

EFFECTS = ("cutouts", "textures", "normal_maps", "specular", "shadows", "soft_shadows", "reflection", "refraction")
"""All there are: `shadows` are the hard ones of point lights, `soft_shadows` those of lights with a size."""

EffectChoice = tuple[str, ...]
"""Names of effects, each behind `+` (on) or `-` (off); the others run where the scene calls for them."""


def read_effect_choice(text: str) -> EffectChoice:
    """The choice that `text` states: names behind + or -, with commas between; a bare name counts as +.

    What is no name of an effect is left for `require_effect_choice` to refuse.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    return tuple(word if word[0] in "+-" else f"+{word}" for word in words)


def require_effect_choice(field: str, value: object) -> EffectChoice:
    """Return `value` if it is a choice of effects, none of them both on and off.

    Raises:
        SettingsError: naming `field`, for anything else.
    """
    names = ", ".join(EFFECTS)
    if not isinstance(value, tuple):
        raise SettingsError(field, f"effects out of {names}, each behind + or -", value)
    for word in value:
        if not isinstance(word, str) or word[:1] not in ("+", "-") or word[1:] not in EFFECTS:
            raise SettingsError(field, f"effects out of {names}, each behind + or -", word)
    if len({word[1:] for word in value}) < len(value):
        raise SettingsError(field, "each effect once", ",".join(value))
    return value
