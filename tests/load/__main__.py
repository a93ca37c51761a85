"""The long form, with figures."""

from __future__ import annotations

import argparse

from tests.load.viewers import load
from tests.service.process import service_process


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.load", description=__doc__)
    parser.add_argument("--viewers", type=int, default=100, help="at once (default %(default)s)")
    parser.add_argument("--sessions", type=int, default=20, help="they are spread over (default %(default)s)")
    parser.add_argument("--minutes", type=float, default=10.0, help="for how long (default %(default)s)")
    asked = parser.parse_args()
    flags = ("--max-sessions", str(asked.sessions), "--max-viewers", str(asked.viewers))
    with service_process(*flags) as service:
        found = load(service, asked.viewers, asked.sessions, 60 * asked.minutes)
    rate = found.frames.total() / found.seconds
    print(f"frames    {rate:.0f} a second to {asked.viewers} viewers of {asked.sessions} sessions")
    print(f"share     the session with the fewest frames had {found.least_share:.2f} of the mean")
    print(
        f"requests  a 64x36 frame over HTTP took {found.request_at(0.5):.0f} ms (median), "
        f"{found.request_at(0.99):.0f} ms (99 %), of {len(found.request_ms)}"
    )
    print(f"memory    {found.memory_mib[0]:.0f} MiB after the warm-up, then {found.memory_growth_mib:+.1f} MiB")
    print(f"files     {min(found.descriptors)} to {max(found.descriptors)}")
    print(f"threads   {min(found.threads)} to {max(found.threads)}")
    print(f"lost      {len(found.lost)} connections or requests {found.lost[:3] or ''}")


if __name__ == "__main__":
    main()
