"""Nest pieces on sheets.

Lengths and counts that steer the search are choices of ours, to be judged with
tests/benchmarks/bench_nesting.py; those that decide what is proved say so.
"""
