"""What tests expect, wait for, and tell of times.

    await_that(lambda: "ready: " in daemon.log(), "the server starts")
"""

import time

PATIENCE_S = 120  # of a busy machine; nothing waits this long when things are well


def check(holds, otherwise):
    if not holds:
        raise AssertionError(otherwise)


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else float("nan")


def await_that(condition, what, patience_s=PATIENCE_S):
    """`what` is expected: a text, or what returns it once it is clear that it does not come."""
    end = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() >= end:
            raise AssertionError(f"not within {patience_s} s: {what() if callable(what) else what}")
        time.sleep(0.01)
