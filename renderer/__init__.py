"""Gaze-dependent ray tracing: a scene, a gaze point and a display in, a frame out.

After A. Siekawa and R. Mantiuk, "Gaze-dependent Ray Tracing" (CESCG 2014). The files, in the order
a frame passes through them: `display`, `gaze`, `acuity`, `eccentricity`, `tiling` and `cellmap` turn
a gaze into cells; `camera`, `sampling` and `rays` turn cells into rays; `intersection`, `shading` and
`whitted` turn rays into radiance; `store`, `reconstruction` and `tonemap` turn radiance into a
picture; `pipeline` calls them in that order.
"""
