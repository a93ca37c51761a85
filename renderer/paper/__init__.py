"""The paper's figures and numbers, computed again: what it prints, and what comes out here.

A. Siekawa and R. Mantiuk, "Gaze-dependent Ray Tracing" (CESCG 2014). Nothing here draws; see `clients.report`.
"""
