"""The renderer against renderers that others wrote: POV-Ray and Mitsuba."""
