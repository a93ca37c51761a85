"""Plots and pages of what was measured: files in, pictures and self-contained HTML out.

Knows no renderer. What draws wants matplotlib (the extra `report`), which is imported when the first plot is made.
"""
